//! The sphere test of meshoptimizer's clusterlod, written as well as ours: eight groups to a
//! register, no root, five numbers a group.
//!
//! ```text
//! e f / (ρ − r) > τ   ⇔   (e f/τ + r)² > ρ²
//! ```

use fieldlod_hierarchy::{Group, Hierarchy};
use glam::Vec3;
use wide::f32x8;

pub(crate) struct SphereTable {
    rows: [Vec<f32x8>; 5],
}

impl SphereTable {
    pub(crate) fn new(hierarchy: &Hierarchy) -> Self {
        let lanes = |value: &dyn Fn(&Group) -> f32| -> Vec<f32x8> {
            let block = |groups: &[Group]| {
                f32x8::from(std::array::from_fn(|lane| {
                    groups.get(lane).map_or(0.0, value)
                }))
            };
            let mut lanes: Vec<f32x8> = hierarchy.groups.chunks(8).map(block).collect();
            lanes.resize(hierarchy.groups.len().div_ceil(64) * 8, f32x8::splat(0.0));
            lanes
        };
        Self {
            rows: [
                lanes(&|g| g.bounds.center.x),
                lanes(&|g| g.bounds.center.y),
                lanes(&|g| g.bounds.center.z),
                lanes(&|g| g.bounds.radius),
                lanes(&|g| g.error_in_local),
            ],
        }
    }

    /// A bit for each group; `eye` in local space, `scale` = f/τ times what the instance scales
    /// lengths.
    pub(crate) fn refine(&self, eye: Vec3, scale: f32, refined: &mut Vec<u64>) {
        let [x, y, z, radius, error] = &self.rows;
        let splat = f32x8::splat;
        let (eye_x, eye_y, eye_z, scale) = (splat(eye.x), splat(eye.y), splat(eye.z), splat(scale));
        let exact = |rows: &[f32x8]| -> [f32x8; 8] { rows.try_into().unwrap() };
        let chunks = x
            .chunks_exact(8)
            .zip(y.chunks_exact(8))
            .zip(z.chunks_exact(8))
            .zip(radius.chunks_exact(8).zip(error.chunks_exact(8)));
        refined.extend(chunks.map(|(((x, y), z), (radius, error))| {
            let (x, y, z, radius, error) =
                (exact(x), exact(y), exact(z), exact(radius), exact(error));
            (0..8).fold(0u64, |bits, block| {
                let (dx, dy, dz) = (x[block] - eye_x, y[block] - eye_y, z[block] - eye_z);
                let reach = error[block] * scale + radius[block];
                let above = (reach * reach).simd_gt(dx * dx + dy * dy + dz * dz);
                bits | u64::from(above.to_bitmask() & 0xff) << (8 * block)
            })
        }));
    }

    /// The same, one group at a time.
    pub(crate) fn naive(hierarchy: &Hierarchy, eye: Vec3, scale: f32) -> Vec<bool> {
        let above = |group: &Group| {
            let from_eye = group.bounds.center - eye;
            let reach = group.error_in_local * scale + group.bounds.radius;
            reach * reach > from_eye.length_squared()
        };
        hierarchy.groups.iter().map(above).collect()
    }
}
