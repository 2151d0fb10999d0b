//! The constant field of an orthographic camera.
//!
//! This is our extension of the paper. It is the limit of a perspective camera that moves back along
//! its axis. Its focal length grows so that `f/z` tends to the pixels per unit. The strength of eq. 5
//! tends to a constant and the direction to the axis. Curl and gradient tend to zero, and the aspect
//! ratio tends to 1.

use super::bounds::SphereBound;
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

    /// Returns `true` if a sphere can touch the view rectangle. Never false for a sphere that does.
    /// NaN is never outside.
    #[inline]
    pub fn touches_sphere(&self, center: Vec3, radius: Real) -> bool {
        // With the negation, a comparison with NaN counts as inside.
        let outside = center.x + radius < self.min.x
            || center.x - radius > self.max.x
            || center.y + radius < self.min.y
            || center.y - radius > self.max.y;
        !outside
    }

    /// Upper bound of the strength over the visible part of a sphere.
    #[inline]
    pub fn strength_over_sphere(&self, center: Vec3, radius: Real) -> SphereBound {
        let density = self.pixels_per_unit.element_product();
        self.constant_over_sphere(density, center, radius)
    }

    /// Upper bound of the pixels per unit of displacement over a sphere.
    #[inline]
    pub fn pixel_scale_over_sphere(&self, center: Vec3, radius: Real) -> SphereBound {
        let greatest = self.pixels_per_unit.x.max(self.pixels_per_unit.y);
        self.constant_over_sphere(greatest, center, radius)
    }

    #[inline]
    fn constant_over_sphere(&self, value: Real, center: Vec3, radius: Real) -> SphereBound {
        if !(center.is_finite() && radius >= 0.0) {
            SphereBound::Unbounded
        } else if self.touches_sphere(center, radius) {
            SphereBound::from_value(value)
        } else {
            SphereBound::Bounded(0.0)
        }
    }
}
