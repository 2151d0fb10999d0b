//! The place of a group's sphere in a view, and the bounds of secant and depth in its visible part. The bounds are the
//! same as in `camera_field`.

use camera_field::Camera;
use glam::{Vec2, Vec3};

use crate::lanes::larger;

/// Rounding of a few operations, relative, as in `camera_field`'s bounds.
pub(super) const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// The sphere of a group in camera space.
#[derive(Clone, Copy)]
pub(super) struct SeenSphere {
    pub(super) center: Vec3,
    pub(super) radius: f32,
    pub(super) distance_squared: f32,
    pub(super) distance: f32,
}

impl SeenSphere {
    /// Whether the sphere has an infinite coordinate, NaN or a negative radius.
    #[inline(always)]
    pub(super) fn is_unusable(&self) -> bool {
        let Vec3 { x, y, z } = self.center;
        let is_finite = |coordinate: f32| coordinate.abs() < f32::INFINITY;
        !(is_finite(x) & is_finite(y) & is_finite(z) & (self.radius >= 0.0))
    }
}

/// The place of a sphere in a view; the bounds are valid if neither flag is set.
#[derive(Clone, Copy)]
pub(super) struct SeenExtent {
    pub(super) is_outside: bool,
    /// The sphere holds the camera, or its numbers are not usable.
    pub(super) is_unbounded: bool,
    /// Greatest `1 / cos φ` in the visible part of the sphere.
    pub(super) secant: f32,
    /// Least depth in the visible part of the sphere.
    pub(super) depth: f32,
}

impl SeenExtent {
    /// The extent of `camera_field`, for a given greatest secant of the view.
    #[inline(always)]
    pub(super) fn new(seen: &SeenSphere, is_outside: bool, corner: f32) -> Self {
        let (center, radius, distance) = (seen.center, seen.radius, seen.distance);
        let gap = distance * (1.0 - ROUNDING) - radius;
        // The square of a large distance overflows to infinity.
        let is_apart = (gap > 0.0) & (seen.distance_squared < f32::INFINITY);
        let off_axis = (center.x * center.x + center.y * center.y).sqrt();
        let tangent_length = (gap * (distance + radius)).sqrt();
        // cos(φ + δ) ρ², expanded.
        let scaled_cosine = center.z * tangent_length - off_axis * radius;
        let cosine = scaled_cosine / seen.distance_squared - ROUNDING;
        let is_narrower = cosine * corner > 1.0;
        let secant = if is_narrower { 1.0 / cosine } else { corner };
        Self {
            is_outside,
            is_unbounded: seen.is_unusable() | (!is_apart & !is_outside),
            secant,
            depth: larger(center.z - radius, gap / secant),
        }
    }
}

/// The image of a camera.
#[derive(Clone, Copy)]
pub(super) struct Lens {
    /// Sides of the image: slopes, or lengths of an orthographic camera.
    min: Vec2,
    max: Vec2,
    /// Secant of the image's widest corner.
    pub(super) corner: f32,
}

impl Lens {
    pub(super) fn new(camera: &Camera) -> Self {
        let (min, max) = match camera {
            Camera::Perspective(camera) => (camera.slope_min, camera.slope_max),
            Camera::Orthographic(camera) => (camera.min, camera.max),
        };
        let corner = corner_secant(camera);
        Self { min, max, corner }
    }

    /// Whether a sphere does not touch the field of view, as in `camera_field`.
    #[inline(always)]
    pub(super) fn is_outside(&self, is_perspective: bool, seen: &SeenSphere) -> bool {
        let is_beyond = if is_perspective {
            self.is_beyond_slopes(seen)
        } else {
            self.is_beyond_edges(seen)
        };
        is_beyond & !seen.is_unusable()
    }

    #[inline(always)]
    fn is_beyond_slopes(&self, &SeenSphere { center, radius, .. }: &SeenSphere) -> bool {
        // Comparing squares saves a square root.
        let beyond = |across: f32, slope: f32| {
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
}

/// Secant of the image's widest corner; 1 for an orthographic camera.
pub(crate) fn corner_secant(camera: &Camera) -> f32 {
    match camera {
        Camera::Perspective(camera) => camera.max_secant(),
        Camera::Orthographic(_) => 1.0,
    }
}
