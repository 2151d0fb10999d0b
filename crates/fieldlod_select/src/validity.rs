//! For how long an answer stays valid: how far the camera may go and turn before it can change.
//!
//! Between two poses a point at distance ρ from the eye moves in camera space by at most
//! `|Δeye| + |ΔR| ρ`, with R the rotation. A view sums up both; an answer keeps the sum at which it
//! ends.

use crate::stretch::largest_stretch;
use crate::view::View;

/// What rounding may take off a step of the camera, relative.
const ROUNDING_ALLOWANCE: f32 = 1.001;

/// How far a view has moved and turned in all since its last reset.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CameraTravel {
    moved: f64,
    turned: f64,
    resets: u32,
}

impl CameraTravel {
    /// The travel between two poses.
    pub(crate) fn between(from: &View, to: &View) -> Self {
        // Points move with the eye, and with the turn as far as they are away.
        let moved = (to.eye_in_world - from.eye_in_world).length();
        let turned = largest_stretch(&(to.camera_from_world - from.camera_from_world));
        Self::of(moved, turned)
    }

    /// The travel that has the same effect as what lights did between two views; `None` if they are others.
    pub(crate) fn of_lights(from: &View, to: &View) -> Option<Self> {
        let (moved, turned) = to.shadow_lights.moved_since(&from.shadow_lights)?;
        Some(Self::of(moved, turned))
    }

    fn of(moved: f32, turned: f32) -> Self {
        Self {
            moved: f64::from(moved * ROUNDING_ALLOWANCE),
            turned: f64::from(turned * ROUNDING_ALLOWANCE),
            resets: 0,
        }
    }

    /// Whether the sums are numbers still.
    pub(crate) fn is_finite(&self) -> bool {
        self.moved.is_finite() && self.turned.is_finite()
    }

    pub(crate) fn add(&mut self, step: &Self) {
        self.moved += step.moved;
        self.turned += step.turned;
    }

    /// Ends every validity.
    pub(crate) fn reset(&mut self) {
        *self = Self {
            resets: self.resets.wrapping_add(1),
            ..Self::default()
        };
    }

    /// Whether sums of both can be compared.
    pub(crate) fn is_comparable(&self, other: &Self) -> bool {
        self.resets == other.resets
    }

    /// How far points within `max_distance` of the eye have moved in camera space, at most.
    pub(crate) fn of_points_within(&self, max_distance: f32) -> f64 {
        self.moved + self.turned * f64::from(max_distance)
    }
}

/// How long an answer is valid: until points within a distance have moved so far, since the same
/// reset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Validity {
    until: f64,
    max_distance: f32,
    resets: u32,
}

impl Default for Validity {
    fn default() -> Self {
        Self::NONE
    }
}

impl Validity {
    /// Valid for no frame but this.
    pub(crate) const NONE: Self = Self {
        until: f64::NEG_INFINITY,
        max_distance: 0.0,
        resets: 0,
    };

    /// Valid while points within `max_distance` move no farther than `tolerance` from now on.
    pub(crate) fn tolerating(tolerance: f64, max_distance: f32, now: &CameraTravel) -> Self {
        Self::until(
            now.of_points_within(max_distance) + tolerance,
            max_distance,
            now,
        )
    }

    /// Valid for good: what is true of nothing.
    pub(crate) fn forever(now: &CameraTravel) -> Self {
        Self::until(f64::INFINITY, 0.0, now)
    }

    /// Valid until points within `max_distance` have [moved](CameraTravel::of_points_within) so far.
    pub(crate) fn until(until: f64, max_distance: f32, now: &CameraTravel) -> Self {
        Self {
            until,
            max_distance,
            resets: now.resets,
        }
    }

    fn remaining(&self, now: &CameraTravel) -> f64 {
        if self.resets == now.resets {
            self.until - now.of_points_within(self.max_distance)
        } else {
            f64::NEG_INFINITY
        }
    }

    pub(crate) fn lasts(&self, now: &CameraTravel) -> bool {
        self.remaining(now) > 0.0
    }

    /// Valid while both are.
    pub(crate) fn and(&self, other: &Self, now: &CameraTravel) -> Self {
        let remaining = self.remaining(now).min(other.remaining(now));
        Self::tolerating(remaining, self.max_distance.max(other.max_distance), now)
    }
}
