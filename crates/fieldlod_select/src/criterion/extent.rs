//! The place of a group's sphere in a view, and the bounds of secant and depth in its visible part. The bounds are the
//! same as in `camera_field`, for one sphere or for eight.

use camera_field::{Camera, Intrinsics, OrthographicIntrinsics};

use crate::lanes::{Lane, V3};

/// Rounding of a few operations, relative, as in `camera_field`'s bounds.
pub(super) const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// The sphere of a group in camera space.
pub(super) struct SeenSphere<L> {
    pub(super) center: V3<L>,
    pub(super) radius: L,
    /// The radius for bounds: larger or smaller by the distance that a group may move.
    pub(super) reach: L,
    pub(super) distance_squared: L,
    pub(super) distance: L,
}

impl<L: Lane> SeenSphere<L> {
    /// The distance of the center after a group has moved: the least distance for the largest errors, or the greatest
    /// distance for the least errors.
    #[inline]
    pub(super) fn reached_distance(&self) -> L {
        self.distance - (self.reach - self.radius)
    }
}

/// The place of a sphere in a view; the bounds are valid if neither mask is set.
pub(super) struct SeenExtent<L: Lane> {
    pub(super) outside: L::Mask,
    /// The sphere holds the camera, or its numbers are not usable.
    pub(super) unbounded: L::Mask,
    /// Greatest `1 / cos φ` in the visible part of the sphere.
    pub(super) secant: L,
    /// Least depth in the visible part of the sphere.
    pub(super) depth: L,
}

impl<L: Lane> SeenExtent<L> {
    /// The extent of `camera_field`, for a given greatest secant of the view.
    #[inline]
    pub(super) fn new(seen: &SeenSphere<L>, outside: L::Mask, corner: L) -> Self {
        let SeenSphere {
            center,
            reach,
            distance_squared,
            distance,
            ..
        } = *seen;
        let gap = distance * L::splat(1.0 - ROUNDING) - reach;
        // The square of a large distance overflows to infinity.
        let is_apart = L::zero().is_below(gap) & distance_squared.is_below(L::infinity());
        let off_axis = (center.x * center.x + center.y * center.y).sqrt();
        let tangent_length = (gap * (distance + reach)).sqrt();
        // cos(φ + δ) ρ², expanded.
        let cosine =
            (center.z * tangent_length - off_axis * reach) / distance_squared - L::splat(ROUNDING);
        let is_narrower = L::one().is_below(cosine * corner);
        let secant = L::choose(is_narrower, L::one() / cosine, corner);
        // A negative reach may be longer than the distance to the axis.
        let secant = L::choose(off_axis.is_below(-reach), L::one(), secant);
        Self {
            outside,
            unbounded: is_unusable(seen) | (!is_apart & !outside),
            secant,
            depth: (center.z - reach).larger(gap / secant),
        }
    }
}

/// Secant of the image's widest corner; 1 for an orthographic camera.
pub(crate) fn corner_secant(camera: &Camera) -> f32 {
    match camera {
        Camera::Perspective(camera) => camera.max_secant(),
        Camera::Orthographic(_) => 1.0,
    }
}

/// Whether a sphere has an infinite coordinate, NaN or a negative radius.
#[inline]
pub(super) fn is_unusable<L: Lane>(seen: &SeenSphere<L>) -> L::Mask {
    let V3 { x, y, z } = seen.center;
    let is_finite = |coordinate: L| coordinate.abs().is_below(L::infinity());
    !(is_finite(x) & is_finite(y) & is_finite(z) & L::zero().is_at_most(seen.radius))
}

/// Whether a sphere does not touch the field of view, as in `camera_field`.
#[inline]
pub(super) fn outside<L: Lane>(camera: &Camera, seen: &SeenSphere<L>) -> L::Mask {
    let beyond = match camera {
        Camera::Perspective(camera) => beyond_slopes(camera, seen),
        Camera::Orthographic(camera) => beyond_edges(camera, seen),
    };
    beyond & !is_unusable(seen)
}

#[inline]
fn beyond_slopes<L: Lane>(camera: &Intrinsics, seen: &SeenSphere<L>) -> L::Mask {
    let SeenSphere { center, reach, .. } = *seen;
    let (min, max) = (camera.slope_min, camera.slope_max);
    // Squares in place of a plane's unit normal save a root.
    let beyond = |across: L, slope: f32| {
        let edge = L::splat(slope) * center.z;
        let inside_by = across - edge + L::splat(ROUNDING) * (across.abs() + edge.abs());
        let allowed = reach * reach * L::splat(1.0 + slope * slope);
        inside_by.is_below(L::zero()) & allowed.is_below(inside_by * inside_by)
    };
    center.z.is_below(-reach)
        | beyond(center.x, min.x)
        | beyond(-center.x, -max.x)
        | beyond(center.y, min.y)
        | beyond(-center.y, -max.y)
}

#[inline]
fn beyond_edges<L: Lane>(camera: &OrthographicIntrinsics, seen: &SeenSphere<L>) -> L::Mask {
    let SeenSphere { center, reach, .. } = *seen;
    let (min, max) = (camera.min, camera.max);
    (center.x + reach).is_below(L::splat(min.x))
        | L::splat(max.x).is_below(center.x - reach)
        | (center.y + reach).is_below(L::splat(min.y))
        | L::splat(max.y).is_below(center.y - reach)
}
