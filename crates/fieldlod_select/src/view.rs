//! Views: a camera with its pose, and instances in camera space.

mod instance_view;
pub(crate) mod shadow_lights;
pub(crate) mod sides;
pub(crate) mod stretch;

use camera_field::{CAMERA_FROM_VIEW, Camera, Intrinsics, OrthographicIntrinsics};
use glam::{Affine3A, Mat3, Vec2, Vec3};

use crate::settings::LodSettings;
pub use instance_view::InstanceView;
pub(crate) use instance_view::camera_from_local;
use shadow_lights::{ShadowLight, ShadowLights};

/// A camera with its pose in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    pub(crate) camera: Camera,
    /// The camera of the image itself, without margins.
    pub(crate) image_camera: Camera,
    /// The camera whose image refined groups leave: as wide or wider.
    pub(crate) kept_camera: Camera,
    /// Linear part only: positions are first taken relative to the eye, which keeps digits far from the origin.
    pub(crate) camera_from_world: Mat3,
    pub(crate) eye_in_world: Vec3,
    /// The layers that the view draws.
    pub(crate) layers: u64,
    /// The lights that may cast shadows into the view.
    pub(crate) shadow_lights: ShadowLights,
}

impl View {
    /// A view from the pose of its camera: view space looks along −Z with +Y up.
    #[must_use]
    pub fn new(camera: Camera, world_from_view: &Affine3A) -> Self {
        let view_from_world = Mat3::from(world_from_view.matrix3).inverse();
        Self {
            camera,
            image_camera: camera,
            kept_camera: camera,
            camera_from_world: CAMERA_FROM_VIEW * view_from_world,
            eye_in_world: Vec3::from(world_from_view.translation),
            layers: u64::MAX,
            shadow_lights: ShadowLights::Any,
        }
    }

    /// The same view with the lights that cast shadows into it. With [`Offscreen::OnAxis`](crate::Offscreen::OnAxis),
    /// instances outside the view count only if they may cast a shadow of one of these lights into it. With more than
    /// four lights, or without this call, all instances count.
    #[must_use]
    pub fn with_shadow_lights(&self, lights: &[ShadowLight]) -> Self {
        Self {
            shadow_lights: ShadowLights::new(lights),
            ..*self
        }
    }

    /// The same view, into which any instance may cast a shadow. All instances outside it count, as in a new view.
    #[must_use]
    pub fn with_any_shadow_light(&self) -> Self {
        Self {
            shadow_lights: ShadowLights::Any,
            ..*self
        }
    }

    /// The same view, which draws only instances on one of `layers` ([`Scene::set_layers`](crate::Scene::set_layers)).
    /// A new view draws all layers.
    #[must_use]
    pub fn with_layers(&self, layers: u64) -> Self {
        Self { layers, ..*self }
    }

    /// The layers that the view draws, one bit each.
    #[must_use]
    pub fn layers(&self) -> u64 {
        self.layers
    }

    /// A point of the world in camera space, in which +Z is ahead and +Y is down.
    #[must_use]
    pub fn in_camera(&self, in_world: Vec3) -> Vec3 {
        self.camera_from_world * (in_world - self.eye_in_world)
    }

    /// The map from an instance's local space to camera space: linear part and origin.
    #[must_use]
    pub fn camera_from_local(&self, world_from_local: &Affine3A) -> (Mat3, Vec3) {
        camera_from_local(self, world_from_local)
    }

    /// The camera's intrinsics.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The view with the margins of `settings`, at the same pixels per unit. It is wider by `offscreen_margin` on each
    /// side, and for refined groups by a further `edge_hysteresis` of the wider size.
    #[must_use]
    pub fn with_margins(&self, settings: &LodSettings) -> Self {
        let camera = widened(&self.camera, settings.advanced.offscreen_margin);
        // With a negative margin, a group would leave where it enters.
        let margin = settings.advanced.edge_hysteresis.max(0.0);
        Self {
            camera,
            kept_camera: widened(&camera, margin),
            ..*self
        }
    }
}

/// A camera of a wider image: `margin` of its width and height more on each side.
fn widened(camera: &Camera, margin: f32) -> Camera {
    let outward = |min: Vec2, max: Vec2| {
        let border = (max - min) * margin;
        (min - border, max + border)
    };
    match *camera {
        Camera::Perspective(camera) => {
            let (slope_min, slope_max) = outward(camera.slope_min, camera.slope_max);
            Camera::Perspective(Intrinsics {
                slope_min,
                slope_max,
                ..camera
            })
        }
        Camera::Orthographic(camera) => {
            let (min, max) = outward(camera.min, camera.max);
            Camera::Orthographic(OrthographicIntrinsics { min, max, ..camera })
        }
    }
}
