//! For how long an answer stays valid: how far the camera may go, turn and zoom before it can change.
//!
//! Between two poses a point at distance ρ from the eye moves in camera space by at most
//! `|Δeye| + |ΔR| ρ`, with R the rotation; a lens changes the distance at which an error shows, or that to a
//! side of the view, in proportion to them ([`zoom_between`]). A view sums up the three; an answer keeps the sums
//! at which it ends, so that the first end of many answers is a minimum of each sum, whatever their distances.
//! What an answer tolerates is shared out to the three as the camera goes, turns and zooms now.

use crate::stretch::largest_stretch;
use crate::view::View;
use crate::zoom::{GROWTH, MOST_ZOOM, zoom_between};

/// What rounding may take off a step of the camera, relative.
const ROUNDING_ALLOWANCE: f32 = 1.001;

/// The least share of a tolerance that each of moves, turns and zooms gets.
const LEAST_SHARES: [f64; 3] = [0.1, 0.1, 0.05];

/// The farthest move that is tolerated, as a share of the distance, the farthest turn and zoom; and how much of each
/// is tolerated at least, however fast the camera does the others.
const FARTHEST_MOVE: f32 = 0.25;
const FARTHEST_TURN: f32 = 0.5;
const FARTHEST_ZOOM: f32 = 0.25;
const LEAST_AHEAD: f32 = 0.05;

/// How far a view has moved, turned and zoomed in all since its last reset.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CameraTravel {
    moved: f64,
    turned: f64,
    /// Rounded up.
    zoomed: f32,
    resets: u32,
    /// Means of the latest steps, newer ones counting more.
    pace: [f64; 3],
    /// How many frames in a row have ended every validity.
    resets_in_a_row: u32,
}

impl CameraTravel {
    /// The travel between two views; `None` if their lenses cannot be compared.
    pub(crate) fn between(from: &View, to: &View) -> Option<Self> {
        // Points move with the eye, and with the turn as far as they are away.
        let moved = (to.eye_in_world - from.eye_in_world).length();
        let turned = largest_stretch(&(to.camera_from_world - from.camera_from_world));
        Some(Self {
            zoomed: zoom_between(from, to)? * ROUNDING_ALLOWANCE,
            ..Self::of(moved, turned)
        })
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
            zoomed: self.zoomed,
        }
    }

    /// The most that is worth tolerating of what is `farthest` away: as far ahead as the camera goes, turns and zooms
    /// now.
    pub(crate) fn ahead(&self, farthest: f32) -> Tolerance {
        let most = Tolerance {
            moved: farthest * FARTHEST_MOVE,
            turned: FARTHEST_TURN,
            zoomed: FARTHEST_ZOOM,
        };
        let [moved, turned, zoomed] = self.pace.map(|pace| pace as f32);
        let steps = (most.moved / moved).min(most.turned / turned);
        let steps = steps.min(most.zoomed / zoomed);
        if !steps.is_finite() {
            return most;
        }
        // It may begin to do the others. No clamp, which panics at NaN.
        let within = |ahead: f32, most: f32| ahead.max(most * LEAST_AHEAD).min(most);
        Tolerance {
            moved: within(moved * steps, most.moved),
            turned: within(turned * steps, most.turned),
            zoomed: within(zoomed * steps, most.zoomed),
        }
    }

    /// Whether the sums are numbers still.
    pub(crate) fn is_finite(&self) -> bool {
        self.moved.is_finite() && self.turned.is_finite()
    }

    pub(crate) fn add(&mut self, step: &Self) {
        self.moved += step.moved;
        self.turned += step.turned;
        if step.zoomed > 0.0 {
            self.zoomed = (self.zoomed + step.zoomed).next_up();
        }
        let steps = [step.moved, step.turned, f64::from(step.zoomed)];
        for (pace, step) in self.pace.iter_mut().zip(steps) {
            *pace = (*pace * 3.0 + step) * 0.25;
        }
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

    /// Whether validities will end before they are asked for, as while settings change.
    pub(crate) fn is_restless(&self) -> bool {
        self.resets_in_a_row > 1
    }

    /// Whether moves and turns alone lie between the two.
    pub(crate) fn has_same_lens(&self, other: &Self) -> bool {
        self.resets == other.resets && self.zoomed == other.zoomed
    }

    /// Whether the lens zooms.
    pub(crate) fn zooms(&self) -> bool {
        self.zoomed > 0.0
    }

    /// How far points within `max_distance` of the eye have moved in camera space, at most.
    pub(crate) fn of_points_within(&self, max_distance: f32) -> f64 {
        self.moved + self.turned * f64::from(max_distance)
    }
}

/// How far a camera moves, turns and zooms: a length, the most that a unit vector changes, and what
/// [`zoom_between`] gives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tolerance {
    pub(crate) moved: f32,
    pub(crate) turned: f32,
    pub(crate) zoomed: f32,
}

impl Tolerance {
    pub(crate) fn times(&self, factor: f32) -> Self {
        Self {
            moved: self.moved * factor,
            turned: self.turned * factor,
            zoomed: self.zoomed * factor,
        }
    }

