//! Conservative tests of eight spheres at once: a sphere passes only if the criterion finds no error above the
//! threshold in any of its groups.
//!
//! # Far enough in any direction
//! With `S` the secant of the widest corner of the image, the bounds of [`camera_field`] give
//! ```text
//! e √(c W) ≤ e √(C S³) √W / (ρ − r),      d √(c / cos φ) ≤ d f S² / (ρ − r)
//! ```
//! so that a sphere passes if `e k/τ + r ≤ ρ`, with `k` the factor before `e √W` or `d`: in local space and without a
//! root, `(e k/τ + r)² ≤ |p − eye|²`. It is the sphere test of rotation-invariant metrics with another constant. A
//! sphere that reaches the camera or holds NaN never passes.
//!
//! # Outside
//! A sphere is outside if its centre is beyond a side of the view by more than its radius.

use camera_field::Camera;
use wide::f32x8;

use crate::criterion::extent::corner_secant;
use crate::criterion::px_per_unit;
use crate::lanes::{Lane, V3};
use crate::scene::table::BoundsLanes;
use crate::settings::{LodSettings, Offscreen};
use crate::view::InstanceView;
use crate::view::sides::{Planes, Sides, planes_in_camera};
use crate::view::stretch::least_stretch;

/// Bounds of the rounding of points, relative to their coordinates, and of errors. Smaller values let spheres pass that
/// the criterion refines, which the tests against the criterion find; larger values only test more groups.
const POSITION_SLACK: f32 = 4e-6;
const ROUNDING: f32 = 1.001;

/// Bounds of the camera that groups enter, and of the wider camera that refined groups leave.
pub(crate) struct ViewBounds {
    pub(super) entering: CameraBounds,
    pub(super) leaving: CameraBounds,
}

/// Bounds of one camera.
pub(super) struct CameraBounds {
    is_orthographic: bool,
    /// `None` if groups outside the view have errors too.
    sides: Option<Planes>,
    /// Pixels times distance of errors and, where they count, of deviations.
    error_px: f32,
    deviation_px: Option<f32>,
}

impl ViewBounds {
    pub(crate) fn new(entering: &Camera, leaving: &Camera, settings: &LodSettings) -> Self {
        Self {
            entering: CameraBounds::new(entering, settings),
            leaving: CameraBounds::new(leaving, settings),
        }
    }
}

impl CameraBounds {
    fn new(camera: &Camera, settings: &LodSettings) -> Self {
        let (px, secant) = (px_per_unit(camera), corner_secant(camera));
        let error_px = (px.x * px.y * secant * secant * secant).sqrt();
        let deviation_px = px.max_element() * secant * secant;
        let weights = settings.error_weights();
        let counts_outside = settings.advanced.offscreen != Offscreen::Coarsest;
        let error_weight = if weights.counts_error { ROUNDING } else { 0.0 };
        Self {
            is_orthographic: matches!(camera, Camera::Orthographic(_)),
            sides: (!counts_outside).then(|| planes_in_camera(camera)),
            error_px: error_px * error_weight,
            deviation_px: weights
                .displacement_weight
                .map(|weight| deviation_px * weight * ROUNDING),
        }
    }
}

/// The tests of one instance against one threshold. Its numbers are stored in all lanes, because copying them into the
/// lanes costs as much as a test.
pub(super) struct BoundsTest {
    is_orthographic: bool,
    eye: V3<f32x8>,
    error_px: f32x8,
    deviation_px: Option<f32x8>,
    unevenness: f32x8,
    slack: f32x8,
    /// The sides of the view in local space, with distances in camera units; `None` if they cannot be used.
    sides: Option<Sides<f32x8>>,
    camera_per_local: f32x8,
}

impl BoundsTest {
    /// The test of groups within `size` of the local origin that enter or leave the view of a camera, and may move by
    /// `drift` in it.
    pub(super) fn new(
        instance: &InstanceView,
        size: f32,
        camera: &CameraBounds,
        threshold_px: f32,
        drift: f32,
    ) -> Self {
        let most = instance.camera_per_local;
        let least = least_stretch(&instance.camera_from_local, most) * 0.999;
        let eye = instance.camera_from_local.inverse() * -instance.origin_in_camera;
        let slack = POSITION_SLACK * (eye.length() + size) + drift * ROUNDING / least + 1e-14;
        // Squares of smaller or larger lengths may underflow or overflow.
        let is_trusted = (1e-15..1e13).contains(&(slack * most));
        let sides = camera.sides.as_ref().filter(|_| is_trusted);
        let per_local = if camera.is_orthographic { most } else { 1.0 };
        let factor = per_local / threshold_px;
        let (linear, translation) = (&instance.camera_from_local, instance.origin_in_camera);
        Self {
            is_orthographic: camera.is_orthographic,
            eye: V3::splat(eye),
            error_px: f32x8::splat(camera.error_px * factor),
            deviation_px: camera.deviation_px.map(|px| f32x8::splat(px * factor)),
            unevenness: f32x8::splat(most / least),
            slack: f32x8::splat(slack),
            sides: sides.map(|sides| Sides::new(sides, linear, translation, slack * most)),
            camera_per_local: f32x8::splat(most * ROUNDING),
        }
    }

    /// The mask of bounds, out of eight, that have no error above the threshold.
    #[inline]
    pub(super) fn passes(&self, bounds: &BoundsLanes, element: usize) -> f32x8 {
        let far = self.is_far(bounds, element);
        match &self.sides {
            Some(sides) if !far.all() => {
                let radius = bounds.radius[element] * self.camera_per_local;
                far | sides.exclude(bounds.center(element), radius)
            }
            _ => far,
        }
    }

    #[inline]
    fn is_far(&self, bounds: &BoundsLanes, element: usize) -> f32x8 {
        let mut error = bounds.error_weighed[element] * self.error_px;
        if let Some(deviation_px) = self.deviation_px {
            error = error.larger(bounds.deviation[element] * deviation_px);
        }
        if self.is_orthographic {
            return error.is_at_most(f32x8::one());
        }
        let from_eye = bounds.center(element).minus(self.eye);
        let radius = bounds.radius[element] * f32x8::splat(ROUNDING);
        let needed = (error + radius + self.slack) * self.unevenness;
        (needed * needed).is_below(from_eye.dot(from_eye))
    }
}
