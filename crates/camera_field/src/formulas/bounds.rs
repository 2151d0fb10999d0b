//! Upper bounds of the field over a sphere, for level-of-detail selection.
//!
//! The bounds hold over the part of the sphere that can be inside the field of view.
//! With `sin δ = r/ρ` for a sphere of radius `r` at distance `ρ`, angle `φ` off the axis:
//!
//! ```text
//! sec   = 1 / cos(φ + δ), at most the secant of the widest image corner
//! z_min = max(z − r, (ρ − r) / sec)
//! c           ≤ C sec / z_min²
//! pixel scale ≤ max(f_x, f_y) sec / z_min
//! ```
//!
//! Each factor grows when the sphere grows, so the products are monotone under inclusion
//! of spheres, up to rounding. Only `+ − × ÷ √` and comparisons are used, so that the same
//! inputs give the same bits on every machine.
//!
//! Lengths from 1e-18 to 1e18 units are supported. Squares of longer lengths overflow; squares of
//! shorter lengths lose precision. Bounds may then be [`SphereBound::Unbounded`] or too small.

use super::intrinsics::Intrinsics;
use super::scalar::{Real, Vec3};

/// Relative rounding error of a few operations. It is subtracted from lower bounds and added to
/// upper bounds, so that rounding cannot violate them.
const ROUNDING: Real = 8.0 * Real::EPSILON;

/// An upper bound of a non-negative quantity over a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SphereBound {
    /// The quantity is at most this value, which is finite and not negative. Zero if the sphere is
    /// outside the field of view.
    Bounded(Real),
    /// There is no finite bound. The sphere contains the centre of projection, or its numbers are
    /// not usable (NaN, infinite, negative radius).
    Unbounded,
}

impl SphereBound {
    /// The value, or infinity for [`Unbounded`](Self::Unbounded). Never NaN.
    #[inline]
    pub const fn or_infinity(self) -> Real {
        match self {
            Self::Bounded(value) => value,
            Self::Unbounded => Real::INFINITY,
        }
    }

    /// Accepts finite values that are not negative; all others are unbounded.
    #[inline]
    pub(super) fn from_value(value: Real) -> Self {
        if (0.0..Real::INFINITY).contains(&value) {
            Self::Bounded(value)
        } else {
            Self::Unbounded
        }
    }
}

/// The part of a sphere that can be visible.
enum SphereExtent {
    /// The sphere does not touch the field of view.
    Outside,
    /// Bounds of secant and depth over the visible part of the sphere.
    Visible {
        /// Largest `1 / cos φ`.
        secant_max: Real,
        /// Smallest depth `z`; greater than zero.
        depth_min: Real,
    },
    /// The sphere contains the camera, or its numbers are not usable.
    Unbounded,
}

impl SphereExtent {
    /// Extent of the visible part of a sphere, given the largest secant in the field of view.
    #[inline]
    fn of_visible(center: Vec3, radius: Real, secant_corner: Real) -> Self {
        let rho_squared = center.length_squared();
        let rho = rho_squared.sqrt();
        let gap = rho * (1.0 - ROUNDING) - radius;
        // The comparison is also false for NaN. If the square is infinite, the distance is lost.
        if !(gap > 0.0 && rho_squared < Real::INFINITY) {
            return Self::Unbounded;
        }
        // The largest secant is that of the sphere's edge or of the image's corner, the smaller of both.
        let off_axis = (center.x * center.x + center.y * center.y).sqrt();
        // `√(ρ² − r²)`, without the difference of squares, which loses precision near the sphere.
        let tangent_length = (gap * (rho + radius)).sqrt();
        // cos(φ + δ), expanded.
        let cosine = (center.z * tangent_length - off_axis * radius) / rho_squared - ROUNDING;
        let secant_max = if cosine * secant_corner > 1.0 {
            1.0 / cosine
        } else {
            secant_corner
        };
        // Two lower bounds of the depth: the front of the sphere, and the smallest distance at the largest secant.
        let depth_min = (center.z - radius).max(gap / secant_max);
        Self::Visible {
            secant_max,
            depth_min,
        }
    }
}

impl Intrinsics {
    /// Returns `true` if a sphere can touch the field of view.
    ///
    /// The test uses the four side planes and the plane `z = 0`, without a far plane. It is
    /// conservative: never false for a sphere that reaches into the view, but sometimes true for a
    /// sphere beside an edge of the frustum. A NaN is never outside a plane.
    #[inline]
    pub fn touches_sphere(&self, center: Vec3, radius: Real) -> bool {
        let outside = center.z < -radius
            || beyond_side(center.x, self.slope_min.x, center.z, radius)
            || beyond_side(-center.x, -self.slope_max.x, center.z, radius)
            || beyond_side(center.y, self.slope_min.y, center.z, radius)
            || beyond_side(-center.y, -self.slope_max.y, center.z, radius);
        !outside
    }

    /// Upper bound of the strength (eq. 5) over the visible part of a sphere.
    #[inline]
    pub fn strength_over_sphere(&self, center: Vec3, radius: Real) -> SphereBound {
        let constant = self.constant_px2();
        let extent = self.sphere_extent(center, radius);
        extent.bound(|sec, z| constant * sec / (z * z))
    }

    /// Upper bound of [`Intrinsics::pixel_scale`] over the visible part of a sphere: pixels per
    /// unit of displacement perpendicular to the sight ray, `√(c / cos φ)`.
    #[inline]
    pub fn pixel_scale_over_sphere(&self, center: Vec3, radius: Real) -> SphereBound {
        // For oblong pixels, the larger focal length gives an upper bound.
        let focal = self.focal_px.x.max(self.focal_px.y);
        let extent = self.sphere_extent(center, radius);
        extent.bound(|sec, z| focal * sec / z)
    }

    #[inline]
    fn sphere_extent(&self, center: Vec3, radius: Real) -> SphereExtent {
        if !(center.is_finite() && radius >= 0.0) {
            SphereExtent::Unbounded
        } else if self.touches_sphere(center, radius) {
            SphereExtent::of_visible(center, radius, self.max_secant())
        } else {
            SphereExtent::Outside
        }
    }
}

impl SphereExtent {
    /// A bound that grows with the secant and falls with the depth.
    #[inline]
    fn bound(self, quantity: impl Fn(Real, Real) -> Real) -> SphereBound {
        match self {
            Self::Outside => SphereBound::Bounded(0.0),
            Self::Visible {
                secant_max,
                depth_min,
            } => SphereBound::from_value(quantity(secant_max, depth_min) * (1.0 + ROUNDING)),
            Self::Unbounded => SphereBound::Unbounded,
        }
    }
}

/// Returns `true` if a sphere is completely on the side `across < slope · z` of a plane through the camera.
/// Comparing squares saves the root and the division of a unit normal.
#[inline]
fn beyond_side(across: Real, slope: Real, z: Real, radius: Real) -> bool {
    // Rounding is added, so that a sphere that touches the plane counts as visible.
    let edge = slope * z;
    let inside_by = across - edge + ROUNDING * (across.abs() + edge.abs());
    inside_by < 0.0 && inside_by * inside_by > radius * radius * (1.0 + slope * slope)
}
