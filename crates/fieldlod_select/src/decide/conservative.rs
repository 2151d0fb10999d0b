//! Tests that answer only what the criterion would answer alike.
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
//!
//! # Certainly outside
//! A sphere farther beyond a side of the view than its radius.

use camera_field::Camera;
use fieldlod_hierarchy::Sphere;
use glam::Vec3;
use wide::f32x8;

use super::facing::FacingTest;
use crate::stretch::least_stretch;
use crate::table::{Bounds, GroupTable};
use crate::{InstanceView, LodSettings, Offscreen};

/// What rounding may add to a metric, relative.
pub(super) const SLACK: f32 = 1.001;
/// What rounding may move a point by, relative to the numbers it is made of.
const POSITION_SLACK: f32 = 4e-6;

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
        match camera {
            Camera::Perspective(camera) => {
                let secant = camera.max_secant();
                let focal = camera.focal_px.x.max(camera.focal_px.y);
                let strength = camera.constant_px2() * secant * secant * secant;
                Self::new(settings, strength.sqrt(), focal * secant * secant)
            }
            Camera::Orthographic(camera) => {
                let pixels = camera.pixels_per_unit;
                let strength = pixels.x * pixels.y;
                Self::new(settings, strength.sqrt(), pixels.x.max(pixels.y))
            }
        }
    }

    /// The same on the view's axis alone.
    pub(crate) fn on_axis(camera: &Camera, settings: &LodSettings) -> Self {
        match camera {
            Camera::Perspective(camera) => {
                let focal = camera.focal_px.x.max(camera.focal_px.y);
                Self::new(settings, camera.constant_px2().sqrt(), focal)
            }
            Camera::Orthographic(_) => Self::of_view(camera, settings),
        }
    }

    fn new(settings: &LodSettings, quality: f32, displacement: f32) -> Self {
        let criterion = settings.criterion();
        let quality = if criterion.counts_error { quality } else { 0.0 };
        let weight = criterion.displacement_weight.unwrap_or(0.0);
        Self {
            of_weighed_error: quality * SLACK,
            of_deviation: displacement * weight * SLACK,
        }
    }

    /// In camera space, `factor` times. At no depth for an orthographic camera: the sphere test has told
    /// all.
    fn of_depth(self, instance: &InstanceView, factor: f32, slack: f32) -> DepthScale {
        let most = instance.camera_per_local;
        let factor = match instance.camera {
            Camera::Perspective(_) => most * factor,
            Camera::Orthographic(_) => f32::INFINITY,
        };
        DepthScale {
            of_weighed_error: self.of_weighed_error * factor,
            of_deviation: self.of_deviation * factor,
            slack: slack * most,
        }
    }
}

/// The tests against one threshold, in the view that groups with that threshold enter or leave.
pub(crate) struct Tests {
    sphere: SphereTest,
    /// None where outside is not the same as below.
    sides: Option<Sides>,
    /// Where these cannot tell; then `depth` would not either.
    pub(crate) facing: Option<FacingTest>,
    pub(crate) depth: DepthScale,
    /// For groups outside the view, unless they are all below any threshold.
    pub(crate) on_axis: Option<DepthScale>,
}

/// What the tests of all instances need of a camera under one set of settings.
#[derive(Clone, Copy)]
pub(crate) struct CameraParts {
    pub(super) camera: Camera,
    /// Of the widest corner; 1 for an orthographic camera.
    pub(super) secant: f32,
    scale: ErrorScale,
    /// Of what is outside, if that counts.
    on_axis: Option<ErrorScale>,
    /// Unit normals, inward, and how far the origin is inside.
    pub(super) sides: [(Vec3, f32); 4],
}

impl CameraParts {
    pub(super) fn new(camera: &Camera, settings: &LodSettings) -> Self {
        let on_axis = settings.offscreen == Offscreen::OnAxis;
        Self {
            camera: *camera,
            secant: match camera {
                Camera::Perspective(camera) => camera.max_secant(),
                Camera::Orthographic(_) => 1.0,
            },
            scale: ErrorScale::of_view(camera, settings),
            on_axis: on_axis.then(|| ErrorScale::on_axis(camera, settings)),
            sides: sides_in_camera(camera),
        }
    }
}

