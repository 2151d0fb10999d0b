//! The criterion for eight groups at once, equal bit for bit to
//! [`group_error_px`](crate::group_error_px).
//!
//! Every line computes what the scalar code and `camera_field`'s bounds compute, in the same order,
//! with operations that IEEE 754 rounds exactly, so that lanes and scalars agree on every machine.

mod bounds;
mod lanes;

use camera_field::{Camera, Intrinsics, OrthographicIntrinsics};
use glam::Vec3;
use wide::f32x8;

use crate::criterion::ASPECT_ROUNDING;
use crate::decide::conservative::Tests;
use crate::settings::Criterion;
use crate::stretch::{STRETCH_ROUNDING, SeenStretch};
use crate::table::GroupTable;
use crate::{InstanceView, LodSettings, Offscreen};
use bounds::{Edge, Extent, ROUNDING, Seen, picture_weight};
use lanes::{INFINITE, M3, ONE, V3, ZERO, splat};

/// One instance in one view under one set of settings.
pub(crate) struct Kernel<'a> {
    instance: &'a InstanceView,
    settings: &'a LodSettings,
    criterion: Criterion,
    camera_from_local: M3,
    origin: V3,
    normal_map: M3,
    corner: f32,
    /// Where refined groups leave another view than they entered.
    kept_corner: Option<f32>,
}

impl<'a> Kernel<'a> {
    pub(crate) fn new(instance: &'a InstanceView, settings: &'a LodSettings) -> Self {
        let corner = |camera: &Camera| match camera {
            Camera::Perspective(camera) => camera.max_secant(),
            Camera::Orthographic(_) => 1.0,
        };
        let keeps = instance.kept_camera != instance.camera;
        Self {
            instance,
            settings,
            criterion: settings.criterion(),
            corner: corner(&instance.camera),
            kept_corner: keeps.then(|| corner(&instance.kept_camera)),
            camera_from_local: M3::splat(&instance.camera_from_local),
            origin: V3::splat(instance.origin_in_camera),
            normal_map: M3::splat(&instance.normal_in_camera_from_local),
        }
    }

    /// The error of the groups of one block, of which `was_refined` has the bits. Terminal
    /// groups give that of no error.
    #[inline]
    pub(crate) fn error_px(&self, table: &GroupTable, block: usize, was_refined: u32) -> f32x8 {
        let seen = self.seen(table, block);
        let edge = self.edge(&seen, was_refined);
        self.error_px_of(&seen, &edge, table, block)
    }

    /// [`Kernel::error_px`], or `None` where each group is outside the view, deep enough, or among
    /// `others`: before any quotient.
    #[inline]
    pub(crate) fn error_px_unless(
        &self,
        others: f32x8,
        tests: &Tests,
        table: &GroupTable,
        block: usize,
        was_refined: u32,
    ) -> Option<f32x8> {
        let seen = self.seen(table, block);
        let edge = self.edge(&seen, was_refined);
        let below = |scale: &crate::decide::conservative::DepthScale, distance: f32x8| {
            let mut shows_to = table.groups.error_weighed[block] * splat(scale.of_weighed_error);
            if scale.of_deviation != 0.0 {
                let deviation = table.groups.deviation[block] * splat(scale.of_deviation);
                shows_to = shows_to.simd_gt(deviation).bitselect(shows_to, deviation);
            }
            let reach = shows_to + seen.radius * splat(1.001) + splat(scale.slack);
            reach.simd_lt(distance)
        };
        let unseen = match &tests.on_axis {
            None => edge.outside,
            Some(on_axis) => edge.outside & below(on_axis, seen.distance),
        };
        let mut idle = unseen | others;
        if tests.facing.is_none() {
            idle |= below(&tests.depth, seen.center.z);
        }
        let idle = idle.all();
        (!idle).then(|| self.error_px_of(&seen, &edge, table, block))
    }

    #[inline]
    fn error_px_of(&self, seen: &Seen, edge: &Edge, table: &GroupTable, block: usize) -> f32x8 {
        match &self.instance.camera {
            Camera::Perspective(camera) => {
                let extent = Extent::new(seen, edge);
                self.perspective_px(camera, seen, &extent, table, block)
            }
            Camera::Orthographic(camera) => self.orthographic_px(camera, seen, edge, table, block),
        }
    }

    #[inline]
    fn edge(&self, seen: &Seen, was_refined: u32) -> Edge {
        let entering = Edge::new(&self.instance.camera, self.corner, seen);
        match self.kept_corner {
            Some(corner) => {
                let leaving = Edge::new(&self.instance.kept_camera, corner, seen);
                entering.or_kept(was_refined, &leaving)
            }
            None => entering,
        }
    }

