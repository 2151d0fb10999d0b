//! The constant field of an orthographic camera.
//!
//! This is our extension of the paper. It is the limit of a perspective camera that moves back along
//! its axis. Its focal length grows so that `f/z` tends to the pixels per unit. The strength of eq. 5
//! tends to a constant and the direction to the axis. Curl and gradient tend to zero, and the aspect
//! ratio tends to 1.

use super::scalar::{Real, Vec2, Vec3};

/// An orthographic camera: pixels per unit and the view rectangle in camera units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrthographicIntrinsics {
    /// Pixels per scene unit along x and y.
    pub pixels_per_unit: Vec2,
    /// Left and upper edges of the view rectangle, in scene units.
    pub min: Vec2,
    /// Right and lower edges of the view rectangle; greater than `min`.
    pub max: Vec2,
}

impl OrthographicIntrinsics {
    /// Returns `true` if `p` is inside the view rectangle. Depth does not matter; NaN is outside.
    #[inline]
    pub fn contains(&self, p: Vec3) -> bool {
        p.x >= self.min.x && p.x <= self.max.x && p.y >= self.min.y && p.y <= self.max.y
    }

    /// The constant field, which points against the axis. Zero outside the view rectangle.
    #[inline]
    pub fn field(&self, p: Vec3) -> Vec3 {
        Vec3::new(0.0, 0.0, -self.strength(p))
    }

    /// Samples per unit area perpendicular to the axis; zero outside the view rectangle.
    #[inline]
    pub fn strength(&self, p: Vec3) -> Real {
        if self.contains(p) {
            self.pixels_per_unit.element_product()
        } else {
            0.0
        }
    }
}
