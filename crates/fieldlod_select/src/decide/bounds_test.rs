//! Tests of spheres against one threshold, which answer only what the criterion would answer alike:
//! that nothing in a sphere is above the threshold, or that it is outside the view.
//!
//! # Far enough in any direction
//! `e k/τ + r ≤ ρ`, with the factor `k` of [`ErrorScale`](crate::error_scale::ErrorScale): in local
//! space, without a root, `(e k/τ + r)² ≤ |p − eye|²`. It is the sphere test of rotation-invariant
//! metrics with another constant. What reaches the camera, or is not a number, never passes.
//!
//! # Deep enough
//! `e k/(S τ) ≤ z − r`, which is sharper near the axis, of perspective views; for similarities the
//! sharper test of [`facing`](super::facing), which knows the direction too.
//!
//! # Outside
//! Farther beyond a side of the view than the sphere's radius.

use camera_field::Camera;
use wide::f32x8;

use super::facing::FacingTest;
use super::local_view::LocalView;
use crate::error_scale::ROUNDING_ALLOWANCE;
use crate::lane::{Lane, V3};
use crate::settings::Offscreen;
use crate::sides::Sides;
use crate::table::{BoundsLanes, GroupTable};
use crate::view_parts::CameraParts;

/// The tests against one threshold, in the view that groups with that threshold enter or leave.
pub(super) struct BoundsTest {
    sphere: SphereTest,
    /// `None` where outside is not the same as below.
    sides: Option<SidesTest>,
    near: NearTest,
}

/// The test of what may be near, where more is known of it.
enum NearTest {
    Facing(FacingTest),
    Depth(DepthTest),
    /// For an orthographic camera the sphere test has told all.
    None,
}

impl BoundsTest {
    /// For groups that enter or leave the view of a camera.
    pub(super) fn new(local: &LocalView, camera: &CameraParts, threshold_px: f32) -> Self {
        // Beyond these, squares of lengths are no numbers to trust.
        let rounding_in_camera = local.rounding * local.instance.camera_per_local;
        let is_trusted = (1e-15..1e13).contains(&rounding_in_camera);
        let has_sides = local.parts.settings.offscreen == Offscreen::Coarsest && is_trusted;
        let is_similarity = local.instance.seen_stretch.is_none();
        Self {
            sphere: SphereTest::new(local, camera, threshold_px),
            sides: has_sides.then(|| SidesTest::new(local, &camera.sides)),
            near: match camera.camera {
                Camera::Perspective(_) if is_similarity => {
                    NearTest::Facing(FacingTest::new(local, camera, threshold_px))
                }
                Camera::Perspective(_) => {
                    NearTest::Depth(DepthTest::new(local, camera, threshold_px))
                }
                Camera::Orthographic(_) => NearTest::None,
            },
        }
    }

    /// Which of eight chunks hold nothing above the threshold.
    #[inline]
    pub(super) fn passes_chunks(&self, table: &GroupTable, element: usize) -> f32x8 {
        let below = self.sphere.passes(&table.chunks, element);
        self.or_outside(below, &table.chunks, element)
    }

    /// Which of the eight blocks of a word hold nothing above the threshold.
    #[inline]
    pub(super) fn passes_blocks(&self, table: &GroupTable, word: usize) -> f32x8 {
        let below = match &self.near {
            NearTest::Facing(facing) => facing.passes_blocks(table, word),
            NearTest::Depth(depth) => depth.passes(&table.blocks, word),
            NearTest::None => self.sphere.passes(&table.blocks, word),
        };
        self.or_outside(below, &table.blocks, word)
    }

    /// Which of eight groups have an error below the threshold.
    #[inline]
    pub(super) fn passes_groups(&self, table: &GroupTable, block: usize) -> f32x8 {
        let below = match &self.near {
            // The interval test, which comes next, knows the sides better.
            NearTest::Facing(facing) => return facing.passes_groups(table, block),
            NearTest::Depth(depth) => depth.passes(&table.groups, block),
            NearTest::None => self.sphere.passes(&table.groups, block),
        };
        self.or_outside(below, &table.groups, block)
    }

    /// What is below or outside or, where that does not tell, far enough in any direction.
    #[inline]
    fn or_outside(&self, below: f32x8, bounds: &BoundsLanes, element: usize) -> f32x8 {
        if below.all() {
            return below;
        }
        match &self.sides {
            Some(sides) => below | sides.excludes(bounds, element),
            None => below | self.sphere.passes(bounds, element),
        }
    }
}

