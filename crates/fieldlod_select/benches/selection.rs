//! The test of all groups of a mesh beside the sphere test of meshoptimizer's clusterlod. Run with
//! `cargo bench -p fieldlod_select --bench selection`.
//!
//! Each result is checked before it is timed. Ratios are of medians of interleaved rounds, so that other load of the
//! machine affects both alike.

mod common;
#[path = "../tests/common/synthetic.rs"]
mod synthetic;

use std::hint::black_box;
use std::time::Duration;

use common::{look, medians, settings};
use fieldlod_hierarchy::{Group, Hierarchy};
use fieldlod_select::{GroupTable, InstanceView, LodSettings, group_error_px, refine};
use glam::{Affine3A, Vec3};
use wide::f32x8;

const FOCAL_PX: f32 = 935.3;

fn main() {
    println!("groups   height  ours ns/group  baseline ns/group  ratio  refined");
    for levels in [6, 8, 10] {
        // The same error at the coarsest level.
        let finest = (1..levels).fold(0.02, |error, _| error / 2.2);
        let hierarchy = synthetic::ball(levels, finest);
        for height in [0.02f32, 0.1, 0.5, 3.0] {
            measure(&hierarchy, height);
        }
    }
}

fn measure(hierarchy: &Hierarchy, height: f32) {
    let settings = settings();
    let (table, spheres) = (GroupTable::new(hierarchy), SphereTable::new(hierarchy));
    let count = hierarchy.groups.len();
    let eye = Vec3::new(0.3, 0.4, 0.866) * (1.0 + height);
    let view = look(eye, Vec3::new(0.9, 0.1, 0.3));
    let instance = InstanceView::new(&view, &Affine3A::IDENTITY);
    let (mut bits, mut baseline_bits) = (Vec::new(), Vec::new());
    check(hierarchy, &table, &instance, &settings);
    spheres.refine(eye, FOCAL_PX, &mut baseline_bits);
    let expected = SphereTable::naive(hierarchy, eye, FOCAL_PX);
    assert!(is_same(&baseline_bits, &expected));
    let repeats = (200_000 / count).max(1);
    let [ours, baseline] = medians(
        41,
        [
            &mut || {
                for _ in 0..repeats {
                    refine(&table, black_box(&instance), &settings, &[], &mut bits);
                    black_box(&bits);
                }
            },
            &mut || {
                for _ in 0..repeats {
                    baseline_bits.clear();
                    spheres.refine(black_box(eye), FOCAL_PX, &mut baseline_bits);
                    black_box(&baseline_bits);
                }
            },
        ],
    );
    let refined: u32 = bits.iter().map(|word| word.count_ones()).sum();
    let ns = |time: Duration| time.as_secs_f64() * 1e9 / (count * repeats) as f64;
    let (ours, baseline) = (ns(ours), ns(baseline));
    let ratio = ours / baseline;
    println!("{count:8} {height:6}  {ours:13.3}  {baseline:14.3}  {ratio:5.2}  {refined:7}");
}

fn is_same(bits: &[u64], expected: &[bool]) -> bool {
    let mut expected = expected.iter().enumerate();
    expected.all(|(index, &expected)| (bits[index / 64] >> (index % 64) & 1 == 1) == expected)
}

fn check(
    hierarchy: &Hierarchy,
    table: &GroupTable,
    instance: &InstanceView,
    settings: &LodSettings,
) {
    let mut bits = Vec::new();
    refine(table, instance, settings, &[], &mut bits);
    let exceeds =
        |group| group_error_px(group, instance, settings, false) > settings.threshold_px();
    let expected: Vec<bool> = hierarchy.groups.iter().map(exceeds).collect();
    assert!(is_same(&bits, &expected));
}

/// The sphere test of clusterlod, as fast as ours: eight groups to a register, no root, five numbers a group.
///
/// ```text
/// e f / (ρ − r) > τ   ⇔   (e f/τ + r)² > ρ²
/// ```
struct SphereTable {
    rows: [Vec<f32x8>; 5],
}

impl SphereTable {
    fn new(hierarchy: &Hierarchy) -> Self {
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
    fn refine(&self, eye: Vec3, scale: f32, refined: &mut Vec<u64>) {
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
    fn naive(hierarchy: &Hierarchy, eye: Vec3, scale: f32) -> Vec<bool> {
        let above = |group: &Group| {
            let from_eye = group.bounds.center - eye;
            let reach = group.error_in_local * scale + group.bounds.radius;
            reach * reach > from_eye.length_squared()
        };
        hierarchy.groups.iter().map(above).collect()
    }
}
