//! The criterion for eight groups at once, equal bit for bit to
//! [`promised_error_px`](crate::promised_error_px).
//!
//! Every line computes what the scalar code and `camera_field`'s bounds compute, in the same order,
//! with operations that IEEE 754 rounds exactly, so that lanes and scalars agree on every machine.

use camera_field::{Camera, Intrinsics, OrthographicIntrinsics};
use glam::{Mat3, Vec3};
use wide::f32x8;

use crate::criterion::{ASPECT_ROUNDING, FLATNESS_FLOOR, SILHOUETTE_WEIGHT};
use crate::stretch::{STRETCH_ROUNDING, SeenStretch};
use crate::table::GroupTable;
use crate::{InstanceView, LodSettings, Promise};

/// As in `camera_field`'s bounds.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
const INFINITE: f32x8 = splat(f32::INFINITY);
const ZERO: f32x8 = splat(0.0);
const ONE: f32x8 = splat(1.0);

const fn splat(value: f32) -> f32x8 {
    f32x8::new([value; 8])
}

#[derive(Clone, Copy)]
struct V3 {
    x: f32x8,
    y: f32x8,
    z: f32x8,
}

impl V3 {
    fn dot(self, other: Self) -> f32x8 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    fn splat(v: Vec3) -> Self {
        Self {
            x: splat(v.x),
            y: splat(v.y),
            z: splat(v.z),
        }
    }
}

#[derive(Clone, Copy)]
struct M3([V3; 3]);

impl M3 {
    fn splat(m: &Mat3) -> Self {
        Self([
            V3::splat(m.x_axis),
            V3::splat(m.y_axis),
            V3::splat(m.z_axis),
        ])
    }

    fn of(self, v: V3) -> V3 {
        let [a, b, c] = self.0;
        V3 {
            x: a.x * v.x + b.x * v.y + c.x * v.z,
            y: a.y * v.x + b.y * v.y + c.y * v.z,
            z: a.z * v.x + b.z * v.y + c.z * v.z,
        }
    }
}

/// One instance in one view under one set of settings.
pub(crate) struct Kernel<'a> {
    instance: &'a InstanceView,
    settings: &'a LodSettings,
    camera_from_local: M3,
    origin: V3,
    normal_map: M3,
}

/// Eight groups in camera space.
struct Seen {
    center: V3,
    radius: f32x8,
    distance_squared: f32x8,
    distance: f32x8,
}

/// What the view knows of eight spheres: masks, and bounds where neither is set.
struct Extent {
    outside: f32x8,
    unbounded: f32x8,
    secant: f32x8,
    depth: f32x8,
}

impl<'a> Kernel<'a> {
    pub(crate) fn new(instance: &'a InstanceView, settings: &'a LodSettings) -> Self {
        Self {
            instance,
            settings,
            camera_from_local: M3::splat(&instance.camera_from_local),
            origin: V3::splat(instance.origin_in_camera),
            normal_map: M3::splat(&instance.normal_in_camera_from_local),
        }
    }

    /// The promised error of the groups of one block. Terminal groups give that of no error.
    #[inline]
    pub(crate) fn error_px(&self, table: &GroupTable, block: usize) -> f32x8 {
        let seen = self.seen(table, block);
        match &self.instance.camera {
            Camera::Perspective(camera) => self.perspective_px(camera, &seen, table, block),
            Camera::Orthographic(camera) => self.orthographic_px(camera, &seen, table, block),
        }
    }

    #[inline]
    fn seen(&self, table: &GroupTable, block: usize) -> Seen {
        let local = V3 {
            x: table.x[block],
            y: table.y[block],
            z: table.z[block],
        };
        let turned = self.camera_from_local.of(local);
        let center = V3 {
            x: turned.x + self.origin.x,
            y: turned.y + self.origin.y,
            z: turned.z + self.origin.z,
        };
        let distance_squared = center.dot(center);
        Seen {
            center,
            radius: splat(self.instance.camera_per_local) * table.radius[block],
            distance_squared,
            distance: distance_squared.sqrt(),
        }
    }

    #[inline]
    fn perspective_px(
        &self,
        camera: &Intrinsics,
        seen: &Seen,
        table: &GroupTable,
        block: usize,
    ) -> f32x8 {
        let extent = extent(camera, seen);
        let strength = || {
            let constant = splat(camera.constant_px2());
            let bound = constant * extent.secant / (extent.depth * extent.depth);
            let bound = extent.or_infinity(bound * splat(1.0 + ROUNDING));
            self.sampled_where_flat(constant, seen, &extent, bound)
        };
        let pixel_scale = || {
            let focal = splat(camera.focal_px.x.max(camera.focal_px.y));
            extent.or_infinity(focal * extent.secant / extent.depth * splat(1.0 + ROUNDING))
        };
        let stretch = match &self.instance.seen_stretch {
            None => splat(self.instance.camera_per_local),
            Some(stretch) => self.stretch_seen(stretch, seen),
        };
        let relaxation = self.relaxation(camera, seen);
        self.promised(
            table,
            block,
            strength,
            pixel_scale,
            stretch,
            relaxation,
            seen,
        )
    }

