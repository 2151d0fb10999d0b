//! The limits of errors within which an instance keeps its level.
//!
//! ```text
//! shown error = E · scale(view, sphere)
//! E ≥ lowest    of the group that is refined last
//! E ≤ highest   of all finer groups
//! ```
//! The weights of the criterion depend on the direction; `E` has their least and their greatest value. An instance
//! between the two is decided by the criterion itself.

use fieldlod_hierarchy::Group;

use super::error_bounds::{ErrorBounds, or_infinity};
use super::{normal_variance, silhouette_weight, silhouette_width, visible_weight};
use crate::settings::LodSettings;
use camera_field::Camera;

/// Limits of allowed errors within which an instance keeps its level, in local or world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    /// The error of the group that is refined last shows at least this; infinite at the coarsest level, which
    /// needs no such group.
    pub(crate) lowest: f32,
    /// No error of finer groups shows more than this.
    pub(crate) highest: f32,
}

impl Limits {
    /// Of instances that have to be decided in each frame.
    pub(crate) const UNKNOWN: Self = Self {
        lowest: f32::NAN,
        highest: f32::NAN,
    };
    /// Of instances that are drawn at a level that no error changes.
    pub(crate) const FIXED: Self = Self {
        lowest: f32::INFINITY,
        highest: -1.0,
    };
    /// Of instances that are not there.
    pub(crate) const EMPTY: Self = Self {
        lowest: f32::INFINITY,
        highest: -2.0,
    };

    /// The same in the world, where errors grow by `[least, most]`.
    pub(crate) fn scaled(self, [least, most]: [f32; 2]) -> Self {
        Self {
            lowest: self.lowest * least,
            highest: self.highest * most,
        }
    }
}

/// The two kinds of errors of one level, before it is known how much each counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LevelErrors {
    /// Of the level's group, from the directions that it shows least and most in.
    own_errors: [f32; 2],
    own_deviation: f32,
    finer_error: f32,
    finer_deviation: f32,
}

/// How much errors and deviations count against each other, in one unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ErrorUnits {
    pub(crate) error: f32,
    pub(crate) deviation: f32,
}

impl ErrorUnits {
    /// Units in which an error counts once if it counts at all, and otherwise a deviation does.
    pub(crate) fn new(camera: &Camera, settings: &LodSettings) -> Self {
        let weights = settings.error_weights();
        let [x, y] = match camera {
            Camera::Perspective(camera) => camera.focal_px.to_array(),
            Camera::Orthographic(camera) => camera.pixels_per_unit.to_array(),
        };
        // Errors count by the mean of both axes, deviations by the larger one.
        let larger = (x.max(y) / x.min(y)).sqrt();
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

    fn of(&self, error: f32, deviation: f32) -> f32 {
        // An error that does not count may be infinite.
        let counted = |value: f32, unit: f32| if unit == 0.0 { 0.0 } else { value * unit };
        or_infinity(counted(error, self.error)).max(or_infinity(counted(deviation, self.deviation)))
    }
}

impl LevelErrors {
    /// The errors of a cut that refines no groups but always refined ones, out of `groups`.
    pub(crate) fn coarsest(groups: &[Group]) -> Self {
        let bounds = groups.iter().map(ErrorBounds::of_group);
        let finer = ErrorBounds::around(bounds).unwrap_or_default();
        Self {
            own_errors: [f32::INFINITY; 2],
            own_deviation: f32::INFINITY,
            finer_error: finer.error_weighed,
            finer_deviation: finer.deviation,
        }
    }

    /// The errors of one level of a mesh that is drawn as a whole: `finer` groups are not refined and `own` is.
    pub(crate) fn at_level(own: &Group, finer: &[Group]) -> Self {
        let coarsest = Self::coarsest(finer);
        if own.is_terminal() {
            return coarsest;
        }
        // The weight is least for a camera behind the surface, or for one that sees no silhouette.
        let facing = own.mean_normal.length();
        let variance = normal_variance(own.mean_normal);
        let flatness = facing * facing / silhouette_width(variance);
        let least_weight = visible_weight(-facing, variance).max(0.0) + silhouette_weight(flatness);
        Self {
            own_errors: [
                own.error_in_local * least_weight.sqrt(),
                ErrorBounds::of_group(own).error_weighed,
            ],
            own_deviation: super::usable_deviation(own),
            ..coarsest
        }
    }

    /// The limits in local units; errors count √`share` times.
    pub(crate) fn limits(&self, units: &ErrorUnits, share: f32) -> Limits {
        Limits {
            lowest: self.own(units, 1.0)[0],
            highest: units.of(self.finer_error * share.sqrt(), self.finer_deviation),
        }
    }

    /// Least and largest error of the level's group, in local units; errors count `weight` times.
    /// Infinite if it is always refined.
    pub(crate) fn own(&self, units: &ErrorUnits, weight: f32) -> [f32; 2] {
        if self.own_deviation == f32::INFINITY {
            return [f32::INFINITY; 2];
        }
        (self.own_errors).map(|error| units.of(error * weight, self.own_deviation))
    }
}
