//! Conservative tests of eight spheres at once: a sphere passes only if the criterion finds no error above the
//! threshold in any of its groups.
//!
//! # Far enough in any direction
//! With `S` the secant of the widest corner of the image, the bounds of [`camera_field`] give
//! ```text
//! e √(c W) ≤ e √(C S³) √W / (ρ − r),      d √(c / cos φ) ≤ d f S² / (ρ − r)
//! ```
//! so that a sphere passes if `e k/τ + r < ρ`, with `k` the factor before `e √W` or `d`, without a root:
//! `(e k/τ + r)² < ρ²`. It is the sphere test of rotation-invariant metrics with another constant. A sphere that reaches
//! the camera or holds NaN never passes.
//!
//! # Outside
//! A sphere is outside if its centre is beyond a side of the view by more than its radius.

use camera_field::Camera;
use wide::f32x8;

use crate::criterion::extent::corner_secant;
use crate::criterion::px_per_unit;
use crate::lanes::{Lane, M3, V3};
use crate::scene::table::BoundsLanes;
use crate::settings::{LodSettings, Offscreen};
use crate::view::InstanceView;
use crate::view::sides::LensSides;

/// Bounds of the rounding of points, relative to their coordinates, and of errors. Smaller values let spheres pass that
/// the criterion refines, which the tests against the criterion find; larger values only test more groups.
const POSITION_SLACK: f32 = 4e-6;
const ROUNDING: f32 = 1.001;

/// The tests of one instance against one threshold. Its numbers are stored in all lanes, because copying them into the
/// lanes costs as much as a test.
pub(super) struct BoundsTest {
    is_orthographic: bool,
    camera_from_local: M3<f32x8>,
    origin: V3<f32x8>,
    camera_per_local: f32x8,
    slack: f32x8,
    /// Pixels times distance of errors over the threshold and, where they count, of deviations.
    error_px: f32x8,
    deviation_px: Option<f32x8>,
    /// `None` if groups outside the view have errors too.
    sides: Option<LensSides>,
}

impl BoundsTest {
    /// The test of groups within `size` of the local origin that enter or leave the view of a camera, and may move by
    /// `drift` in it.
    pub(super) fn new(
        instance: &InstanceView,
        settings: &LodSettings,
        size: f32,
        camera: &Camera,
        threshold_px: f32,
        drift: f32,
    ) -> Self {
        let (px, secant) = (px_per_unit(camera), corner_secant(camera));
        let most = instance.camera_per_local;
        let factor = most * ROUNDING / threshold_px;
        let weights = settings.error_weights();
        let error_px = match weights.counts_error {
            true => (px.x * px.y * secant * secant * secant).sqrt() * factor,
            false => 0.0,
        };
        let deviation_px = px.max_element() * secant * secant * factor;
        let counts_outside = settings.advanced.offscreen != Offscreen::Coarsest;
        let reach = instance.origin_in_camera.length() + most * size;
        let slack = POSITION_SLACK * reach + drift * ROUNDING + 1e-14;
        Self {
            is_orthographic: matches!(camera, Camera::Orthographic(_)),
            camera_from_local: M3::splat(&instance.camera_from_local),
            origin: V3::splat(instance.origin_in_camera),
            camera_per_local: f32x8::splat(most * ROUNDING),
            // Squares of larger lengths may overflow.
            slack: f32x8::splat(if slack < 1e13 { slack } else { f32::INFINITY }),
            error_px: f32x8::splat(error_px),
            deviation_px: weights
                .displacement_weight
                .map(|weight| f32x8::splat(deviation_px * weight)),
            sides: (!counts_outside).then(|| LensSides::of(camera)),
        }
    }

    /// The mask of bounds, out of eight, that have no error above the threshold.
    #[inline]
    pub(super) fn passes(&self, bounds: &BoundsLanes, element: usize) -> f32x8 {
        let center = bounds.center[element];
        let center = self.camera_from_local.of(center).plus(self.origin);
        let radius = bounds.radius[element] * self.camera_per_local + self.slack;
        let far = self.is_far(bounds, element, center, radius);
        match &self.sides {
            Some(sides) if !far.all() => {
                far | (sides.least_inside(center) + radius).is_below(f32x8::zero())
            }
            _ => far,
        }
    }

    #[inline]
    fn is_far(
        &self,
        bounds: &BoundsLanes,
        element: usize,
        center: V3<f32x8>,
        radius: f32x8,
    ) -> f32x8 {
        let mut error = bounds.error_weighed[element] * self.error_px;
        if let Some(deviation_px) = self.deviation_px {
            error = error.larger(bounds.deviation[element] * deviation_px);
        }
        if self.is_orthographic {
            return error.is_at_most(f32x8::one());
        }
        let needed = error + radius;
        (needed * needed).is_below(center.dot(center))
    }
}
