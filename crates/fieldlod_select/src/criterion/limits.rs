//! The limits of errors within which an instance keeps its level.
//!
//! ```text
//! error in pixels = E · scale(view, sphere)
//! E ≥ lowest    of the finest refined group
//! E ≤ highest   of all finer groups
//! ```
//! The weights of the criterion depend on the direction. `E` is computed with their least and with their greatest
//! value. The criterion itself decides an instance between the two.

use camera_field::{Camera, FieldOfView};
use fieldlod_hierarchy::Group;

use super::error_bounds::{ErrorBounds, or_infinity};
use super::{
    normal_variance, silhouette_weight, silhouette_width, usable_deviation, visible_weight,
};
use crate::lanes::larger;
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
pub(crate) struct LevelErrors(Vec<LevelError>);

/// The errors of one level.
#[derive(Clone, Copy, Debug)]
struct LevelError {
    /// The error of its group from the directions of the least and the largest weight, and its deviation. They are
    /// finite, so that zero times an error is zero. The errors of the last level are not used.
    least: f32,
    most: f32,
    deviation: f32,
    /// The largest error and deviation of the finer levels.
    finer: [f32; 2],
}

/// Allowed errors in the world, of groups that were not refined and of groups that were refined.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Allowed {
    /// A group with at most this error is certainly not refined.
    pub(crate) coarse: [f32; 2],
    /// A group with a larger error is certainly refined.
    pub(crate) fine: [f32; 2],
}

/// Weights that bring errors and deviations to one unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ErrorUnits {
    pub(crate) error: f32,
    pub(crate) deviation: f32,
}

impl ErrorUnits {
    /// The weight of errors is 1 if errors count. Otherwise the weight of deviations is 1, or 0 without thresholds.
    pub(crate) fn new(camera: &Camera, settings: &LodSettings) -> Self {
        let weights = settings.error_weights();
        let px = FieldOfView::of(camera).px_per_unit;
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

    /// The same weights, with errors that count `weight` times.
    pub(crate) fn weighed(self, weight: f32) -> Self {
        Self {
            error: self.error * weight,
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
    /// The errors of the levels of a chain of groups; without a chain, of the coarsest cut of `groups`.
    pub(crate) fn new(groups: &[Group], is_chain: bool) -> Self {
        let levels =
            (0..groups.len()).map(|level| LevelError::new(&groups[level], &groups[..level]));
        if is_chain {
            Self(levels.collect())
        } else {
            Self(vec![LevelError::new(&Group::default(), groups)])
        }
    }

    /// The coarsest level.
    pub(crate) fn coarsest(&self) -> usize {
        self.0.len() - 1
    }

    /// The limits of a level in local units.
    #[inline]
    pub(crate) fn limits(&self, level: usize, units: &ErrorUnits) -> Limits {
        let errors = &self.0[level];
        let [finer_error, finer_deviation] = errors.finer;
        Limits {
            lowest: if level == self.coarsest() {
                f32::INFINITY
            } else {
                units.of(errors.least, errors.deviation)
            },
            highest: units.of(finer_error, finer_deviation),
        }
    }

    /// The first level whose group is certainly refined, after a frame at level `was`; `None` if a group before it is
    /// neither certainly refined nor certainly not. `least_scale` and `most_scale` bound the factor of errors in the
    /// world.
    #[inline]
    pub(crate) fn certain_level(
        &self,
        units: &ErrorUnits,
        was: usize,
        allowed: &Allowed,
        [least_scale, most_scale]: [f32; 2],
    ) -> Option<usize> {
        for (level, errors) in self.0[..self.coarsest()].iter().enumerate() {
            let was_refined = usize::from(level >= was);
            let deviation = errors.deviation * units.deviation;
            let shown = |error: f32| larger(error * units.error, deviation);
            // NaN is not certain.
            let fits = shown(errors.most) * most_scale <= allowed.coarse[was_refined];
            if !fits {
                let exceeds = allowed.fine[was_refined] < shown(errors.least) * least_scale;
                return exceeds.then_some(level);
            }
        }
        Some(self.coarsest())
    }
}

impl LevelError {
    fn new(own: &Group, finer: &[Group]) -> Self {
        // The weight is least for a camera right behind the surface: V grows with μ, and p falls with |μ|.
        let facing = own.mean_normal.length();
        let variance = normal_variance(own.mean_normal);
        let flatness = facing * facing / silhouette_width(variance);
        let least_weight = visible_weight(-facing, variance).max(0.0) + silhouette_weight(flatness);
        let finite = |error: f32| or_infinity(error).min(f32::MAX);
        let finer = ErrorBounds::around(finer.iter().map(ErrorBounds::of_group));
        Self {
            least: finite(own.error_in_local * least_weight.sqrt()),
            most: finite(ErrorBounds::of_group(own).error_weighed),
            deviation: finite(usable_deviation(own)),
            finer: [finer.error_weighed, finer.deviation],
        }
    }
}
