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

/// The sphere test of clusterlod, optimized like ours: vector instructions, no root, five numbers a group.
///
/// ```text
/// e f / (ρ − r) > τ   ⇔   (e f/τ + r)² > ρ²
/// ```
struct SphereTable {
    /// Centre, radius and error of 64 groups.
    chunks: Vec<[[f32; 64]; 5]>,
}

impl SphereTable {
    fn new(hierarchy: &Hierarchy) -> Self {
        let numbers = |group: &Group| {
            let [x, y, z] = group.bounds.center.to_array();
            [x, y, z, group.bounds.radius, group.error_in_local]
        };
        let chunk = |groups: &[Group]| {
            let mut columns = [[0.0; 64]; 5];
            for (lane, group) in groups.iter().enumerate() {
                for (column, number) in columns.iter_mut().zip(numbers(group)) {
                    column[lane] = number;
                }
            }
            columns
        };
        Self {
            chunks: hierarchy.groups.chunks(64).map(chunk).collect(),
        }
    }

    /// One bit for each group. `eye` is in local space; `scale` is f/τ.
    fn refine(&self, eye: Vec3, scale: f32, refined: &mut Vec<u64>) {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Some(avx2) = fearless_simd::Level::new().as_avx2() {
            return fearless_simd::Simd::vectorize(
                avx2,
                #[inline(always)]
                || self.refine_in_lanes(eye, scale, refined),
            );
        }
        self.refine_in_lanes(eye, scale, refined);
    }

    #[inline(always)]
    fn refine_in_lanes(&self, eye: Vec3, scale: f32, refined: &mut Vec<u64>) {
        for [x, y, z, radius, error] in &self.chunks {
            let mut above = [0u8; 64];
            for (lane, above) in above.iter_mut().enumerate() {
                let from_eye = Vec3::new(x[lane], y[lane], z[lane]) - eye;
                let reach = error[lane] * scale + radius[lane];
                *above = u8::from(reach * reach > from_eye.length_squared());
            }
            // The product gathers the lowest bits of eight bytes in the highest byte.
            let bits = |bytes: &[u8; 8]| {
                u64::from_le_bytes(*bytes).wrapping_mul(0x0102_0408_1020_4080) >> 56
            };
            let (eights, _) = above.as_chunks::<8>();
            let eights = (0..).step_by(8).zip(eights);
            refined.push(eights.fold(0, |word, (first, eight)| word | bits(eight) << first));
        }
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
