//! Which groups ask for refinement: conservative tests first, the criterion where they cannot tell.
//!
//! # Certainly below
//! With S the secant of the widest image corner, every bound of [`camera_field`] gives
//! ```text
//! e √(c W) ≤ e √(C S³) √W / (ρ − r),      d √(c / cos φ) ≤ d f S² / (ρ − r)
//! ```
//! so an error is below the threshold τ if `e k / τ + r ≤ ρ`: in local space, without a root,
//! `(e k/τ + r)² ≤ |p − eye|²`. It is the sphere test of rotation-invariant metrics with another
//! constant. What reaches the camera, or is not a number, never passes. In camera space, where depth is
//! known, the same with S in place of S³, S² and `z − r` in place of `ρ − r` is sharper near the axis.

use camera_field::Camera;
use fieldlod_hierarchy::Sphere;
use glam::Vec3;
use wide::f32x8;

use crate::kernel::Kernel;
use crate::settings::Thresholds;
use crate::stretch::least_stretch;
use crate::table::{CHUNK, Chunk, GroupTable, LANES};
use crate::{InstanceView, LodSettings, Promise};

/// What rounding may add to a metric, relative.
const SLACK: f32 = 1.001;
/// What rounding may move a point by, relative to the numbers it is made of.
const POSITION_SLACK: f32 = 4e-6;

/// Marks the groups whose own error exceeds its threshold, and the terminal ones: a bit for each,
/// 64 to a word. `was_refined` has the last cut's bits. The cut needs the closure on top.
///
/// Same bits as [`promised_error_px`](crate::promised_error_px) of every group against the
/// thresholds.
pub fn refine(
    table: &GroupTable,
    instance: &InstanceView,
    settings: &LodSettings,
    was_refined: &[u64],
    refined: &mut Vec<u64>,
) {
    let thresholds = settings.thresholds(1.0);
    Decision::new(table, instance, settings, thresholds).decide(table, was_refined, refined);
}

/// Factors from errors in local units to pixels times distance; without the distance for an
/// orthographic camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorScale {
    pub(crate) of_weighed_error: f32,
    pub(crate) of_deviation: f32,
}

/// Factors from errors in local units to depths in camera space below which they show.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthScale {
    pub(crate) of_weighed_error: f32,
    pub(crate) of_deviation: f32,
    pub(crate) slack: f32,
}

impl ErrorScale {
    /// Upper bounds for the whole view.
    pub(crate) fn of_view(camera: &Camera, settings: &LodSettings) -> Self {
        let (quality, displacement) = match camera {
            Camera::Perspective(camera) => {
                let secant = camera.max_secant();
                let focal = camera.focal_px.x.max(camera.focal_px.y);
                let strength = camera.constant_px2() * secant * secant * secant;
                (strength.sqrt(), focal * secant * secant)
            }
            Camera::Orthographic(camera) => {
                let pixels = camera.pixels_per_unit;
                ((pixels.x * pixels.y).sqrt(), pixels.x.max(pixels.y))
            }
        };
        let (of_weighed_error, of_deviation) = match settings.promise {
            Promise::Quality => (quality, 0.0),
            Promise::Guaranteed => (0.0, displacement),
            Promise::Both { cap_px } => (quality, displacement * (settings.error_px / cap_px)),
        };
        Self {
            of_weighed_error: of_weighed_error * SLACK,
            of_deviation: of_deviation * SLACK,
        }
    }
}

/// The tests of one instance in one view.
pub(crate) struct Decision<'a> {
    kernel: Kernel<'a>,
    instance: &'a InstanceView,
    thresholds: Thresholds,
    test_above: SphereTest,
    test_below: SphereTest,
    depth_above: DepthScale,
    depth_below: DepthScale,
    position_slack: f32,
    /// Whether no error, as of what is outside, is below the thresholds.
    zero_is_below: bool,
}

impl<'a> Decision<'a> {
    pub(crate) fn new(
        table: &GroupTable,
        instance: &'a InstanceView,
        settings: &'a LodSettings,
        thresholds: Thresholds,
    ) -> Self {
        let inverse = instance.camera_from_local.inverse();
        let eye_in_local = inverse * -instance.origin_in_camera;
        let most = instance.camera_per_local;
        let Sphere { center, radius } = table.whole.bounds;
        let position_slack =
            POSITION_SLACK * (eye_in_local.length() + center.length() + radius) + 1e-14;
        let scale = ErrorScale::of_view(&instance.camera, settings);
        let is_orthographic = matches!(instance.camera, Camera::Orthographic(_));
        let test = |threshold_px: f32| {
            let scale_of_test = if is_orthographic { most } else { 1.0 } / threshold_px;
            SphereTest {
                is_orthographic,
                eye: eye_in_local,
                weighed_error: scale.of_weighed_error * scale_of_test,
                deviation: scale.of_deviation * scale_of_test,
                unevenness: most / (least_stretch(&instance.camera_from_local, most) * 0.999),
                slack: position_slack,
            }
        };
        let secant = match &instance.camera {
            Camera::Perspective(camera) => camera.max_secant(),
            Camera::Orthographic(_) => 1.0,
        };
        // At no depth for an orthographic camera: the sphere test has told all.
        let none = if is_orthographic { f32::INFINITY } else { 1.0 };
        let depth = |threshold_px: f32| {
            let scale_of_depth = none * most / (threshold_px * secant);
            DepthScale {
                of_weighed_error: scale.of_weighed_error * scale_of_depth,
                of_deviation: scale.of_deviation * scale_of_depth,
                slack: position_slack * most,
            }
        };
        Self {
            kernel: Kernel::new(instance, settings),
            instance,
            thresholds,
            depth_above: depth(thresholds.refine_above_px),
            depth_below: depth(thresholds.coarsen_below_px),
            test_above: test(thresholds.refine_above_px),
            test_below: test(thresholds.coarsen_below_px),
            position_slack,
            zero_is_below: thresholds.coarsen_below_px >= 0.0,
        }
    }

