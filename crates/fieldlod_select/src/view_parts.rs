//! What tests of objects and of their groups need of a view under one set of settings.

use std::cell::OnceCell;

use camera_field::Camera;
use wide::f32x8;

use crate::error_scale::ErrorScale;
use crate::settings::LodSettings;
use crate::sides::{LensSides, Sides};

/// The cameras that groups enter and, once refined, leave.
pub(crate) struct ViewParts<'a> {
    pub(crate) settings: &'a LodSettings,
    pub(crate) entering: CameraParts,
    /// How far from the axis of an orthographic view its sides are at most.
    pub(crate) reach: f32,
    /// The camera that refined groups leave; `None` where that is the same.
    kept_camera: Option<Camera>,
    /// The parts of it: made when first asked, as most frames decide nothing that was refined.
    leaving: OnceCell<CameraParts>,
}

/// What the tests need of one camera.
pub(crate) struct CameraParts {
    pub(crate) camera: Camera,
    /// Secant of the image's widest corner; 1 for an orthographic camera.
    pub(crate) secant: f32,
    /// Cosine of that angle.
    pub(crate) least_cosine: f32,
    pub(crate) scale: ErrorScale,
    /// The sides in camera space.
    pub(crate) sides: Sides<f32>,
    /// The same for eight spheres at once: made when first asked.
    lens_sides: OnceCell<LensSides<f32x8>>,
    /// `C` of the criterion's field strength and `f`, of an orthographic camera the strength itself and pixels for
    /// each unit, where the errors that they belong to count.
    pub(crate) constant_px2: Option<f32>,
    pub(crate) focal_px: Option<f32>,
}

impl<'a> ViewParts<'a> {
    pub(crate) fn new(entering: &Camera, leaving: &Camera, settings: &'a LodSettings) -> Self {
        Self {
            settings,
            entering: CameraParts::new(entering, settings),
            reach: Sides::of(leaving).reach(),
            kept_camera: (leaving != entering).then_some(*leaving),
            leaving: OnceCell::new(),
        }
    }

    /// The camera that refined groups leave.
    #[inline]
    pub(crate) fn leaving(&self) -> &CameraParts {
        let Some(camera) = &self.kept_camera else {
            return &self.entering;
        };
        let parts = || CameraParts::new(camera, self.settings);
        self.leaving.get_or_init(parts)
    }

    /// Whether refined groups leave another view than they enter.
    #[inline]
    pub(crate) fn has_margin(&self) -> bool {
        self.kept_camera.is_some()
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
            Camera::Orthographic(camera) => {
                let pixels = camera.pixels_per_unit;
                (1.0, pixels.x * pixels.y, pixels.x.max(pixels.y))
            }
        };
        Self {
            camera: *camera,
            secant,
            least_cosine: 1.0 / secant,
            scale: ErrorScale::of_view(camera, settings),
            sides: Sides::of(camera),
            lens_sides: OnceCell::new(),
            constant_px2: weights.counts_error.then_some(constant_px2),
            focal_px: weights.displacement_weight.map(|weight| focal_px * weight),
        }
    }

    /// The sides for eight spheres at once.
    #[inline]
    pub(crate) fn lens_sides(&self) -> &LensSides<f32x8> {
        self.lens_sides.get_or_init(|| LensSides::of(&self.sides))
    }
}
