//! Bounds and mean normals.

use fieldlod_hierarchy::{Aabb, Sphere};
use glam::{DVec3, Vec3};
use meshopt::PositionDataAdapter;

/// A tight bounding sphere: the smaller of the sphere around the bounding box and meshoptimizer's sphere.
pub(crate) fn tight_sphere(points: &[Vec3]) -> Sphere {
    // Either one can be smaller.
    let around_box = Sphere::around(points.iter().copied());
    let grown = sphere_at(grown_center(points), points);
    if grown.radius < around_box.radius {
        grown
    } else {
        around_box
    }
}

fn grown_center(points: &[Vec3]) -> Vec3 {
    let coordinates: Vec<[f32; 3]> = points.iter().map(Vec3::to_array).collect();
    let positions = PositionDataAdapter {
        data: meshopt::typed_to_bytes(&coordinates),
        position_count: coordinates.len(),
        position_stride: size_of::<[f32; 3]>(),
        position_offset: 0,
    };
    Vec3::from(meshopt::compute_sphere_bounds(positions, None).center)
}

/// Bounding sphere with a given centre. The radius is computed here, because a rounded radius could leave a point
/// outside.
fn sphere_at(center: Vec3, points: &[Vec3]) -> Sphere {
    let distances = points.iter().map(|point| point.distance(center));
    let radius = distances.fold(0.0, f32::max);
    if center.is_finite() && radius.is_finite() {
        Sphere { center, radius }
    } else {
        Sphere {
            center: Vec3::ZERO,
            radius: f32::INFINITY,
        }
    }
}

/// A mesh is far from the origin if its centre is more than this many times its size away: six bits of its coordinates
/// are then equal.
const FAR: f32 = 64.0;

/// The point to subtract from positions before distances are computed. It is zero near the origin. Far away, as in
/// coordinates of a map, it is the centre: squares of distances would otherwise be rounded to steps of the coordinates.
/// The differences are exact (P. Sterbenz: Floating-Point Computation, 1974).
pub(crate) fn offset_of(positions: impl Iterator<Item = Vec3>) -> Vec3 {
    let aabb = Aabb::around(positions).unwrap_or_default();
    let (center, size) = ((aabb.min + aabb.max) * 0.5, aabb.max - aabb.min);
    if center.abs().max_element() <= size.max_element() * FAR {
        return Vec3::ZERO;
    }
    // A difference is exact if both numbers are within a factor of two.
    Vec3::select(center.abs().cmpge(size), center, Vec3::ZERO)
}

/// Sum of unit normals, weighted by area.
#[derive(Clone, Copy, Default)]
pub(crate) struct NormalSum {
    area_vector: DVec3,
    area: f64,
}

impl NormalSum {
    /// Adds a triangle. Triangles without area add zero.
    pub(crate) fn add(&mut self, [a, b, c]: [Vec3; 3]) {
        let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
        let twice_area_vector = (b - a).cross(c - a);
        self.area_vector += twice_area_vector;
        self.area += twice_area_vector.length();
    }

    /// `m = Σ n·A / Σ A`, with a length of at most 1; zero without area.
    pub(crate) fn mean(&self) -> Vec3 {
        if self.area > 0.0 {
            (self.area_vector / self.area).as_vec3()
        } else {
            Vec3::ZERO
        }
    }
}