    #[inline]
    fn seen(&self, table: &GroupTable, block: usize) -> Seen {
        let local = V3 {
            x: table.groups.x[block],
            y: table.groups.y[block],
            z: table.groups.z[block],
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
            radius: splat(self.instance.camera_per_local) * table.groups.radius[block],
            distance_squared,
            distance: distance_squared.sqrt(),
        }
    }

    #[inline]
    fn perspective_px(
        &self,
        camera: &Intrinsics,
        seen: &Seen,
        extent: &Extent,
        table: &GroupTable,
        block: usize,
    ) -> f32x8 {
        let strength = || {
            let constant = splat(camera.constant_px2());
            let bound = constant * extent.secant / (extent.depth * extent.depth);
            let bound = self.unless_outside(extent, bound * splat(1.0 + ROUNDING), || {
                constant / (seen.distance * seen.distance)
            });
            self.sampled_where_flat(constant, seen, extent, bound)
        };
        let pixel_scale = || {
            let focal = splat(camera.focal_px.x.max(camera.focal_px.y));
            let bound = focal * extent.secant / extent.depth * splat(1.0 + ROUNDING);
            self.unless_outside(extent, bound, || focal / seen.distance)
        };
        let stretch = self.stretch(seen);
        let relaxation = self.relaxation(seen);
        self.combined(
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
        edge: &Edge,
        table: &GroupTable,
        block: usize,
    ) -> f32x8 {
        let extent = Extent::constant(seen, edge);
        let pixels = camera.pixels_per_unit;
        let constant = |value: f32x8| self.unless_outside(&extent, value, || value);
        let strength = || constant(splat(pixels.x * pixels.y));
        let pixel_scale = || constant(splat(pixels.x.max(pixels.y)));
        let stretch = self.stretch(seen);
        self.combined(table, block, strength, pixel_scale, stretch, ONE, seen)
    }

    /// `bound` in the view; outside zero or, with [`Offscreen::OnAxis`], what `on_axis` gives.
    #[inline]
    fn unless_outside(&self, extent: &Extent, bound: f32x8, on_axis: impl Fn() -> f32x8) -> f32x8 {
        let bound = extent.or_infinity(bound);
        if self.settings.offscreen == Offscreen::Coarsest {
            return bound;
        }
        let on_axis = on_axis();
        let usable = on_axis.simd_ge(ZERO) & on_axis.simd_lt(INFINITE);
        let on_axis = usable.bitselect(on_axis, INFINITE);
        extent.outside.bitselect(on_axis, bound)
    }

    #[inline]
    fn stretch(&self, seen: &Seen) -> f32x8 {
        let most = self.instance.camera_per_local;
        match (&self.instance.seen_stretch, &self.instance.camera) {
            (None, _) => splat(most),
            (Some(stretch), Camera::Perspective(_)) => self.stretch_seen(stretch, seen),
            (Some(stretch), Camera::Orthographic(_)) => {
                let seen = stretch.across(Vec3::Z);
                splat(if seen < most { seen } else { most })
            }
        }
    }

    #[inline]
    fn combined(
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
            let error = table.facings.error[block] * stretch;
            let quality = error * (strength * weight).sqrt() * relaxation;
            strength.simd_ge(INFINITE).bitselect(INFINITE, quality)
        };
        let displacement = || {
            let scale = pixel_scale();
            let displacement = table.groups.deviation[block] * stretch * scale * relaxation;
            scale.simd_ge(INFINITE).bitselect(INFINITE, displacement)
        };
        match (
            self.criterion.counts_error,
            self.criterion.displacement_weight,
        ) {
            (true, None) => quality(),
            (false, Some(weight)) => displacement() * splat(weight),
            (true, Some(weight)) => {
                let (a, b) = (quality(), displacement() * splat(weight));
                (a.simd_gt(b) | a.simd_ne(a)).bitselect(a, b)
            }
            (false, None) => ZERO,
        }
    }

    #[inline]
    fn facing(&self, seen: &Seen, table: &GroupTable, block: usize) -> f32x8 {
        let normal = V3 {
            x: table.facings.normal[0][block],
            y: table.facings.normal[1][block],
            z: table.facings.normal[2][block],
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
    fn relaxation(&self, seen: &Seen) -> f32x8 {
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
        let least = splat(1.0 / self.corner);
        let widest = cosine + splat(ASPECT_ROUNDING);
        let widest = widest.simd_gt(least).bitselect(widest, least);
        let aspect = off_axis.simd_le(radius).bitselect(ONE, widest);
        let limit = splat(min_aspect_ratio);
        aspect.simd_lt(limit).bitselect(aspect / limit, ONE)
    }
}
