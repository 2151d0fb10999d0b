//! The field of a camera in the plane (§2.1): `x` across, `y` along the optical axis.
//!
//! ```text
//! c(0, y) = −f / y j                 (1)
//! f       = res/2 · cot(fov/2)       (2)
//! |c|     = f √(x² + y²) / y²        (3)
//! c(x, y) = −f (x i + y j) / y²      (4), zero outside the field of view
//! ```

use super::scalar::{Real, Vec2};

/// A camera in the plane. Its field is in samples per unit length, that of [`crate::Intrinsics`] in
/// samples per unit area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarCamera {
    /// Focal length in pixels; the constant of eq. 2.
    pub focal_px: Real,
    /// Slope `x/y` at one edge of the image line.
    pub slope_min: Real,
    /// Slope `x/y` at the other edge; greater than `slope_min`.
    pub slope_max: Real,
}

impl PlanarCamera {
    /// A centred camera with `resolution_px` pixels between the slopes `±half_slope`
    /// (eq. 2; `half_slope` is the tangent of half the field of view).
    #[inline]
    pub fn centered(resolution_px: Real, half_slope: Real) -> Self {
        Self {
            focal_px: 0.5 * resolution_px / half_slope,
            slope_min: -half_slope,
            slope_max: half_slope,
        }
    }

    /// Returns `true` if `p` is inside the field of view.
    #[inline]
    pub fn contains(&self, p: Vec2) -> bool {
        p.y > 0.0 && p.x >= self.slope_min * p.y && p.x <= self.slope_max * p.y
    }

    /// The planar field (eq. 4), pointing to the camera.
    #[inline]
    pub fn field(&self, p: Vec2) -> Vec2 {
        if self.contains(p) {
            p * (-self.focal_px / (p.y * p.y))
        } else {
            Vec2::ZERO
        }
    }

    /// Strength of the planar field (eq. 3): samples per unit length perpendicular to the sight ray.
    #[inline]
    pub fn strength(&self, p: Vec2) -> Real {
        self.field(p).length()
    }
}
