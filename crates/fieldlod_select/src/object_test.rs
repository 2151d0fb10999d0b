//! The test of whole objects: whether all of their groups stay at their coarsest, and for how long.

use camera_field::Camera;
use fieldlod_hierarchy::Sphere;

use crate::error_bounds::ErrorBounds;
use crate::error_scale::ErrorScale;
use crate::lane::V3;
use crate::settings::{Offscreen, Thresholds};
use crate::shadow_lights::ShadowTest;
use crate::sides::Sides;
use crate::stretch::is_similarity;
use crate::validity::{CameraTravel, Levers, Validity};
use crate::view::View;
use crate::view_parts::ViewParts;
use crate::zoom::zoom_to;

/// Allowance for the rounding of coordinates, relative to their size.
const POSITION_SLACK: f32 = 1e-5;
const ROUNDING_ALLOWANCE: f32 = 1.001;

/// Spheres and errors of whole objects against one view.
pub(crate) struct ObjectTest<'a> {
    view: &'a View,
    parts: &'a ViewParts<'a>,
    thresholds: Thresholds,
    /// The scale of what is outside the view, if that counts.
    on_axis: Option<ErrorScale>,
    /// What of that may cast a shadow into the view.
    shadows: ShadowTest,
    now: CameraTravel,
    is_usable: bool,
    is_orthographic: bool,
    /// How far from the axis of an orthographic view any of its sides are.
    reach: f32,
}

impl<'a> ObjectTest<'a> {
    pub(crate) fn new(view: &'a View, parts: &'a ViewParts<'a>, now: CameraTravel) -> Self {
        let settings = parts.settings;
        let thresholds = settings.thresholds(1.0);
        let unit = view.camera_from_world.x_axis.length();
        let is_rigid = is_similarity(&view.camera_from_world) && (unit - 1.0).abs() < 1e-4;
        Self {
            view,
            parts,
            thresholds,
            on_axis: match settings.offscreen {
                Offscreen::Coarsest => None,
                Offscreen::OnAxis { bias } => {
                    Some(ErrorScale::on_axis(&view.camera, settings).biased(bias))
                }
            },
            shadows: ShadowTest::new(
                view.shadow_lights,
                Sides::of(&view.image_camera),
                matches!(view.image_camera, Camera::Perspective(_)),
                view.camera_from_world,
            ),
            now,
            is_orthographic: matches!(view.camera, Camera::Orthographic(_)),
            reach: parts.reach.max(Sides::of(&view.image_camera).reach()),
            // A view that scales, or no threshold at all, gets no shortcut.
            is_usable: is_rigid && thresholds.coarsen_below_px >= 0.0,
        }
    }

    /// Whether points move no farther in camera space than the camera's travel says.
    pub(crate) fn is_usable(&self) -> bool {
        self.is_usable
    }

    /// How far the farthest point of a sphere is from the eye, at most.
    pub(crate) fn farthest(&self, sphere: &Sphere) -> f32 {
        let distance = (sphere.center - self.view.eye_in_world).length();
        (distance + sphere.radius) * ROUNDING_ALLOWANCE
    }

    /// For how long nothing in `object` is refined but what always is; `None` if that cannot be told.
    /// `is_coarsest` says that nothing in it was refined before.
    pub(crate) fn coarsest(&self, object: &ErrorBounds, is_coarsest: bool) -> Option<Validity> {
        if !self.is_usable {
            return None;
        }
        // The sphere in camera space, wider by what rounding may move it.
        let Sphere { center, radius } = object.sphere;
        let from_eye = center - self.view.eye_in_world;
        let distance = from_eye.length();
        let size = center.length() + self.view.eye_in_world.length() + radius;
        let sphere = Sphere {
            center: self.view.camera_from_world * from_eye,
            radius: radius * ROUNDING_ALLOWANCE + size * POSITION_SLACK,
        };
        let gap = distance - sphere.radius;
        // What was refined leaves a wider view, below a lower threshold.
        let (camera, threshold_px) = if is_coarsest {
            (&self.parts.entering, self.thresholds.refine_above_px)
        } else {
            (self.parts.leaving(), self.thresholds.coarsen_below_px)
        };
        let tolerating = |tolerance: f32, levers: Levers| {
            Validity::tolerating(f64::from(tolerance * 0.999), &levers, &self.now)
        };
        // Far enough in any direction: turns do not matter.
        let error = |scale: &ErrorScale| scale.of(object) / threshold_px;
        let beyond_error = self.distance_beyond(error(&camera.scale), gap);
        if beyond_error > 0.0 {
            let zoom = distance * ROUNDING_ALLOWANCE;
            return Some(match self.is_orthographic {
                true => self.while_small(error(&camera.scale)),
                false => tolerating(beyond_error, Levers { turn: 0.0, zoom }),
            });
        }
        // Outside the view, and far enough there if that counts.
        let mut outside = self.distance_outside(&camera.sides, &sphere);
        let mut while_small = None;
        if let Some(on_axis) = &self.on_axis {
            let beyond_error = self.distance_beyond(error(on_axis), gap);
            while_small = (self.is_orthographic && beyond_error > 0.0)
                .then(|| self.while_small(error(on_axis)));
            let dark = self
                .shadows
                .distance_dark(&object.sphere, &sphere, distance);
            let unseen = if dark > beyond_error {
                dark
            } else {
                beyond_error
            };
            // NaN if either is.
            if !(outside < unseen || outside.is_nan()) {
                outside = unseen;
            }
        }
        let farthest = (distance + outside) * ROUNDING_ALLOWANCE;
        let levers = Levers {
            turn: farthest,
            zoom: match self.is_orthographic {
                true => self.reach,
                false => farthest,
            },
        };
        (outside > 0.0).then(|| {
            let validity = tolerating(outside, levers);
            while_small.map_or(validity, |small| validity.and(&small, &self.now))
        })
    }

    /// For how long an error that is less than its threshold, by this factor, is so in an orthographic view: that
    /// depends on the lens alone.
    fn while_small(&self, error: f32) -> Validity {
        Validity::while_zoomed(zoom_to(1.0 / error), &self.now)
    }

    /// By how much a gap to the camera is more than that at which an error reaches its threshold.
    fn distance_beyond(&self, error: f32, gap: f32) -> f32 {
        match self.is_orthographic {
            false => gap - error,
            true if error < 1.0 => f32::INFINITY,
            true => -1.0,
        }
    }

    /// How far a sphere in camera space is from the field of view, at least; negative inside.
    fn distance_outside(&self, sides: &Sides<f32>, sphere: &Sphere) -> f32 {
        let beyond_side = -sides.least_inside(V3::splat(sphere.center));
        let beyond = match self.is_orthographic {
            false => beyond_side.max(-sphere.center.z),
            true => beyond_side,
        };
        beyond - sphere.radius
    }
}
