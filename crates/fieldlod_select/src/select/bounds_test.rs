//! Conservative tests of eight spheres at once: a sphere passes only if the criterion finds no error above the
//! threshold in any of its groups.
//!
//! # Far enough in any direction
//! With `S` the secant of the widest corner of the image, the bounds of [`camera_field`] give
//! ```text
//! e √(c W) ≤ e √(C S³) √W / (ρ − r),      d √(c / cos φ) ≤ d f S² / (ρ − r)
//! ```
//! so that a sphere passes if `x k/τ + r < ρ`, with `x` for `e √W` or `d`, and `k` for its factor. Without a root, this is
//! `(x k/τ + r)² < ρ²`. It is the sphere test of rotation-invariant metrics with another constant. A sphere that reaches
//! the camera or holds NaN never passes.
//!
//! # Outside
//! A sphere is outside if its centre is beyond a side of the view by more than its radius.

use camera_field::{Camera, FieldOfView};
use glam::{Mat3, Vec3};

use crate::criterion::error_bounds::{BOUNDS_COLUMNS, EightBounds};
use crate::criterion::{PLACE_SLACK, ROUNDING};
use crate::lanes::bits::{LANES, lane_bits};
use crate::lanes::larger;
use crate::settings::{LodSettings, Offscreen};
use crate::view::InstanceView;
use crate::view::sides::LensSides;

/// The tests of one instance against one threshold.
#[derive(Clone, Copy)]
pub(super) struct BoundsTest {
    is_orthographic: bool,
    camera_from_local: Mat3,
    origin: Vec3,
    camera_per_local: f32,
    slack: f32,
    /// Pixels times distance of errors and of deviations over the threshold; 0 if they do not count.
    error_px: f32,
    deviation_px: f32,
    /// `None` if groups outside the view have errors too.
    sides: Option<LensSides>,
}

impl BoundsTest {
    /// The test of groups within `size` of the local origin that enter or leave the view of a camera.
    pub(super) fn new(
        instance: &InstanceView,
        settings: &LodSettings,
        size: f32,
        camera: &Camera,
        threshold_px: f32,
    ) -> Self {
        let view = FieldOfView::of(camera);
        let (px, secant) = (view.px_per_unit, view.corner_secant);
        let most = instance.camera_per_local;
        let factor = most * ROUNDING / threshold_px;
        let weights = settings.error_weights();
        let error_px = if weights.counts_error {
            (px.x * px.y * secant * secant * secant).sqrt() * factor
        } else {
            0.0
        };
        // Deviations count the larger axis and the secant in full: see the criterion's pixel scale.
        let deviation_px = px.max_element() * secant * secant * factor;
        let counts_outside = settings.advanced.offscreen != Offscreen::Coarsest;
        let reach = instance.origin_in_camera.length() + most * size;
        // Squares of smaller lengths may underflow.
        let slack = PLACE_SLACK * reach + 1e-14;
        Self {
            is_orthographic: matches!(camera, Camera::Orthographic(_)),
            camera_from_local: instance.camera_from_local,
            origin: instance.origin_in_camera,
            camera_per_local: most * ROUNDING,
            // Squares of larger lengths may overflow.
            slack: if slack < 1e13 { slack } else { f32::INFINITY },
            error_px,
            deviation_px: deviation_px * weights.displacement_weight.unwrap_or(0.0),
            sides: (!counts_outside).then(|| LensSides::of(camera)),
        }
    }

    /// The bits of bounds, out of eight, that have no error above the threshold.
    #[inline(always)]
    pub(super) fn passes(&self, bounds: &EightBounds) -> u32 {
        // A local copy, which the compiler knows to be constant.
        let (test, sides) = (*self, self.sides);
        let mut passes = [0; LANES];
        for (lane, passes) in passes.iter_mut().enumerate() {
            *passes = u8::from(test.is_far(bounds.at(lane)));
        }
        // Often all eight are far enough, and need no test of the sides.
        if let Some(sides) = sides
            && passes != [1; LANES]
        {
            for (lane, passes) in passes.iter_mut().enumerate() {
                let (center, radius) = test.seen(bounds.at(lane));
                *passes |= u8::from(sides.least_inside(center) + radius < 0.0);
            }
        }
        lane_bits(&passes)
    }

    /// The centre and the radius in camera space.
    #[inline(always)]
    fn seen(&self, [x, y, z, radius, ..]: [f32; BOUNDS_COLUMNS]) -> (Vec3, f32) {
        let center = self.camera_from_local * Vec3::new(x, y, z) + self.origin;
        (center, radius * self.camera_per_local + self.slack)
    }

    #[inline(always)]
    fn is_far(&self, bounds: [f32; BOUNDS_COLUMNS]) -> bool {
        let (center, radius) = self.seen(bounds);
        let [.., error_weighed, deviation] = bounds;
        let error = larger(error_weighed * self.error_px, deviation * self.deviation_px);
        let needed = error + radius;
        let is_far = needed * needed < center.dot(center);
        if self.is_orthographic {
            error <= 1.0
        } else {
            is_far
        }
    }
}
