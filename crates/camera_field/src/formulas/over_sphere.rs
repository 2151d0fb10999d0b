//! The field over a sphere: upper bounds for level-of-detail selection, and how much it changes.
//!
//! The bounds hold over the part of the sphere that can be inside the field of view.
//! With `sin δ = r/ρ` for a sphere of radius `r` at distance `ρ`, angle `φ` off the axis:
//!
//! ```text
//! sec   = 1 / cos(φ + δ), at most the secant of the widest image corner
//! z_min = max(z − r, (ρ − r) / sec)
//! c           ≤ C sec / z_min²
//! pixel scale ≤ max(f_x, f_y) sec / z_min
//! z/ρ         ≤ cos(φ − δ), or 1 if the sphere meets the axis                   aspect ratio, §3.4
//! κ           = r √(4 z² + 9 (x² + y²)) / (ρ z)                                 relative change of c by its gradient (14)
//! ```
//!
//! Each factor of the bounds grows when the sphere grows, so the products are monotone under inclusion of spheres, up to
//! rounding. Only `+ − × ÷ √` and comparisons are used, so that the same inputs give the same bits on every machine.
//! Nothing branches, so that compilers turn loops over spheres into vector instructions.
//!
//! Lengths from 1e-18 to 1e18 units are supported. Squares of longer lengths overflow; squares of
//! shorter lengths lose precision. Bounds may then be infinite or too small.

use super::camera::Camera;
use super::scalar::{Real, Vec2, Vec3};

/// Relative rounding error of a few operations. It is subtracted from lower bounds and added to
/// upper bounds, so that rounding cannot violate them.
const ROUNDING: Real = 8.0 * Real::EPSILON;
/// Rounding error of an aspect ratio.
const ASPECT_ROUNDING: Real = 1e-6;

/// A sphere in camera space, with its distance from the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenSphere {
    /// Centre, in scene units.
    pub center: Vec3,
    /// Radius, in scene units.
    pub radius: Real,
    /// Square of [`distance`](Self::distance).
    pub distance_squared: Real,
    /// Distance of the centre from the camera.
    pub distance: Real,
}

impl SeenSphere {
    /// The sphere with this centre and radius.
    #[inline(always)]
    pub fn new(center: Vec3, radius: Real) -> Self {
        let distance_squared = center.dot(center);
        Self {
            center,
            radius,
            distance_squared,
            distance: distance_squared.sqrt(),
        }
    }

    /// Whether the sphere has an infinite coordinate, NaN or a negative radius.
    #[inline(always)]
    pub fn is_unusable(&self) -> bool {
        let Vec3 { x, y, z } = self.center;
        let is_finite = |coordinate: Real| coordinate.abs() < Real::INFINITY;
        !(is_finite(x) & is_finite(y) & is_finite(z) & (self.radius >= 0.0))
    }

    /// Distance of the centre from the optical axis.
    #[inline(always)]
    fn off_axis(&self) -> Real {
        (self.center.x * self.center.x + self.center.y * self.center.y).sqrt()
    }
}

/// The field of view of a camera, and the scale of its field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOfView {
    /// Whether the camera is a pinhole camera. The field of an orthographic camera is constant.
    pub is_perspective: bool,
    /// Pixels per scene unit along both axes; of a pinhole camera, at unit depth: its focal lengths.
    pub px_per_unit: Vec2,
    /// Largest `1 / cos φ`, that of the image's widest corner; 1 for an orthographic camera.
    pub corner_secant: Real,
    /// Left and upper sides of the image: slopes, or lengths of an orthographic camera.
    pub min: Vec2,
    /// Right and lower sides of the image.
    pub max: Vec2,
}

/// The field over the part of a sphere that is in the field of view. Secant and depth are valid if neither flag is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOverSphere {
    /// The sphere does not touch the field of view.
    pub is_outside: bool,
    /// The sphere holds the camera, or its numbers are not usable.
    pub is_unbounded: bool,
    /// Greatest `1 / cos φ`.
    pub secant: Real,
    /// Least depth `z`.
    pub depth: Real,
}

impl FieldOverSphere {
    /// `in_view`, or `outside` if the sphere is outside the view; infinite if the sphere is unbounded, or if the value
    /// is not finite or negative. Never NaN.
    #[inline(always)]
    pub fn bound(&self, in_view: Real, outside: Real) -> Real {
        let value = if self.is_outside { outside } else { in_view };
        let is_known = self.is_outside | !self.is_unbounded;
        let is_length = is_known & (0.0..Real::INFINITY).contains(&value);
        if is_length { value } else { Real::INFINITY }
    }
}

