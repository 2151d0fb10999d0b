//! A sphere and the largest errors in it, for tests of many groups at once.

use fieldlod_hierarchy::{Group, SILHOUETTE_WEIGHT, Sphere};
use glam::{Affine3A, Vec3};

use crate::criterion::{normal_variance, usable_deviation, visible_weight};
use crate::lanes::Eight;

/// A sphere around groups, and the largest errors of the groups that have a simplification.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ErrorBounds {
    pub(crate) sphere: Sphere,
    /// `e √W` with the largest weight `W` of the criterion in any direction.
    pub(crate) error_weighed: f32,
    pub(crate) deviation: f32,
}

/// The numbers of [`ErrorBounds`]: sphere, error and deviation.
pub(crate) const BOUNDS_COLUMNS: usize = 6;
/// Eight bounds.
pub(crate) type EightBounds = Eight<BOUNDS_COLUMNS>;

impl ErrorBounds {
    /// The bounds of one group, in local space.
    pub(crate) fn of_group(group: &Group) -> Self {
        // The weight is at most that of a surface that faces the camera, with a silhouette.
        let facing = group.mean_normal.length();
        let variance = normal_variance(group.mean_normal);
        let most_weight = visible_weight(facing, variance) + SILHOUETTE_WEIGHT;
        Self {
            sphere: group.bounds,
            error_weighed: unless_terminal(group, group.error_in_local) * most_weight.sqrt(),
            deviation: unless_terminal(group, usable_deviation(group)),
        }
    }

    pub(crate) fn to_array(self) -> [f32; BOUNDS_COLUMNS] {
        let [x, y, z] = self.sphere.center.to_array();
        let (radius, error, deviation) = (self.sphere.radius, self.error_weighed, self.deviation);
        [x, y, z, radius, error, deviation]
    }

    /// The bounds of all items; zero for no items.
    pub(crate) fn around(items: impl Iterator<Item = Self> + Clone) -> Self {
        let largest = |value: fn(&Self) -> f32| {
            let values = items.clone().map(|item| or_infinity(value(&item)));
            values.fold(0.0, f32::max)
        };
        Self {
            sphere: sphere_around(items.clone().map(|item| item.sphere)).unwrap_or_default(),
            error_weighed: largest(|item| item.error_weighed),
            deviation: largest(|item| item.deviation),
        }
    }
}

/// The sphere about the centre of the box of all spheres; `None` for no spheres.
pub(crate) fn sphere_around(spheres: impl Iterator<Item = Sphere> + Clone) -> Option<Sphere> {
    let boxes = spheres.clone().map(|Sphere { center, radius }| {
        let half = Vec3::splat(radius);
        (center - half, center + half)
    });
    let (min, max) = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let center = (min + max) * 0.5;
    if !center.is_finite() {
        return Some(EVERYWHERE);
    }
    let farthest = |sphere: Sphere| or_infinity(sphere.center.distance(center) + sphere.radius);
    Some(Sphere {
        center,
        // Rounding may make the radius too small.
        radius: spheres.map(farthest).fold(0.0, f32::max) * 1.0001,
    })
}

/// A sphere that is never outside and never passes a test.
const EVERYWHERE: Sphere = Sphere {
    center: Vec3::ZERO,
    radius: f32::INFINITY,
};

/// Bounding sphere of an instance in the world; infinite if its placement or bias is not usable.
pub(crate) fn placed_sphere(
    bounds: &ErrorBounds,
    world_from_local: &Affine3A,
    largest_stretch: f32,
    bias: f32,
) -> Sphere {
    let center = world_from_local.transform_point3(bounds.sphere.center);
    // Lengths grow at most by the largest stretch.
    let radius = bounds.sphere.radius * largest_stretch;
    if center.is_finite() && radius.is_finite() && bias > 0.0 {
        return Sphere { center, radius };
    }
    EVERYWHERE
}

/// Returns 0 for a terminal group, because it has no simplification.
fn unless_terminal(group: &Group, error: f32) -> f32 {
    if group.is_terminal() { 0.0 } else { error }
}

/// Returns infinity for NaN, because a maximum would drop NaN.
pub(crate) fn or_infinity(value: f32) -> f32 {
    if value.is_nan() { f32::INFINITY } else { value }
}
