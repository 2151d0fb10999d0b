//! What tests of objects and of their groups need of a view under one set of settings.

use camera_field::Camera;
use wide::f32x8;

use crate::error_scale::ErrorScale;
use crate::settings::LodSettings;
use crate::sides::{PerspectiveSides, Sides};

/// The cameras that groups enter and, once refined, leave.
pub(crate) struct ViewParts<'a> {
    pub(crate) settings: &'a LodSettings,
    pub(crate) entering: CameraParts,
    /// `None` where that is the same.
    leaving: Option<CameraParts>,
}

/// What the tests need of one camera.
pub(crate) struct CameraParts {
    pub(crate) camera: Camera,
    /// Secant of the image's widest corner; 1 for an orthographic camera.
    pub(crate) secant: f32,
    pub(crate) scale: ErrorScale,
    /// The sides in camera space.
    pub(crate) sides: Sides<f32>,
    /// The same for eight spheres at once, of no meaning for an orthographic camera.
    pub(crate) perspective_sides: PerspectiveSides<f32x8>,
    /// `C` of the criterion's field strength and `f`, of perspective cameras and where the errors that
    /// they belong to count.
    pub(crate) constant_px2: Option<f32>,
    pub(crate) focal_px: Option<f32>,
}

impl<'a> ViewParts<'a> {
    pub(crate) fn new(entering: &Camera, leaving: &Camera, settings: &'a LodSettings) -> Self {
        Self {
            settings,
            entering: CameraParts::new(entering, settings),
            leaving: (leaving != entering).then(|| CameraParts::new(leaving, settings)),
        }
    }

    /// The camera that refined groups leave.
    #[inline]
    pub(crate) fn leaving(&self) -> &CameraParts {
        self.leaving.as_ref().unwrap_or(&self.entering)
    }

    /// Whether refined groups leave another view than they enter.
    #[inline]
    pub(crate) fn has_margin(&self) -> bool {
        self.leaving.is_some()
    }
}

impl CameraParts {
    fn new(camera: &Camera, settings: &LodSettings) -> Self {
        let weights = settings.error_weights();
        let sides = Sides::of(camera);
        let (secant, constant_px2, focal_px) = match camera {
            Camera::Perspective(camera) => (
                camera.max_secant(),
                camera.constant_px2(),
                camera.focal_px.x.max(camera.focal_px.y),
            ),
            Camera::Orthographic(_) => (1.0, 0.0, 0.0),
        };
        Self {
            camera: *camera,
            secant,
            scale: ErrorScale::of_view(camera, settings),
            perspective_sides: PerspectiveSides::of(&sides),
            sides,
            constant_px2: weights.counts_error.then_some(constant_px2),
            focal_px: weights.displacement_weight.map(|weight| focal_px * weight),
        }
    }
}