    pub(crate) fn decide(&self, table: &GroupTable, was_refined: &[u64], refined: &mut Vec<u64>) {
        refined.clear();
        refined.extend((0..table.chunks.len()).map(|chunk| {
            let was = was_refined.get(chunk).copied().unwrap_or(0);
            table.terminal[chunk] | self.exceeding(table, chunk, was)
        }));
    }

    fn exceeding(&self, table: &GroupTable, chunk: usize, was_refined: u64) -> u64 {
        let may_be_lower = was_refined & !table.terminal[chunk] != 0;
        let tests = if may_be_lower {
            (&self.test_below, &self.depth_below)
        } else {
            (&self.test_above, &self.depth_above)
        };
        let test = tests.0;
        if self.zero_is_below
            && (test.passes_chunk(&table.chunks[chunk]) || self.is_outside(&table.chunks[chunk]))
        {
            return 0;
        }
        let bits = (0..CHUNK / LANES).fold(0, |bits, index| {
            let block = chunk * (CHUNK / LANES) + index;
            let was = (was_refined >> (index * LANES)) as u32 & 0xff;
            bits | u64::from(self.exceeding_in(table, block, was, tests)) << (index * LANES)
        });
        bits & valid_bits(table, chunk)
    }

    /// The conservative test, then the full criterion unless all are below or outside.
    #[inline]
    fn exceeding_in(
        &self,
        table: &GroupTable,
        block: usize,
        was_refined: u32,
        (test, depth): (&SphereTest, &DepthScale),
    ) -> u32 {
        let error_px = if self.zero_is_below {
            let below = test.passed_by(table, block);
            if below.all() {
                return 0;
            }
            let Some(error_px) = self.kernel.error_px_unless(below, depth, table, block) else {
                return 0;
            };
            error_px
        } else {
            self.kernel.error_px(table, block)
        };
        let nan = error_px.simd_ne(error_px);
        let above = |threshold_px: f32| {
            (error_px.simd_gt(f32x8::splat(threshold_px)) | nan).to_bitmask() & 0xff
        };
        let refine = above(self.thresholds.refine_above_px) & !was_refined;
        refine | above(self.thresholds.coarsen_below_px) & was_refined
    }

    fn is_outside(&self, chunk: &Chunk) -> bool {
        let slack = self.position_slack * self.instance.camera_per_local;
        let sphere = self.instance.sphere_in_camera(&chunk.bounds);
        !self
            .instance
            .camera
            .touches_sphere(sphere.center, sphere.radius * SLACK + slack)
    }
}

/// The bits of a chunk that stand for groups.
fn valid_bits(table: &GroupTable, chunk: usize) -> u64 {
    let rest = table.group_count() - chunk * CHUNK;
    if rest >= CHUNK {
        u64::MAX
    } else {
        (1 << rest) - 1
    }
}

/// `((e k + r + slack) · unevenness)² < |p − eye|²`, for an orthographic camera `e k ≤ 1`.
struct SphereTest {
    is_orthographic: bool,
    eye: Vec3,
    weighed_error: f32,
    deviation: f32,
    /// Greatest by least stretch of the instance: what distances in local space may mislead by.
    unevenness: f32,
    slack: f32,
}

impl SphereTest {
    fn passes_chunk(&self, chunk: &Chunk) -> bool {
        let error =
            (chunk.error_weighed * self.weighed_error).max(chunk.deviation * self.deviation);
        // 0 · ∞: no threshold at all.
        if !(self.weighed_error < f32::INFINITY && self.deviation < f32::INFINITY) {
            return false;
        }
        if self.is_orthographic {
            return error <= 1.0;
        }
        let reach = (error + chunk.bounds.radius * SLACK + self.slack) * self.unevenness;
        // Not where both are infinite, as for an instance that is flat.
        reach * reach < chunk.bounds.center.distance_squared(self.eye)
    }

    #[inline]
    fn passed_by(&self, table: &GroupTable, block: usize) -> f32x8 {
        let mut error = table.error_weighed[block] * f32x8::splat(self.weighed_error);
        if self.deviation != 0.0 {
            let deviation = table.deviation[block] * f32x8::splat(self.deviation);
            error = error.simd_gt(deviation).bitselect(error, deviation);
        }
        if self.is_orthographic {
            return error.simd_le(f32x8::splat(1.0));
        }
        let (x, y, z) = (
            table.x[block] - f32x8::splat(self.eye.x),
            table.y[block] - f32x8::splat(self.eye.y),
            table.z[block] - f32x8::splat(self.eye.z),
        );
        let reach = (error + table.radius[block] * f32x8::splat(SLACK) + f32x8::splat(self.slack))
            * f32x8::splat(self.unevenness);
        (reach * reach).simd_lt(x * x + y * y + z * z)
    }
}