/// Far enough in any direction; for an orthographic camera `e k ≤ τ`.
///
/// The numbers stand in all lanes: to put them there each time would cost as much as the test.
struct SphereTest {
    is_orthographic: bool,
    eye: V3<f32x8>,
    weighed_error: f32x8,
    deviation: Option<f32x8>,
    unevenness: f32x8,
    slack: f32x8,
}

impl SphereTest {
    #[inline]
    fn new(local: &LocalView, camera: &CameraParts, threshold_px: f32) -> Self {
        let (is_orthographic, per_local) = match camera.camera {
            Camera::Perspective(_) => (false, 1.0),
            Camera::Orthographic(_) => (true, local.instance.camera_per_local),
        };
        let (weighed_error, deviation) = camera.scale.times(per_local / threshold_px);
        Self {
            is_orthographic,
            eye: local.eye,
            weighed_error: f32x8::splat(weighed_error),
            deviation: deviation.map(f32x8::splat),
            unevenness: f32x8::splat(local.unevenness),
            slack: f32x8::splat(local.slack),
        }
    }

    #[inline]
    fn passes(&self, bounds: &BoundsLanes, element: usize) -> f32x8 {
        let error = largest_error(bounds, element, self.weighed_error, self.deviation);
        if self.is_orthographic {
            return error.is_at_most(f32x8::splat(1.0));
        }
        let from_eye = bounds.center(element).minus(self.eye);
        let radius = bounds.radius[element] * f32x8::splat(ROUNDING_ALLOWANCE);
        let needed = (error + radius + self.slack) * self.unevenness;
        (needed * needed).is_below(from_eye.dot(from_eye))
    }
}

/// Deep enough, whatever the placement: depths are in camera space.
struct DepthTest {
    axis: V3<f32x8>,
    /// Depth of the origin, less what points may move.
    offset: f32x8,
    camera_per_local: f32x8,
    weighed_error: f32x8,
    deviation: Option<f32x8>,
}

impl DepthTest {
    fn new(local: &LocalView, camera: &CameraParts, threshold_px: f32) -> Self {
        let instance = local.instance;
        let most = instance.camera_per_local;
        let (weighed_error, deviation) = camera.scale.times(most / (threshold_px * camera.secant));
        Self {
            axis: V3::splat(instance.camera_from_local.transpose().z_axis),
            offset: f32x8::splat(instance.origin_in_camera.z - 2.0 * local.slack * most),
            camera_per_local: f32x8::splat(most * ROUNDING_ALLOWANCE),
            weighed_error: f32x8::splat(weighed_error),
            deviation: deviation.map(f32x8::splat),
        }
    }

    #[inline]
    fn passes(&self, bounds: &BoundsLanes, element: usize) -> f32x8 {
        let error = largest_error(bounds, element, self.weighed_error, self.deviation);
        let depth = bounds.center(element).dot(self.axis) + self.offset;
        error.is_below(depth - bounds.radius[element] * self.camera_per_local)
    }
}

/// The larger of the weighed error and the deviation, each times its factor.
#[inline]
fn largest_error(
    bounds: &BoundsLanes,
    element: usize,
    of_error: f32x8,
    of_deviation: Option<f32x8>,
) -> f32x8 {
    let error = bounds.error_weighed[element] * of_error;
    match of_deviation {
        Some(of_deviation) => error.larger(bounds.deviation[element] * of_deviation),
        None => error,
    }
}

/// Farther beyond a side of the view than the radius.
struct SidesTest {
    /// In local space, in camera units; the slack included.
    sides: Sides<f32x8>,
    camera_per_local: f32x8,
}

impl SidesTest {
    #[inline]
    fn new(local: &LocalView, sides: &Sides<f32>) -> Self {
        let instance = local.instance;
        let most = instance.camera_per_local;
        let (linear, translation) = (&instance.camera_from_local, instance.origin_in_camera);
        Self {
            sides: sides.moved(linear, translation, local.slack * most),
            camera_per_local: f32x8::splat(most * ROUNDING_ALLOWANCE),
        }
    }

    #[inline]
    fn excludes(&self, bounds: &BoundsLanes, element: usize) -> f32x8 {
        let radius = bounds.radius[element] * self.camera_per_local;
        self.sides.exclude(bounds.center(element), radius)
    }
}
