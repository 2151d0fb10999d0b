//! Bounding spheres, extents, and offsets for meshes far from the origin.

use fieldlod_hierarchy::{Aabb, Sphere};
use glam::Vec3;
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

/// Bounding sphere with a given centre. The radius is computed here, because meshoptimizer's radius could leave a point
/// outside by rounding.
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

/// The longest side of the bounding box.
pub(crate) fn extent_of(positions: &[Vec3]) -> f32 {
    let aabb = Aabb::around(positions.iter().copied()).unwrap_or_default();
    (aabb.max - aabb.min).max_element()
}

/// A mesh is far from the origin if its centre is more than this many times its size away: the first six bits of its
/// coordinates are then equal, and distances lose them. Nearer meshes lose less, and need no offset.
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
    // A difference is exact if both numbers are within a factor of two: a coordinate is at most half the size away from
    // the centre.
    Vec3::select(center.abs().cmpge(size), center, Vec3::ZERO)
}