    #[inline]
    fn orthographic_px(
        &self,
        camera: &OrthographicIntrinsics,
        seen: &Seen,
        table: &GroupTable,
        block: usize,
    ) -> f32x8 {
        let Seen { center, radius, .. } = *seen;
        let outside = (center.x + radius).simd_lt(splat(camera.min.x))
            | (center.x - radius).simd_gt(splat(camera.max.x))
            | (center.y + radius).simd_lt(splat(camera.min.y))
            | (center.y - radius).simd_gt(splat(camera.max.y));
        let extent = Extent {
            outside,
            unbounded: unusable(seen),
            secant: ONE,
            depth: ONE,
        };
        let pixels = camera.pixels_per_unit;
        let strength = || extent.or_infinity(splat(pixels.x * pixels.y));
        let pixel_scale = || extent.or_infinity(splat(pixels.x.max(pixels.y)));
        let most = self.instance.camera_per_local;
        let stretch = self.instance.seen_stretch.map_or(most, |stretch| {
            let seen = stretch.across(Vec3::Z);
            if seen < most { seen } else { most }
        });
        self.promised(
            table,
            block,
            strength,
            pixel_scale,
            splat(stretch),
            ONE,
            seen,
        )
    }

    #[inline]
    fn promised(
        &self,
        table: &GroupTable,
        block: usize,
        strength: impl Fn() -> f32x8,
        pixel_scale: impl Fn() -> f32x8,
        stretch: f32x8,
        relaxation: f32x8,
        seen: &Seen,
    ) -> f32x8 {
        let quality = || {
            let strength = strength();
            let weight = picture_weight(
                self.facing(seen, table, block),
                table.normal_variance[block],
            );
            let error = table.error[block] * stretch;
            let quality = error * (strength * weight).sqrt() * relaxation;
            strength.simd_ge(INFINITE).bitselect(INFINITE, quality)
        };
        let displacement = || {
            let scale = pixel_scale();
            let displacement = table.deviation[block] * stretch * scale * relaxation;
            scale.simd_ge(INFINITE).bitselect(INFINITE, displacement)
        };
        match self.settings.promise {
            Promise::Quality => quality(),
            Promise::Guaranteed => displacement(),
            Promise::Both { cap_px } => {
                let (a, b) = (
                    quality(),
                    displacement() * splat(self.settings.error_px / cap_px),
                );
                (a.simd_gt(b) | a.simd_ne(a)).bitselect(a, b)
            }
        }
    }

    #[inline]
    fn facing(&self, seen: &Seen, table: &GroupTable, block: usize) -> f32x8 {
        let normal = V3 {
            x: table.normal[0][block],
            y: table.normal[1][block],
            z: table.normal[2][block],
        };
        let turned = self.normal_map.of(normal);
        let (along, distance) = match self.instance.camera {
            Camera::Perspective(_) => (seen.center, seen.distance),
            Camera::Orthographic(_) => (V3::splat(Vec3::Z), ONE),
        };
        let away = turned.dot(along);
        if self.instance.seen_stretch.is_none() {
            return -away / distance;
        }
        let length = turned.dot(turned).sqrt();
        let facing = -away * table.normal_length[block] / (length * distance);
        length.simd_gt(ZERO).bitselect(facing, ZERO)
    }

    #[inline]
    fn stretch_seen(&self, stretch: &SeenStretch, seen: &Seen) -> f32x8 {
        let most = splat(self.instance.camera_per_local);
        let inverse = ONE / seen.distance;
        let along = V3 {
            x: seen.center.x * inverse,
            y: seen.center.y * inverse,
            z: seen.center.z * inverse,
        };
        let whole_trace = splat(stretch.trace);
        let trace = whole_trace - along.dot(M3::splat(&stretch.gram).of(along));
        let determinant = along.dot(M3::splat(&stretch.adjugate).of(along));
        let discriminant = trace * trace - splat(4.0) * determinant;
        let discriminant = discriminant.simd_gt(ZERO).bitselect(discriminant, ZERO);
        let eigenvalue =
            splat(0.5) * (trace + discriminant.sqrt()) + splat(STRETCH_ROUNDING * stretch.trace);
        let across = eigenvalue.sqrt() + most * (seen.radius / seen.distance);
        across.simd_lt(most).bitselect(across, most)
    }

