//! The test of sizes on screen: whether instances are too small to be drawn, and for how long.
//!
//! ```text
//! size = 2 r b f / ρ      pixels;      2 r b s  in an orthographic view of s pixels for each unit
//!
//! r   radius of the instance, in the world      ρ  distance of its bounding sphere's centre to the eye
//! b   its bias                                  f  focal length, the larger of the two
//! ```
//! It depends on the distance and the lens alone, so that turning the camera changes nothing.

use camera_field::Camera;
use fieldlod_hierarchy::Sphere;
use glam::Vec3;

use crate::settings::LodSettings;
use crate::tree::Node;
use crate::validity::{CameraTravel, Levers, Validity};
use crate::view::View;
use crate::zoom::zoom_to;

/// Allowance for the rounding of distances, relative to the coordinates.
const POSITION_SLACK: f32 = 1e-5;

/// Sizes of instances and of all below a node against one view's threshold.
pub(crate) struct SizeTest {
    eye_in_world: Vec3,
    camera: Camera,
    /// How far from the eye a radius of 1 is large enough, or how many times over in an orthographic view:
    /// for what is drawn already, and for what is not.
    reach_drawn: f32,
    reach_culled: f32,
    now: CameraTravel,
    /// Whether answers may stay valid.
    is_lasting: bool,
}

impl SizeTest {
    /// The test of a view; `None` if it draws all sizes. Answers are `is_lasting` if points move no farther
    /// in camera space than `now` tells.
    pub(crate) fn new(
        view: &View,
        settings: &LodSettings,
        now: CameraTravel,
        is_lasting: bool,
    ) -> Option<Self> {
        let cull_below_px = settings.cull_below_px.filter(|px| *px > 0.0)?;
        let scale = match view.camera {
            Camera::Perspective(camera) => camera.focal_px.max_element(),
            Camera::Orthographic(camera) => {
                let camera_per_world = view.camera_from_world.x_axis.length();
                camera.pixels_per_unit.max_element() * camera_per_world
            }
        };
        let reach_culled = 2.0 * scale * settings.resolution_scale / cull_below_px;
        Some(Self {
            eye_in_world: view.eye_in_world,
            camera: view.camera,
            reach_drawn: reach_culled / settings.hysteresis.clamp(0.0, 1.0),
            reach_culled,
            now,
            is_lasting,
        })
    }

    /// Whether an instance is drawn, and for how long that answer is valid.
    pub(crate) fn of_instance(&self, node: &Node, was_drawn: bool) -> (bool, Validity) {
        let reach = if was_drawn {
            self.reach_drawn
        } else {
            self.reach_culled
        };
        let sphere = &node.bounds.sphere;
        let reach = node.radii[0] * reach;
        let margin = self.margin(reach, self.distance(sphere));
        // NaN is drawn.
        let is_drawn = margin >= 0.0 || margin.is_nan();
        (is_drawn, self.lasting(margin.abs(), reach, sphere))
    }

    /// Whether all instances below a node are drawn, or none of them, and for how long; `None` if that cannot
    /// be told. They were all drawn before, or none of them, or `None` if that is not known.
    pub(crate) fn of_node(
        &self,
        node: &Node,
        were_drawn: Option<bool>,
    ) -> Option<(bool, Validity)> {
        let sphere = &node.bounds.sphere;
        let distance = self.distance(sphere);
        let [smallest, largest] = node.radii;
        // What was drawn is so for longer, what was not comes later.
        let (reach_least, reach_most) = match were_drawn {
            Some(true) => (self.reach_drawn, self.reach_drawn),
            Some(false) => (self.reach_culled, self.reach_culled),
            None => (self.reach_culled, self.reach_drawn),
        };
        let (least, most) = (smallest * reach_least, largest * reach_most);
        let drawn = self.margin(least, distance + sphere.radius);
        let culled = -self.margin(most, distance - sphere.radius);
        let answer = |margin: f32, reach: f32, is_drawn: bool| {
            let slack = self.slack(sphere);
            (margin > slack).then(|| (is_drawn, self.lasting(margin, reach, sphere)))
        };
        answer(drawn, least, true).or_else(|| answer(culled, most, false))
    }

    fn distance(&self, sphere: &Sphere) -> f32 {
        (sphere.center - self.eye_in_world).length()
    }

    /// By how much a distance is less than that which `reach` allows.
    fn margin(&self, reach: f32, distance: f32) -> f32 {
        match self.camera {
            Camera::Perspective(_) => reach - distance,
            Camera::Orthographic(_) if reach >= 1.0 => f32::INFINITY,
            Camera::Orthographic(_) => f32::NEG_INFINITY,
        }
    }

    fn slack(&self, sphere: &Sphere) -> f32 {
        let size = sphere.center.length() + self.eye_in_world.length() + sphere.radius;
        size * POSITION_SLACK
    }

    fn lasting(&self, margin: f32, reach: f32, sphere: &Sphere) -> Validity {
        if self.is_lasting && matches!(self.camera, Camera::Orthographic(_)) {
            return Validity::while_zoomed(zoom_to(reach.max(1.0 / reach)), &self.now);
        }
        let tolerance = margin * 0.999 - self.slack(sphere);
        if self.is_lasting && tolerance > 0.0 {
            // The reach is no farther than that.
            let zoom = self.distance(sphere) + sphere.radius + margin;
            let levers = Levers { turn: 0.0, zoom };
            Validity::tolerating(f64::from(tolerance), &levers, &self.now)
        } else {
            Validity::NONE
        }
    }
}
