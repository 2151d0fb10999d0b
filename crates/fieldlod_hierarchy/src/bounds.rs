//! Bounding volumes: spheres for selection, boxes for culling.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bounding sphere of a group, for selection.
///
/// It contains the surface of the group before and after simplification, so it is too loose to cull.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// Centre in local space.
    pub center: Vec3,
    /// Radius in local units, never negative.
    pub radius: f32,
}

impl Sphere {
    /// Returns `true` if `point` lies inside, with a tolerance for the rounding of `f32`.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        // Over 80 rounding steps of an `f32`: a few operations of the writer and of this test stay well below.
        let tolerance = (self.radius + self.center.abs().max_element()) * 1e-5;
        self.center.distance(point) <= self.radius + tolerance
    }

    /// The smallest sphere around `points` that is centred on their box.
    ///
    /// Without points, the sphere has radius 0 at the origin.
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

/// Tight axis-aligned bounding box of a unit, for culling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Aabb {
    /// Smallest corner in local space.
    pub min: Vec3,
    /// Largest corner in local space.
    pub max: Vec3,
}

impl Aabb {
    /// The smallest box around `points`. `None` without points.
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

    /// Returns `true` if `point` lies inside or on the boundary.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        self.min.cmple(point).all() && point.cmple(self.max).all()
    }
}