    #[inline]
    fn sampled_where_flat(
        &self,
        constant: f32x8,
        seen: &Seen,
        extent: &Extent,
        bound: f32x8,
    ) -> f32x8 {
        let max_curl = self.settings.max_curl;
        if max_curl == 0.0 {
            return bound;
        }
        let Seen {
            center,
            radius,
            distance,
            ..
        } = *seen;
        let z_squared = center.z * center.z;
        let off_axis_squared = center.x * center.x + center.y * center.y;
        let change = radius * radius * (splat(4.0) * z_squared + splat(9.0) * off_axis_squared);
        let allowed = splat(max_curl * max_curl) * (distance * distance) * z_squared;
        let flat = center.z.simd_gt(ZERO) & change.simd_lt(allowed);
        let sample = constant * distance / (center.z * center.z * center.z);
        // Zero outside and infinite where unbounded stay as they are.
        let visible = !(extent.outside | extent.unbounded);
        (flat & visible & sample.simd_lt(bound)).bitselect(sample, bound)
    }

    #[inline]
    fn relaxation(&self, camera: &Intrinsics, seen: &Seen) -> f32x8 {
        let min_aspect_ratio = self.settings.min_aspect_ratio;
        if min_aspect_ratio.is_nan() || min_aspect_ratio <= 0.0 {
            return ONE;
        }
        let Seen {
            center,
            radius,
            distance,
            ..
        } = *seen;
        let off_axis = (center.x * center.x + center.y * center.y).sqrt();
        let tangent_length = ((distance - radius) * (distance + radius)).sqrt();
        let cosine = (center.z * tangent_length + off_axis * radius) / (distance * distance);
        let least = splat(1.0 / camera.max_secant());
        let widest = cosine + splat(ASPECT_ROUNDING);
        let widest = widest.simd_gt(least).bitselect(widest, least);
        let aspect = off_axis.simd_le(radius).bitselect(ONE, widest);
        let limit = splat(min_aspect_ratio);
        aspect.simd_lt(limit).bitselect(aspect / limit, ONE)
    }
}

impl Extent {
    /// Zero outside, infinite where unbounded or not a finite number.
    #[inline]
    fn or_infinity(&self, bound: f32x8) -> f32x8 {
        let usable = bound.simd_ge(ZERO) & bound.simd_lt(INFINITE);
        let bound = usable.bitselect(bound, INFINITE);
        let bound = self.outside.bitselect(ZERO, bound);
        self.unbounded.bitselect(INFINITE, bound)
    }
}

/// Where a sphere's numbers are not usable at all.
#[inline]
fn unusable(seen: &Seen) -> f32x8 {
    let V3 { x, y, z } = seen.center;
    let finite = x.abs().simd_lt(INFINITE) & y.abs().simd_lt(INFINITE) & z.abs().simd_lt(INFINITE);
    !(finite & seen.radius.simd_ge(ZERO))
}

#[inline]
fn extent(camera: &Intrinsics, seen: &Seen) -> Extent {
    let Seen {
        center,
        radius,
        distance_squared,
        distance,
    } = *seen;
    let outside = center.z.simd_lt(-radius)
        | beyond_side(center.x, camera.slope_min.x, center.z, radius)
        | beyond_side(-center.x, -camera.slope_max.x, center.z, radius)
        | beyond_side(center.y, camera.slope_min.y, center.z, radius)
        | beyond_side(-center.y, -camera.slope_max.y, center.z, radius);
    let unusable = unusable(seen);
    let gap = distance * splat(1.0 - ROUNDING) - radius;
    let apart = gap.simd_gt(ZERO) & distance_squared.simd_lt(INFINITE);
    let off_axis = (center.x * center.x + center.y * center.y).sqrt();
    let tangent_length = (gap * (distance + radius)).sqrt();
    let cosine =
        (center.z * tangent_length - off_axis * radius) / distance_squared - splat(ROUNDING);
    let corner = splat(camera.max_secant());
    let secant = (cosine * corner)
        .simd_gt(ONE)
        .bitselect(ONE / cosine, corner);
    let (ahead, around) = (center.z - radius, gap / secant);
    Extent {
        outside: outside & !unusable,
        unbounded: unusable | (!apart & !outside),
        secant,
        depth: ahead.simd_gt(around).bitselect(ahead, around),
    }
}

#[inline]
fn beyond_side(across: f32x8, slope: f32, z: f32x8, radius: f32x8) -> f32x8 {
    let edge = splat(slope) * z;
    let inside_by = across - edge + splat(ROUNDING) * (across.abs() + edge.abs());
    inside_by.simd_lt(ZERO)
        & (inside_by * inside_by).simd_gt(radius * radius * splat(1.0 + slope * slope))
}

#[inline]
fn picture_weight(facing: f32x8, variance: f32x8) -> f32x8 {
    let facing_squared = facing * facing;
    let visible_share = splat(0.5) * (facing + (facing_squared + variance).sqrt());
    let u = facing_squared / (splat(2.0) * variance + splat(FLATNESS_FLOOR));
    let silhouette = ONE / (ONE + u + splat(0.5) * u * u);
    visible_share.simd_gt(ZERO).bitselect(visible_share, ZERO)
        + splat(SILHOUETTE_WEIGHT) * silhouette
}
