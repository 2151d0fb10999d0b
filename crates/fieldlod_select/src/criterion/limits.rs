//! The limits of errors within which an instance keeps its level.
//!
//! ```text
//! error in pixels = E · scale(view, sphere)
//! E ≥ lowest    of the finest refined group
//! E ≤ highest   of all finer groups
//! ```
//! The weights of the criterion depend on the direction. `E` is computed with their least and with their greatest
//! value. The criterion itself decides an instance between the two.

use camera_field::Camera;
use fieldlod_hierarchy::Group;
use wide::f32x8;

use super::error_bounds::{ErrorBounds, or_infinity};
use super::{
    normal_variance, px_per_unit, silhouette_weight, silhouette_width, usable_deviation,
    visible_weight,
};
use crate::lanes::bits::LANES;
use crate::lanes::{Lane, bits_of};
use crate::settings::LodSettings;

/// Limits of allowed errors within which an instance keeps its level, in local or world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    /// The finest refined group has at least this error; infinite at the coarsest level, which needs no refined group.
    pub(crate) lowest: f32,
    /// No finer group has a larger error.
    pub(crate) highest: f32,
}

impl Limits {
    /// Limits of instances that must be decided in each frame.
    pub(crate) const UNKNOWN: Self = Self {
        lowest: f32::NAN,
        highest: f32::NAN,
    };
    /// Limits of instances at a forced level.
    pub(crate) const FIXED: Self = Self {
        lowest: f32::INFINITY,
        highest: -1.0,
    };
    /// Limits of free slots and of instances that are not drawn.
    pub(crate) const EMPTY: Self = Self {
        lowest: f32::INFINITY,
        highest: -2.0,
    };

    /// The limits in the world. Errors grow by a factor between `least` and `most`.
    pub(crate) fn scaled(self, [least, most]: [f32; 2]) -> Self {
        Self {
            lowest: self.lowest * least,
            highest: self.highest * most,
        }
    }
}

/// The errors of all levels of a mesh that is drawn as a whole. For another mesh, only the errors of its coarsest
/// level.
#[derive(Clone, Debug, Default)]
pub(crate) struct LevelErrors {
    /// The error of each level's group from the directions of the least and the largest weight, and its deviation,
    /// eight levels to an element. They are finite, so that zero times an error is zero. The errors of the last level
    /// are not used.
    least: Vec<[f32; LANES]>,
    most: Vec<[f32; LANES]>,
    deviation: Vec<[f32; LANES]>,
    /// The largest error and deviation of the finer levels.
    finer: Vec<[f32; 2]>,
}

/// Allowed errors in the world, of groups that were not refined and of groups that were refined.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Allowed<L> {
    /// A group with at most this error is certainly not refined.
    pub(crate) coarse: [L; 2],
    /// A group with a larger error is certainly refined.
    pub(crate) fine: [L; 2],
}

/// Weights of errors and deviations in one unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ErrorUnits {
    pub(crate) error: f32,
    pub(crate) deviation: f32,
}

impl ErrorUnits {
    /// The weight of errors is 1 if errors count; otherwise the weight of deviations is 1.
    pub(crate) fn new(camera: &Camera, settings: &LodSettings) -> Self {
        let weights = settings.error_weights();
        let px = px_per_unit(camera);
        // Errors count by the mean of both axes, deviations by the larger axis.
        let larger = (px.max_element() / px.min_element()).sqrt();
        let weight = weights.displacement_weight.unwrap_or(0.0);
        if weights.counts_error {
            Self {
                error: 1.0,
                deviation: weight * larger,
            }
        } else {
            Self {
                error: 0.0,
                deviation: weight,
            }
        }
    }

    /// The same weights, with errors that count √`share` times.
    pub(crate) fn hidden_to(self, share: f32) -> Self {
        Self {
            error: self.error * share.sqrt(),
            ..self
        }
    }

    #[inline]
    fn of(&self, error: f32, deviation: f32) -> f32 {
        // An error that does not count may be infinite.
        let counted = |value: f32, unit: f32| if unit == 0.0 { 0.0 } else { value * unit };
        or_infinity(counted(error, self.error)).max(or_infinity(counted(deviation, self.deviation)))
    }
}

