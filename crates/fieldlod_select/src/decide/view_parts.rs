//! What the tests of all instances need of a view under one set of settings.

use camera_field::Camera;
use wide::f32x8;

use crate::error_scale::ErrorScale;
use crate::settings::LodSettings;
use crate::sides::PerspectiveSides;

/// The cameras that groups enter and, once refined, leave.
pub(crate) struct ViewParts<'a> {
    pub(super) settings: &'a LodSettings,
    pub(super) entering: CameraParts,
    /// `None` where that is the same.
    leaving: Option<CameraParts>,
}

/// What the tests need of one camera.
pub(crate) struct CameraParts {
    pub(super) camera: Camera,
    /// Secant of the image's widest corner; 1 for an orthographic camera.
    pub(super) secant: f32,
    pub(super) scale: ErrorScale,
    /// The sides in camera space, of no meaning for an orthographic camera.
    pub(super) sides: PerspectiveSides<f32x8>,
    /// `C` of the criterion's field strength and `f`, of perspective cameras and where the errors that
    /// they belong to count.
    pub(super) constant_px2: Option<f32>,
    pub(super) focal_px: Option<f32>,
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
    pub(super) fn leaving(&self) -> &CameraParts {
        self.leaving.as_ref().unwrap_or(&self.entering)
    }

    /// Whether refined groups leave another view than they enter.
    #[inline]
    pub(super) fn has_margin(&self) -> bool {
        self.leaving.is_some()
    }
}

impl CameraParts {
    fn new(camera: &Camera, settings: &LodSettings) -> Self {
        let weights = settings.error_weights();
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
            sides: PerspectiveSides::of(camera),
            constant_px2: weights.counts_error.then_some(constant_px2),
            focal_px: weights.displacement_weight.map(|weight| focal_px * weight),
        }
    }
}
