//! Bounding volumes. Spheres steer the level of detail, boxes cull: two types, so that one is never
//! used for the other.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The sphere that steers level of detail: it holds both surfaces between which a group chooses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// Centre in local space.
    pub center: Vec3,
    /// Radius in local units, never negative.
    pub radius: f32,
}

impl Sphere {
    /// Whether `point` lies inside, allowing for the rounding of `f32`.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let slack = (self.radius + self.center.abs().max_element()) * 1e-5;
        self.center.distance(point) <= self.radius + slack
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

/// The axis-aligned box that culls: it holds the triangles of one unit, tightly.
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
