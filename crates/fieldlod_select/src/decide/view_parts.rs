//! What the tests of all instances need of a view under one set of settings.

use camera_field::Camera;
use wide::f32x8;

use crate::error_scale::ErrorScale;
use crate::settings::LodSettings;
use crate::sides::Sides;
use crate::view::{InstanceView, View};

/// The cameras that groups enter and, once refined, leave.
pub(crate) struct ViewParts {
    pub(super) entering: CameraParts,
    pub(super) leaving: CameraParts,
    /// Whether they are two.
    pub(super) has_margin: bool,
}

/// What the tests need of one camera.
pub(crate) struct CameraParts {
    pub(super) camera: Camera,
    /// Secant of the image's widest corner; 1 for an orthographic camera.
    pub(super) secant: f32,
    pub(super) scale: ErrorScale,
    /// The sides in camera space.
    pub(super) sides: Sides<f32x8>,
}

impl ViewParts {
    pub(crate) fn of_view(view: &View, settings: &LodSettings) -> Self {
        Self::new(&view.camera, &view.kept_camera, settings)
    }

    pub(super) fn of_instance(instance: &InstanceView, settings: &LodSettings) -> Self {
        Self::new(&instance.camera, &instance.kept_camera, settings)
    }

    fn new(entering: &Camera, leaving: &Camera, settings: &LodSettings) -> Self {
        Self {
            entering: CameraParts::new(entering, settings),
            leaving: CameraParts::new(leaving, settings),
            has_margin: entering != leaving,
        }
    }
}

impl CameraParts {
    fn new(camera: &Camera, settings: &LodSettings) -> Self {
        Self {
            camera: *camera,
            secant: match camera {
                Camera::Perspective(camera) => camera.max_secant(),
                Camera::Orthographic(_) => 1.0,
            },
            scale: ErrorScale::of_view(camera, settings),
            sides: Sides::of(camera),
        }
    }
}
