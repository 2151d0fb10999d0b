//! For how long an answer stays valid: how far the camera may go and turn before it can change.
//!
//! Between two poses a point at distance ρ from the eye moves in camera space by at most
//! `|Δeye| + |ΔR| ρ`, with R the rotation. A view sums up both; an answer keeps the sums at which it
//! ends, so that the first end of many answers is a minimum of each sum, whatever their distances. What an answer
//! tolerates is shared out to both as the camera goes and turns now.

use crate::stretch::largest_stretch;
use crate::view::View;

/// What rounding may take off a step of the camera, relative.
const ROUNDING_ALLOWANCE: f32 = 1.001;

/// The least share of a tolerance that either of moves and turns gets.
const LEAST_SHARE: f64 = 0.1;

/// The farthest move that is tolerated, as a share of the distance, and the farthest turn; and how much of both
/// is tolerated at least, however fast the camera does the other.
const FARTHEST_MOVE: f32 = 0.25;
const FARTHEST_TURN: f32 = 0.5;
const LEAST_AHEAD: f32 = 0.05;

/// How far a view has moved and turned in all since its last reset.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CameraTravel {
    moved: f64,
    turned: f64,
    resets: u32,
    /// Means of the latest steps, newer ones counting more.
    pace: [f64; 2],
    /// How many frames in a row have ended every validity.
    resets_in_a_row: u32,
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
            ..Self::default()
        }
    }

    /// The latest step by itself.
    pub(crate) fn step(&self) -> Tolerance {
        Tolerance {
            moved: self.moved as f32,
            turned: self.turned as f32,
        }
    }

    /// The most that is worth tolerating of what is `farthest` away: as far ahead as the camera goes and turns now.
    pub(crate) fn ahead(&self, farthest: f32) -> Tolerance {
        let most = Tolerance {
            moved: farthest * FARTHEST_MOVE,
            turned: FARTHEST_TURN,
        };
        let [moved, turned] = self.pace.map(|pace| pace as f32);
        let steps = (most.moved / moved).min(most.turned / turned);
        if !steps.is_finite() {
            return most;
        }
        // It may begin to turn or to move. No clamp, which panics at NaN.
        let within = |ahead: f32, most: f32| ahead.max(most * LEAST_AHEAD).min(most);
        Tolerance {
            moved: within(moved * steps, most.moved),
            turned: within(turned * steps, most.turned),
        }
    }

    /// Whether the sums are numbers still.
    pub(crate) fn is_finite(&self) -> bool {
        self.moved.is_finite() && self.turned.is_finite()
    }

    pub(crate) fn add(&mut self, step: &Self) {
        self.moved += step.moved;
        self.turned += step.turned;
        let [moved, turned] = self.pace;
        self.pace = [
            (moved * 3.0 + step.moved) * 0.25,
            (turned * 3.0 + step.turned) * 0.25,
        ];
    }

    /// Ends every validity.
    pub(crate) fn reset(&mut self) {
        *self = Self {
            resets: self.resets.wrapping_add(1),
            resets_in_a_row: self.resets_in_a_row.saturating_add(1),
            ..Self::default()
        };
    }

    /// Notes a frame that has ended none.
    pub(crate) fn go_on(&mut self) {
        self.resets_in_a_row = 0;
    }

    /// Whether validities will end before they are asked for, as while a lens zooms.
    pub(crate) fn is_restless(&self) -> bool {
        self.resets_in_a_row > 1
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

/// How far a camera moves and turns: a length, and the most that a unit vector changes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tolerance {
    pub(crate) moved: f32,
    pub(crate) turned: f32,
}

impl Tolerance {
    pub(crate) fn times(&self, factor: f32) -> Self {
        Self {
            moved: self.moved * factor,
            turned: self.turned * factor,
        }
    }

    /// The larger of each.
    pub(crate) fn larger(&self, other: &Self) -> Self {
        Self {
            moved: self.moved.max(other.moved),
            turned: self.turned.max(other.turned),
        }
    }

    /// Whether both are more than of another.
    pub(crate) fn holds(&self, other: &Self) -> bool {
        self.moved > other.moved && self.turned > other.turned
    }
}

/// How long an answer is valid: until the camera has moved or turned so far, since the same reset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Validity {
    moved_until: f64,
    turned_until: f64,
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
        moved_until: f64::NEG_INFINITY,
        turned_until: f64::NEG_INFINITY,
        resets: 0,
    };

    /// Valid while points within `max_distance` move no farther than `tolerance` from now on.
    pub(crate) fn tolerating(tolerance: f64, max_distance: f32, now: &CameraTravel) -> Self {
        // NaN is never valid.
        if tolerance.is_nan() || tolerance <= 0.0 {
            return Self::NONE;
        }
        let max_distance = f64::from(max_distance);
        if max_distance == 0.0 {
            return Self {
                moved_until: now.moved + tolerance,
                turned_until: f64::INFINITY,
                resets: now.resets,
            };
        }
        let [moving, turning] = [now.pace[0], now.pace[1] * max_distance];
        let share = moving / (moving + turning);
        // Where it stands, either may come.
        let share = if share.is_nan() { 0.5 } else { share };
        let share = share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        let turn = tolerance * (1.0 - share) / max_distance;
        Self {
            moved_until: now.moved + tolerance * share,
            turned_until: now.turned + if turn.is_nan() { 0.0 } else { turn },
            resets: now.resets,
        }
    }

    /// Valid while the camera goes and turns no farther than a tolerance.
    pub(crate) fn within(tolerance: &Tolerance, now: &CameraTravel) -> Self {
        Self {
            moved_until: now.moved + f64::from(tolerance.moved * 0.999),
            turned_until: now.turned + f64::from(tolerance.turned * 0.999),
            resets: now.resets,
        }
    }

    /// Valid for good: what is true of nothing.
    pub(crate) fn forever(now: &CameraTravel) -> Self {
        Self::tolerating(f64::INFINITY, 0.0, now)
    }

    pub(crate) fn lasts(&self, now: &CameraTravel) -> bool {
        self.resets == now.resets && now.moved < self.moved_until && now.turned < self.turned_until
    }

    /// Valid while both are.
    pub(crate) fn and(&self, other: &Self, now: &CameraTravel) -> Self {
        if self.resets != now.resets || other.resets != now.resets {
            return Self::NONE;
        }
        Self {
            moved_until: self.moved_until.min(other.moved_until),
            turned_until: self.turned_until.min(other.turned_until),
            resets: now.resets,
        }
    }
}