impl LevelErrors {
    /// The errors of the levels of a chain of groups; without a chain, of a cut that refines none of `groups`.
    pub(crate) fn new(groups: &[Group], is_chain: bool) -> Self {
        let mut levels = Self::default();
        if is_chain {
            for level in 0..groups.len() {
                levels.push(&groups[level], &groups[..level]);
            }
        } else {
            levels.push(&Group::default(), groups);
        }
        levels
    }

    fn push(&mut self, own: &Group, finer: &[Group]) {
        // The weight is least for a camera behind the surface, or for one that sees no silhouette.
        let facing = own.mean_normal.length();
        let variance = normal_variance(own.mean_normal);
        let flatness = facing * facing / silhouette_width(variance);
        let least_weight = visible_weight(-facing, variance).max(0.0) + silhouette_weight(flatness);
        let least = own.error_in_local * least_weight.sqrt();
        let most = ErrorBounds::of_group(own).error_weighed;
        let (level, deviation) = (self.finer.len(), usable_deviation(own));
        for (column, error) in [
            (&mut self.least, least),
            (&mut self.most, most),
            (&mut self.deviation, deviation),
        ] {
            column.resize(level / LANES + 1, [0.0; LANES]);
            column[level / LANES][level % LANES] = or_infinity(error).min(f32::MAX);
        }
        let bounds = ErrorBounds::around(finer.iter().map(ErrorBounds::of_group));
        self.finer.push([bounds.error_weighed, bounds.deviation]);
    }

    /// The coarsest level.
    pub(crate) fn coarsest(&self) -> usize {
        self.finer.len() - 1
    }

    /// The limits of a level in local units.
    #[inline]
    pub(crate) fn limits(&self, level: usize, units: &ErrorUnits) -> Limits {
        let own = |column: &[[f32; LANES]]| column.as_flattened()[level];
        let [finer_error, finer_deviation] = self.finer[level];
        Limits {
            lowest: match level == self.coarsest() {
                true => f32::INFINITY,
                false => units.of(own(&self.least), own(&self.deviation)),
            },
            highest: units.of(finer_error, finer_deviation),
        }
    }

    /// The first level whose group is certainly refined, after a frame at level `was`; `None` if a group before it is
    /// neither certainly refined nor certainly not. `scale` is the least and the largest factor of errors in the world.
    /// `weight` has the factors of errors of groups that were not refined and of groups that were refined.
    #[inline]
    pub(crate) fn certain_level(
        &self,
        units: &ErrorUnits,
        was: usize,
        allowed: &Allowed<f32>,
        [scale, weight]: [[f32; 2]; 2],
    ) -> Option<usize> {
        let splat = |[not, refined]: [f32; 2]| [f32x8::splat(not), f32x8::splat(refined)];
        let (coarse, fine) = (splat(allowed.coarse), splat(allowed.fine));
        let [least_scale, most_scale] = splat(scale);
        let weight = splat(weight.map(|weight| weight * units.error));
        let deviation_weight = f32x8::splat(units.deviation);
        for block in 0..self.least.len() {
            let level = f32x8::splat((block * LANES) as f32) + FIRST_LEVELS;
            let was_refined = f32x8::splat(was as f32).is_at_most(level);
            let of_was = |[not, refined]: [f32x8; 2]| f32x8::choose(was_refined, refined, not);
            let deviation = f32x8::new(self.deviation[block]) * deviation_weight;
            let shown =
                |errors: [f32; LANES]| (f32x8::new(errors) * of_was(weight)).larger(deviation);
            let most = shown(self.most[block]) * most_scale;
            let least = shown(self.least[block]) * least_scale;
            let fits = bits_of(most.is_at_most(of_was(coarse)));
            let exceeds = bits_of(of_was(fine).is_below(least));
            // NaN is not certain.
            let lane = (!fits).trailing_zeros() as usize;
            let level = block * LANES + lane;
            if level >= self.coarsest() {
                return Some(self.coarsest());
            }
            if lane < LANES {
                return (exceeds >> lane & 1 == 1).then_some(level);
            }
        }
        None
    }
}

/// The first eight levels.
const FIRST_LEVELS: f32x8 = f32x8::new([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
