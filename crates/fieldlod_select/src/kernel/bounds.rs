//! `camera_field`'s bounds over eight spheres at once.

use camera_field::{Camera, Intrinsics, OrthographicIntrinsics};
use wide::f32x8;

use super::lanes::{INFINITE, ONE, V3, ZERO, splat};
use crate::criterion::{FLATNESS_FLOOR, SILHOUETTE_WEIGHT, VISIBLE_WEIGHT};

/// As in `camera_field`'s bounds.
pub(super) const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Eight groups in camera space.
pub(super) struct Seen {
    pub(super) center: V3,
    pub(super) radius: f32x8,
    pub(super) distance_squared: f32x8,
    pub(super) distance: f32x8,
}

/// How eight spheres lie to the edge of a view.
pub(super) struct Edge {
    pub(super) outside: f32x8,
    /// Secant of the widest corner.
    pub(super) corner: f32x8,
}

impl Edge {
    #[inline]
    pub(super) fn new(camera: &Camera, corner: f32, seen: &Seen) -> Self {
        let beyond = match camera {
            Camera::Perspective(camera) => beyond_sides(camera, seen),
            Camera::Orthographic(camera) => beyond_edges(camera, seen),
        };
        Self {
            outside: beyond & !unusable(seen),
            corner: splat(corner),
        }
    }

    /// For groups that leave another view than they enter; `was_refined` has their bits. Nothing
    /// leaves where it enters.
    #[inline]
    pub(super) fn or_kept(self, was_refined: u32, leaving: &Self) -> Self {
        let was_refined = mask_of(was_refined);
        Self {
            outside: leaving.outside | (self.outside & !was_refined),
            corner: was_refined.bitselect(leaving.corner, self.corner),
        }
    }
}

/// The lanes whose bits are set.
fn mask_of(bits: u32) -> f32x8 {
    let lane = |index: usize| f32::from_bits(0u32.wrapping_sub(bits >> index & 1));
    f32x8::from(std::array::from_fn(lane))
}

/// What the view knows of eight spheres: masks, and bounds where neither is set.
pub(super) struct Extent {
    pub(super) outside: f32x8,
    pub(super) unbounded: f32x8,
    pub(super) secant: f32x8,
    pub(super) depth: f32x8,
}

impl Extent {
    #[inline]
    pub(super) fn new(seen: &Seen, edge: &Edge) -> Self {
        let Seen {
            center,
            radius,
            distance_squared,
            distance,
        } = *seen;
        let gap = distance * splat(1.0 - ROUNDING) - radius;
        let apart = gap.simd_gt(ZERO) & distance_squared.simd_lt(INFINITE);
        let off_axis = (center.x * center.x + center.y * center.y).sqrt();
        let tangent_length = (gap * (distance + radius)).sqrt();
        let cosine =
            (center.z * tangent_length - off_axis * radius) / distance_squared - splat(ROUNDING);
        let (outside, corner) = (edge.outside, edge.corner);
        let secant = (cosine * corner)
            .simd_gt(ONE)
            .bitselect(ONE / cosine, corner);
        let (ahead, around) = (center.z - radius, gap / secant);
        Self {
            outside,
            unbounded: unusable(seen) | (!apart & !outside),
            secant,
            depth: ahead.simd_gt(around).bitselect(ahead, around),
        }
    }

    /// Where the field is constant, its bounds hold nothing of the sphere.
    #[inline]
    pub(super) fn constant(seen: &Seen, edge: &Edge) -> Self {
        Self {
            outside: edge.outside,
            unbounded: unusable(seen),
            secant: ONE,
            depth: ONE,
        }
    }

    /// Zero outside, infinite where unbounded or not a finite number.
    #[inline]
    pub(super) fn or_infinity(&self, bound: f32x8) -> f32x8 {
        let usable = bound.simd_ge(ZERO) & bound.simd_lt(INFINITE);
        let bound = usable.bitselect(bound, INFINITE);
        let bound = self.outside.bitselect(ZERO, bound);
        self.unbounded.bitselect(INFINITE, bound)
    }
}

/// Where a sphere's numbers are not usable at all.
#[inline]
pub(super) fn unusable(seen: &Seen) -> f32x8 {
    let V3 { x, y, z } = seen.center;
    let finite = x.abs().simd_lt(INFINITE) & y.abs().simd_lt(INFINITE) & z.abs().simd_lt(INFINITE);
    !(finite & seen.radius.simd_ge(ZERO))
}

#[inline]
pub(super) fn beyond_sides(camera: &Intrinsics, seen: &Seen) -> f32x8 {
    let Seen { center, radius, .. } = *seen;
    center.z.simd_lt(-radius)
        | beyond_side(center.x, camera.slope_min.x, center.z, radius)
        | beyond_side(-center.x, -camera.slope_max.x, center.z, radius)
        | beyond_side(center.y, camera.slope_min.y, center.z, radius)
        | beyond_side(-center.y, -camera.slope_max.y, center.z, radius)
}

#[inline]
pub(super) fn beyond_edges(camera: &OrthographicIntrinsics, seen: &Seen) -> f32x8 {
    let Seen { center, radius, .. } = *seen;
    (center.x + radius).simd_lt(splat(camera.min.x))
        | (center.x - radius).simd_gt(splat(camera.max.x))
        | (center.y + radius).simd_lt(splat(camera.min.y))
        | (center.y - radius).simd_gt(splat(camera.max.y))
}

#[inline]
pub(super) fn beyond_side(across: f32x8, slope: f32, z: f32x8, radius: f32x8) -> f32x8 {
    let edge = splat(slope) * z;
    let inside_by = across - edge + splat(ROUNDING) * (across.abs() + edge.abs());
    inside_by.simd_lt(ZERO)
        & (inside_by * inside_by).simd_gt(radius * radius * splat(1.0 + slope * slope))
}

#[inline]
pub(super) fn picture_weight(facing: f32x8, variance: f32x8) -> f32x8 {
    let facing_squared = facing * facing;
    let visible = splat(0.5 * VISIBLE_WEIGHT) * (facing + (facing_squared + variance).sqrt());
    let u = facing_squared / (splat(2.0) * variance + splat(FLATNESS_FLOOR));
    let silhouette = ONE / (ONE + u + splat(0.5) * u * u);
    visible.simd_gt(ZERO).bitselect(visible, ZERO) + splat(SILHOUETTE_WEIGHT) * silhouette
}