/// What all tests of an instance need of it.
#[derive(Clone, Copy)]
pub(super) struct InLocal {
    pub(super) eye: Vec3,
    /// About how far from the eye the farthest point is, at most.
    pub(super) size: f32,
    /// What rounding may move a point by.
    pub(super) rounding: f32,
    /// That, and the way that the answers shall bear.
    pub(super) slack: f32,
    /// Greatest by least stretch of the instance: what distances in local space may mislead by.
    unevenness: f32,
}

impl InLocal {
    /// For groups within `bounds`, and poses that move no point farther than `way`, in camera units.
    pub(super) fn new(instance: &InstanceView, bounds: &Sphere, way: f32) -> Self {
        let most = instance.camera_per_local;
        let eye = instance.camera_from_local.inverse() * -instance.origin_in_camera;
        let size = eye.length() + bounds.center.length() + bounds.radius;
        let rounding = POSITION_SLACK * size + 1e-14;
        Self {
            eye,
            size,
            rounding,
            slack: rounding + way / most * SLACK,
            unevenness: most / (least_stretch(&instance.camera_from_local, most) * 0.999),
        }
    }
}

impl Tests {
    /// Of groups that enter or leave the view of a camera.
    pub(super) fn new(
        instance: &InstanceView,
        in_local: InLocal,
        parts: &CameraParts,
        settings: &LodSettings,
        threshold_px: f32,
    ) -> Self {
        let slack = in_local.slack;
        let CameraParts { scale, secant, .. } = *parts;
        // Beyond these, squares of lengths are no numbers to trust.
        let is_trusted = (1e-15..1e13).contains(&(in_local.rounding * instance.camera_per_local));
        let has_sides = parts.on_axis.is_none() && is_trusted;
        let depth = |scale: ErrorScale| scale.of_depth(instance, 1.0 / threshold_px, slack);
        Self {
            sphere: SphereTest::new(instance, in_local, &scale, threshold_px),
            sides: has_sides.then(|| Sides::new(instance, &parts.sides, slack)),
            facing: FacingTest::new(instance, in_local, parts, settings, threshold_px),
            depth: scale.of_depth(instance, 1.0 / (threshold_px * secant), slack),
            on_axis: parts.on_axis.map(depth),
        }
    }

    /// Which of eight bounds hold nothing above the threshold.
    #[inline]
    pub(super) fn idle(&self, bounds: &Bounds, element: usize) -> f32x8 {
        let below = self.sphere.passed_by(bounds, element);
        if below.all() {
            return below;
        }
        below | self.outside(bounds, element)
    }

    /// Which of eight groups have an error below the threshold.
    #[inline]
    pub(super) fn idle_groups(&self, table: &GroupTable, block: usize) -> f32x8 {
        match &self.facing {
            // The interval test knows the sides better.
            Some(facing) => facing.passed_by(table, block),
            None => self.idle(&table.groups, block),
        }
    }

    /// Which of the eight blocks of a word hold nothing above the threshold.
    #[inline]
    pub(super) fn idle_blocks(&self, table: &GroupTable, word: usize) -> f32x8 {
        let Some(facing) = &self.facing else {
            return self.idle(&table.blocks, word);
        };
        let below = facing.passed_by_blocks(table, word);
        if below.all() {
            return below;
        }
        below | self.outside(&table.blocks, word)
    }

    /// Which are outside or, where that does not tell, far enough in any direction.
    #[inline]
    fn outside(&self, bounds: &Bounds, element: usize) -> f32x8 {
        match &self.sides {
            None => self.sphere.passed_by(bounds, element),
            Some(sides) => sides.exclude(bounds, element),
        }
    }
}

/// `((e k + r + slack) · unevenness)² < |p − eye|²`, for an orthographic camera `e k ≤ 1`.
///
/// The numbers stand in all lanes: to put them there each time would cost as much as the test.
struct SphereTest {
    is_orthographic: bool,
    has_deviation: bool,
    eye: [f32x8; 3],
    weighed_error: f32x8,
    deviation: f32x8,
    unevenness: f32x8,
    slack: f32x8,
}