impl FieldOfView {
    /// The field of view of a camera.
    #[inline]
    pub fn of(camera: &Camera) -> Self {
        match camera {
            Camera::Perspective(camera) => Self {
                is_perspective: true,
                px_per_unit: camera.focal_px,
                corner_secant: camera.max_secant(),
                min: camera.slope_min,
                max: camera.slope_max,
            },
            Camera::Orthographic(camera) => Self {
                is_perspective: false,
                px_per_unit: camera.pixels_per_unit,
                corner_secant: 1.0,
                min: camera.min,
                max: camera.max,
            },
        }
    }

    /// Whether a sphere does not touch the field of view.
    ///
    /// The test uses the four side planes and the plane `z = 0`, without a far plane. It is
    /// conservative: never true for a sphere that reaches into the view, but sometimes false for a
    /// sphere beside an edge of the frustum. A NaN is never outside.
    #[inline(always)]
    pub fn excludes(&self, sphere: &SeenSphere) -> bool {
        let is_beyond = if self.is_perspective {
            self.is_beyond_slopes(sphere)
        } else {
            self.is_beyond_edges(sphere)
        };
        is_beyond & !sphere.is_unusable()
    }

    #[inline(always)]
    fn is_beyond_slopes(&self, &SeenSphere { center, radius, .. }: &SeenSphere) -> bool {
        // Comparing squares saves the root and the division of a unit normal.
        let beyond = |across: Real, slope: Real| {
            // Rounding is added, so that a sphere that touches the plane counts as visible.
            let edge = slope * center.z;
            let inside_by = across - edge + ROUNDING * (across.abs() + edge.abs());
            let allowed = radius * radius * (1.0 + slope * slope);
            (inside_by < 0.0) & (allowed < inside_by * inside_by)
        };
        (center.z < -radius)
            | beyond(center.x, self.min.x)
            | beyond(-center.x, -self.max.x)
            | beyond(center.y, self.min.y)
            | beyond(-center.y, -self.max.y)
    }

    #[inline(always)]
    fn is_beyond_edges(&self, &SeenSphere { center, radius, .. }: &SeenSphere) -> bool {
        (center.x + radius < self.min.x)
            | (self.max.x < center.x - radius)
            | (center.y + radius < self.min.y)
            | (self.max.y < center.y - radius)
    }

    /// The field over a sphere. `is_outside` tells whether this view [excludes](Self::excludes) it.
    #[inline(always)]
    pub fn over_sphere(&self, sphere: &SeenSphere, is_outside: bool) -> FieldOverSphere {
        let corner = self.corner_secant;
        let &SeenSphere {
            center,
            radius,
            distance,
            distance_squared,
        } = sphere;
        let gap = distance * (1.0 - ROUNDING) - radius;
        // False for NaN. The square of a large distance overflows to infinity, and the distance is lost.
        let is_apart = (gap > 0.0) & (distance_squared < Real::INFINITY);
        // `√(ρ² − r²)`, without the difference of squares, which loses precision near the sphere.
        let tangent_length = (gap * (distance + radius)).sqrt();
        // cos(φ + δ) ρ², expanded.
        let scaled_cosine = center.z * tangent_length - sphere.off_axis() * radius;
        let cosine = scaled_cosine / distance_squared - ROUNDING;
        // The largest secant is that of the sphere's edge or of the image's corner, the smaller of both.
        let is_narrower = cosine * corner > 1.0;
        let secant = if is_narrower { 1.0 / cosine } else { corner };
        // Two lower bounds of the depth: the front of the sphere, and the smallest distance at the largest secant.
        let (front, edge) = (center.z - radius, gap / secant);
        let depth = if edge < front { front } else { edge };
        if self.is_perspective {
            return FieldOverSphere {
                is_outside,
                is_unbounded: sphere.is_unusable() | (!is_apart & !is_outside),
                secant,
                depth,
            };
        }
        FieldOverSphere {
            is_outside,
            is_unbounded: sphere.is_unusable(),
            // The field is constant, so that its bounds do not depend on the sphere.
            secant: 1.0,
            depth: 1.0,
        }
    }

    /// Upper bound of the strength (eq. 5) where the field is `over` a sphere. Not usable unless the sphere is in the
    /// view and bounded.
    #[inline(always)]
    pub fn strength(&self, over: &FieldOverSphere) -> Real {
        let constant = self.constant();
        let bound = constant * over.secant / (over.depth * over.depth) * (1.0 + ROUNDING);
        if self.is_perspective { bound } else { constant }
    }

