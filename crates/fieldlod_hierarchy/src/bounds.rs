//! Bounding volumes. Spheres steer the level of detail, boxes cull: two types, so that one is never
//! used for the other.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The sphere that steers level of detail: it is around both surfaces between which a group chooses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// Centre in local space.
    pub center: Vec3,
    /// Radius in local units, never negative.
    pub radius: f32,
}

impl Sphere {
    /// Whether `point` lies inside or within the rounding of `f32`.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        self.center.distance(point) <= self.radius_with_rounding()
    }

    /// Whether all `points`, which must be finite, lie inside, likewise.
    pub(crate) fn contains_all(&self, points: impl Iterator<Item = Vec3>) -> bool {
        let squared = points.map(|point| self.center.distance_squared(point));
        // One root for all: roots keep the order.
        squared.fold(0.0, f32::max).sqrt() <= self.radius_with_rounding()
    }

    fn radius_with_rounding(&self) -> f32 {
        self.radius + (self.radius + self.center.abs().max_element()) * 1e-5
    }

    /// A sphere around `points`: centred on their box, as small as that centre allows.
    ///
    /// Empty input gives the empty sphere at the origin.
    #[must_use]
    pub fn around(points: impl Iterator<Item = Vec3> + Clone) -> Self {
        let Some(aabb) = Aabb::around(points.clone()) else {
            return Self::default();
        };
        let center = (aabb.min + aabb.max) * 0.5;
        let radius = points
            .map(|point| point.distance(center))
            .fold(0.0, f32::max);
        Self { center, radius }
    }
}

/// The axis-aligned box that culls: it is tight around the triangles of one unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Aabb {
    /// Smallest corner in local space.
    pub min: Vec3,
    /// Largest corner in local space.
    pub max: Vec3,
}

impl Aabb {
    /// The smallest box around `points`; `None` if there are none.
    #[must_use]
    pub fn around(points: impl Iterator<Item = Vec3>) -> Option<Self> {
        points
            .map(|point| Self {
                min: point,
                max: point,
            })
            .reduce(|a, b| Self {
                min: a.min.min(b.min),
                max: a.max.max(b.max),
            })
    }

    /// Whether `point` lies inside or on the boundary.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        self.min.cmple(point).all() && point.cmple(self.max).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Just inside, on the edge that rounding decides, and just outside.
    #[test]
    fn contains_all_matches_single_tests() {
        let sphere = Sphere {
            center: Vec3::new(3.0, -2.0, 0.5),
            radius: 0.7,
        };
        let mut inside = 0;
        for step in 0..4000u32 {
            let length = 0.699_9 + step as f32 * 5e-8;
            let points = [
                sphere.center,
                sphere.center + Vec3::new(0.6, 0.8, 0.0) * length,
            ];
            let each = points.iter().all(|&point| sphere.contains(point));
            assert_eq!(sphere.contains_all(points.into_iter()), each, "{length}");
            inside += u32::from(each);
        }
        assert!((1..4000).contains(&inside), "{inside}");
    }
}