impl SphereTest {
    fn new(
        instance: &InstanceView,
        in_local: InLocal,
        scale: &ErrorScale,
        threshold_px: f32,
    ) -> Self {
        let (is_orthographic, per_local) = match instance.camera {
            Camera::Perspective(_) => (false, 1.0),
            Camera::Orthographic(_) => (true, instance.camera_per_local),
        };
        let per_px = per_local / threshold_px;
        Self {
            is_orthographic,
            has_deviation: scale.of_deviation != 0.0,
            eye: in_local.eye.to_array().map(f32x8::splat),
            weighed_error: f32x8::splat(scale.of_weighed_error * per_px),
            deviation: f32x8::splat(scale.of_deviation * per_px),
            unevenness: f32x8::splat(in_local.unevenness),
            slack: f32x8::splat(in_local.slack),
        }
    }

    #[inline]
    fn passed_by(&self, bounds: &Bounds, element: usize) -> f32x8 {
        let mut error = bounds.error_weighed[element] * self.weighed_error;
        if self.has_deviation {
            let deviation = bounds.deviation[element] * self.deviation;
            error = error.simd_gt(deviation).bitselect(error, deviation);
        }
        if self.is_orthographic {
            return error.simd_le(f32x8::splat(1.0));
        }
        let (x, y, z) = (
            bounds.x[element] - self.eye[0],
            bounds.y[element] - self.eye[1],
            bounds.z[element] - self.eye[2],
        );
        let radius = bounds.radius[element] * f32x8::splat(SLACK);
        let reach = (error + radius + self.slack) * self.unevenness;
        (reach * reach).simd_lt(x * x + y * y + z * z)
    }
}

/// The four sides of a view: how far a point in local space is inside each, in camera units.
struct Sides {
    inward: [[f32x8; 3]; 4],
    /// The slack included.
    offset: [f32x8; 4],
    camera_per_local: f32x8,
}

impl Sides {
    fn new(instance: &InstanceView, sides: &[(Vec3, f32); 4], slack: f32) -> Self {
        let local_from_camera = instance.camera_from_local.transpose();
        let most = instance.camera_per_local;
        let offset = |(inward, offset): (Vec3, f32)| {
            f32x8::splat(inward.dot(instance.origin_in_camera) + offset + slack * most)
        };
        Self {
            inward: sides
                .map(|(inward, _)| (local_from_camera * inward).to_array().map(f32x8::splat)),
            offset: sides.map(offset),
            camera_per_local: f32x8::splat(most * SLACK),
        }
    }

    #[inline]
    fn exclude(&self, bounds: &Bounds, element: usize) -> f32x8 {
        let (x, y, z) = (bounds.x[element], bounds.y[element], bounds.z[element]);
        let radius = bounds.radius[element] * self.camera_per_local;
        let beyond = |side: usize| {
            let [a, b, c] = self.inward[side];
            (x * a + y * b + z * c + (self.offset[side] + radius)).simd_lt(f32x8::splat(0.0))
        };
        beyond(0) | beyond(1) | beyond(2) | beyond(3)
    }
}

/// Unit normals in camera space, and how far the origin there is inside.
fn sides_in_camera(camera: &Camera) -> [(Vec3, f32); 4] {
    match camera {
        Camera::Perspective(camera) => {
            let side = |across: Vec3, slope: f32| {
                let inward = across - Vec3::Z * slope;
                (inward / (1.0 + slope * slope).sqrt(), 0.0)
            };
            let (min, max) = (camera.slope_min, camera.slope_max);
            [
                side(Vec3::X, min.x),
                side(-Vec3::X, -max.x),
                side(Vec3::Y, min.y),
                side(-Vec3::Y, -max.y),
            ]
        }
        Camera::Orthographic(camera) => [
            (Vec3::X, -camera.min.x),
            (-Vec3::X, camera.max.x),
            (Vec3::Y, -camera.min.y),
            (-Vec3::Y, camera.max.y),
        ],
    }
}
