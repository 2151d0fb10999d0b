//! Signed distance functions, and meshes of their surfaces.

use bevy::prelude::*;
use fast_surface_nets::ndshape::{RuntimeShape, Shape as _};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};

/// Samples per side of a block. A block far from the surface is sampled only once.
const BLOCK: u32 = 8;

/// Positions and triangles of the surface `distance_in_m = 0` in the box from `min` to `max`.
///
/// `distance_in_m` must be negative inside, and must change by at most about 1 per metre.
pub(crate) fn polygonise(
    min: Vec3,
    max: Vec3,
    voxel_in_m: f32,
    distance_in_m: impl Fn(Vec3) -> f32,
) -> (Vec<Vec3>, Vec<u32>) {
    let size = ((max - min) / voxel_in_m).ceil().as_uvec3() + UVec3::ONE;
    let grid = RuntimeShape::<u32, 3>::new(size.to_array());
    let distance_in_voxels = |cell: Vec3| distance_in_m(min + cell * voxel_in_m) / voxel_in_m;
    let samples = sample(size, &grid, distance_in_voxels);

    let mut surface = SurfaceNetsBuffer::default();
    let last = (size - UVec3::ONE).to_array();
    surface_nets(&samples, &grid, [0; 3], last, &mut surface);
    let in_metres = |cell: &[f32; 3]| min + Vec3::from_array(*cell) * voxel_in_m;
    let positions = surface.positions.iter().map(in_metres).collect();
    (positions, surface.indices)
}

/// Samples the grid. Blocks far from the surface get the value at their middle.
fn sample(
    size: UVec3,
    grid: &RuntimeShape<u32, 3>,
    distance_in_voxels: impl Fn(Vec3) -> f32,
) -> Vec<f32> {
    let mut samples = vec![0.0; grid.usize()];
    let blocks = size.map(|side| side.div_ceil(BLOCK));
    for corner in cells(UVec3::ZERO, blocks).map(|block| block * BLOCK) {
        let middle = distance_in_voxels(corner.as_vec3() + 0.5 * BLOCK as f32);
        // Half the diagonal is 0.87 of a side. A full side leaves a margin for slopes a little above 1.
        let far = middle.abs() > BLOCK as f32;
        for cell in cells(corner, size.min(corner + BLOCK)) {
            let value = if far {
                middle
            } else {
                distance_in_voxels(cell.as_vec3())
            };
            samples[grid.linearize(cell.to_array()) as usize] = value;
        }
    }
    samples
}

fn cells(from: UVec3, to: UVec3) -> impl Iterator<Item = UVec3> {
    let row = move |y, z| (from.x..to.x).map(move |x| UVec3::new(x, y, z));
    let slice = move |z| (from.y..to.y).flat_map(move |y| row(y, z));
    (from.z..to.z).flat_map(slice)
}

/// Distance from a tapered capsule between `a` and `b`.
pub(crate) fn limb(p: Vec3, a: Vec3, b: Vec3, radius_a: f32, radius_b: f32) -> f32 {
    let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a.lerp(b, along)) - (radius_a + (radius_b - radius_a) * along)
}

/// Approximate distance from an ellipsoid, exact on its surface.
pub(crate) fn ellipsoid(p: Vec3, center: Vec3, radii: Vec3) -> f32 {
    let scaled = ((p - center) / radii).length();
    let steepest = ((p - center) / (radii * radii)).length();
    if steepest > 0.0 {
        scaled * (scaled - 1.0) / steepest
    } else {
        -radii.min_element()
    }
}

/// Distance from a box with rounded edges.
pub(crate) fn rounded_box(p: Vec3, center: Vec3, half_size: Vec3, rounding: f32) -> f32 {
    let q = (p - center).abs() - half_size + rounding;
    q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - rounding
}

/// Distance from a cylinder around the Y axis between two heights, with rounded edges.
pub(crate) fn drum(p: Vec3, radius: f32, foot: f32, top: f32, rounding: f32) -> f32 {
    let sideways = Vec2::new(p.x, p.z).length() - radius;
    let upright = (p.y - 0.5 * (foot + top)).abs() - 0.5 * (top - foot);
    let q = Vec2::new(sideways, upright) + rounding;
    q.max(Vec2::ZERO).length() + q.max_element().min(0.0) - rounding
}

/// Distance from the union of two surfaces, blended where their distances differ by less than `blend_in_m`.
pub(crate) fn smooth_union(a: f32, b: f32, blend_in_m: f32) -> f32 {
    let overlap = (blend_in_m - (a - b).abs()).max(0.0);
    a.min(b) - overlap * overlap / (4.0 * blend_in_m)
}