    /// Upper bound of pixels per unit of displacement across the sight ray, `√(c / cos φ)`. Not usable unless the
    /// sphere is in the view and bounded.
    #[inline(always)]
    pub fn pixel_scale(&self, over: &FieldOverSphere) -> Real {
        // For oblong pixels, the larger focal length gives an upper bound.
        let px_per_unit = self.px_per_unit.max_element();
        let bound = px_per_unit * over.secant / over.depth * (1.0 + ROUNDING);
        if self.is_perspective {
            bound
        } else {
            px_per_unit
        }
    }

    /// The strength at the centre of a sphere (eq. 5) instead of its bound, if the field changes by less than the factor
    /// `max_change` over the sphere: `κ < max_change`. `bound` is the strength over the sphere.
    ///
    /// The paper proposes the curl as a criterion (§4.2.2). The curl is the change across the sight rays; the gradient
    /// (eq. 14) holds the curl and the change along them.
    #[inline(always)]
    pub fn sampled_where_flat(
        &self,
        sphere: &SeenSphere,
        over: &FieldOverSphere,
        max_change: Real,
        bound: Real,
    ) -> Real {
        let &SeenSphere {
            center,
            radius,
            distance,
            ..
        } = sphere;
        // κ < max_change, without dividing by depth.
        let z_squared = center.z * center.z;
        let off_axis_squared = center.x * center.x + center.y * center.y;
        let change = radius * radius * (4.0 * z_squared + 9.0 * off_axis_squared);
        let allowed = max_change * max_change * (distance * distance) * z_squared;
        let is_flat = (center.z > 0.0) & (change < allowed);
        let sample = self.constant() * distance / (center.z * center.z * center.z);
        // Values outside the view and infinity stay as they are. The centre may be outside the image.
        let is_visible = !(over.is_outside | over.is_unbounded);
        let is_sampled = is_flat & is_visible & (sample < bound);
        if is_sampled { sample } else { bound }
    }

    /// Upper bound of the aspect ratio of the sampling pattern (§3.4) over the visible part of a sphere, for square
    /// pixels. It is at least the ratio in the widest corner.
    #[inline(always)]
    pub fn aspect_ratio(&self, sphere: &SeenSphere) -> Real {
        let &SeenSphere {
            center,
            radius,
            distance,
            ..
        } = sphere;
        // cos(φ − δ).
        let off_axis = sphere.off_axis();
        let tangent_length = ((distance - radius) * (distance + radius)).sqrt();
        let cosine = (center.z * tangent_length + off_axis * radius) / (distance * distance);
        let (rounded, of_corner) = (cosine + ASPECT_ROUNDING, 1.0 / self.corner_secant);
        let widest = if of_corner < rounded {
            rounded
        } else {
            of_corner
        };
        let meets_axis = (off_axis <= radius) | !self.is_perspective;
        if meets_axis { 1.0 } else { widest }
    }

    /// `C`, samples per unit area at unit depth.
    #[inline(always)]
    fn constant(&self) -> Real {
        self.px_per_unit.x * self.px_per_unit.y
    }
}

impl Camera {
    /// Whether a sphere can touch the field of view; see [`FieldOfView::excludes`].
    #[inline]
    pub fn touches_sphere(&self, center: Vec3, radius: Real) -> bool {
        !FieldOfView::of(self).excludes(&SeenSphere::new(center, radius))
    }

    /// Upper bound of the strength (eq. 5) over the visible part of a sphere: 0 outside the field of view, and infinite
    /// if the sphere contains the camera or is not usable (NaN, infinite, negative radius).
    #[inline]
    pub fn strength_over_sphere(&self, center: Vec3, radius: Real) -> Real {
        let (view, over) = self.over_sphere(center, radius);
        over.bound(view.strength(&over), 0.0)
    }

    /// Upper bound of the pixels per unit of displacement across the sight rays, `√(c / cos φ)`, over the visible part of
    /// a sphere; 0 and infinite as in [`strength_over_sphere`](Self::strength_over_sphere).
    #[inline]
    pub fn pixel_scale_over_sphere(&self, center: Vec3, radius: Real) -> Real {
        let (view, over) = self.over_sphere(center, radius);
        over.bound(view.pixel_scale(&over), 0.0)
    }

    #[inline]
    fn over_sphere(&self, center: Vec3, radius: Real) -> (FieldOfView, FieldOverSphere) {
        let view = FieldOfView::of(self);
        let sphere = SeenSphere::new(center, radius);
        (view, view.over_sphere(&sphere, view.excludes(&sphere)))
    }
}