    /// The larger of each.
    pub(crate) fn larger(&self, other: &Self) -> Self {
        Self {
            moved: self.moved.max(other.moved),
            turned: self.turned.max(other.turned),
            zoomed: self.zoomed.max(other.zoomed),
        }
    }

    /// Whether all are more than of another.
    pub(crate) fn holds(&self, other: &Self) -> bool {
        self.moved > other.moved && self.turned > other.turned && self.zoomed > other.zoomed
    }
}

/// By how far turns and zooms change an answer's distance to where it ends, at most: the farthest that points are,
/// and that errors and sides are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Levers {
    pub(crate) turn: f32,
    pub(crate) zoom: f32,
}

/// How long an answer is valid: until the camera has moved, turned or zoomed so far, since the same reset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Validity {
    moved_until: f64,
    turned_until: f64,
    zoomed_until: f32,
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
        zoomed_until: f32::NEG_INFINITY,
        resets: 0,
    };

    /// Valid until moves, and turns and zooms times their levers, make up `tolerance` from now on. Of an infinite
    /// lever nothing is tolerated.
    pub(crate) fn tolerating(tolerance: f64, levers: &Levers, now: &CameraTravel) -> Self {
        // NaN is never valid.
        if tolerance.is_nan() || tolerance <= 0.0 {
            return Self::NONE;
        }
        let levers = [1.0, f64::from(levers.turn), f64::from(levers.zoom * GROWTH)];
        let shares = shares(&levers, now);
        let until: [f64; 3] = std::array::from_fn(|part| {
            let most = tolerance * shares[part] / levers[part];
            match levers[part] == 0.0 {
                true => f64::INFINITY,
                false if most.is_nan() => 0.0,
                false => most,
            }
        });
        Self {
            moved_until: now.moved + until[0],
            turned_until: now.turned + until[1],
            zoomed_until: zoomed_until(until[2], now),
            resets: now.resets,
        }
    }

    /// Valid while the camera goes, turns and zooms no farther than a tolerance.
    pub(crate) fn within(tolerance: &Tolerance, now: &CameraTravel) -> Self {
        Self {
            moved_until: now.moved + f64::from(tolerance.moved * 0.999),
            turned_until: now.turned + f64::from(tolerance.turned * 0.999),
            zoomed_until: zoomed_until(f64::from(tolerance.zoomed), now),
            resets: now.resets,
        }
    }

    /// Valid wherever the camera goes and turns, while its lens zooms no farther.
    pub(crate) fn while_zoomed(zoom: f32, now: &CameraTravel) -> Self {
        Self {
            zoomed_until: zoomed_until(f64::from(zoom), now),
            ..Self::forever(now)
        }
    }

    /// Valid for good: what is true of nothing.
    pub(crate) fn forever(now: &CameraTravel) -> Self {
        Self {
            moved_until: f64::INFINITY,
            turned_until: f64::INFINITY,
            zoomed_until: f32::INFINITY,
            resets: now.resets,
        }
    }

    pub(crate) fn lasts(&self, now: &CameraTravel) -> bool {
        self.resets == now.resets
            && now.moved < self.moved_until
            && now.turned < self.turned_until
            && now.zoomed <= self.zoomed_until
    }

    /// Valid while both are.
    pub(crate) fn and(&self, other: &Self, now: &CameraTravel) -> Self {
        if self.resets != now.resets || other.resets != now.resets {
            return Self::NONE;
        }
        Self {
            moved_until: self.moved_until.min(other.moved_until),
            turned_until: self.turned_until.min(other.turned_until),
            zoomed_until: self.zoomed_until.min(other.zoomed_until),
            resets: now.resets,
        }
    }
}

/// The shares of a tolerance, as the camera goes, turns and zooms; where it stands, each may come. Without and with
/// infinite levers there is nothing to share.
fn shares(levers: &[f64; 3], now: &CameraTravel) -> [f64; 3] {
    let or_none = |part: usize, share: f64| match levers[part] > 0.0 && levers[part].is_finite() {
        true => share,
        false => 0.0,
    };
    let least: [f64; 3] = std::array::from_fn(|part| or_none(part, LEAST_SHARES[part]));
    let weights: [f64; 3] =
        std::array::from_fn(|part| or_none(part, now.pace[part] * levers[part]));
    let rest = 1.0 - least.iter().sum::<f64>();
    let sum: f64 = weights.iter().sum();
    std::array::from_fn(|part| {
        let weight = weights[part] / sum;
        let weight = if weight.is_nan() { 1.0 / 3.0 } else { weight };
        least[part] + or_none(part, rest * weight)
    })
}

/// The sum at which a tolerance ends, rounded down; with none of it a zoom of none is valid still.
fn zoomed_until(tolerance: f64, now: &CameraTravel) -> f32 {
    let most = (tolerance as f32).min(MOST_ZOOM);
    (now.zoomed + most).next_down().max(now.zoomed)
}
