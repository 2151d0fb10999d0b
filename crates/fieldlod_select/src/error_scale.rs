//! How many pixels an error shows at most, wherever in a view it is.

use camera_field::{Camera, Intrinsics};

use crate::error_bounds::ErrorBounds;
use crate::settings::LodSettings;

/// What rounding may add to an error in pixels, relative.
pub(crate) const ROUNDING_ALLOWANCE: f32 = 1.001;

/// Factors from errors in local units to pixels times distance; to pixels for an orthographic camera.
///
/// With `S` the secant of the widest image corner, the bounds of [`camera_field`] give
/// ```text
/// e √(c W) ≤ e √(C S³) √W / (ρ − r),      d √(c / cos φ) ≤ d f S² / (ρ − r)
/// ```
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorScale {
    of_weighed_error: f32,
    of_deviation: f32,
}

impl ErrorScale {
    /// Upper bounds for the whole view.
    pub(crate) fn of_view(camera: &Camera, settings: &LodSettings) -> Self {
        match camera {
            Camera::Perspective(camera) => Self::perspective(camera, camera.max_secant(), settings),
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
            Camera::Perspective(camera) => Self::perspective(camera, 1.0, settings),
            Camera::Orthographic(_) => Self::of_view(camera, settings),
        }
    }

    fn perspective(camera: &Intrinsics, secant: f32, settings: &LodSettings) -> Self {
        let strength = camera.constant_px2() * secant * secant * secant;
        let focal_px = camera.focal_px.x.max(camera.focal_px.y);
        Self::new(settings, strength.sqrt(), focal_px * secant * secant)
    }

    fn new(settings: &LodSettings, of_error: f32, of_displacement: f32) -> Self {
        let weights = settings.error_weights();
        let of_error = if weights.counts_error { of_error } else { 0.0 };
        let weight = weights.displacement_weight.unwrap_or(0.0);
        Self {
            of_weighed_error: of_error * ROUNDING_ALLOWANCE,
            of_deviation: of_displacement * weight * ROUNDING_ALLOWANCE,
        }
    }

    /// The same of errors that count `bias` times.
    pub(crate) fn biased(self, bias: f32) -> Self {
        Self {
            of_weighed_error: self.of_weighed_error * bias,
            of_deviation: self.of_deviation * bias,
        }
    }

    /// The same times `factor`, of weighed errors and, where they count, of deviations.
    pub(crate) fn times(&self, factor: f32) -> (f32, Option<f32>) {
        let counts_deviation = self.of_deviation != 0.0;
        let of_deviation = counts_deviation.then_some(self.of_deviation * factor);
        (self.of_weighed_error * factor, of_deviation)
    }

    /// The largest of the errors, in pixels times distance.
    pub(crate) fn of(&self, bounds: &ErrorBounds) -> f32 {
        let error = bounds.error_weighed * self.of_weighed_error;
        error.max(bounds.deviation * self.of_deviation)
    }
}
