//! The criterion: how many pixels of error a group's simplification shows in a view.
//!
//! From the camera-sampling field (P.-H. Lin and T.-Y. Lee, "Camera-Sampling Field and Its
//! Applications", IEEE TVCG 2004): the error of a piece of surface counts in the picture by its
//! projection factor c·n (eq. 16), the samples per unit area of surface.
//!
//! ```text
//! screen error = e √( c (4 V + 0.4 p) )        pixels
//!
//! e   error of the simplification, a length, times the most that the instance stretches lengths
//! c   upper bound of the field's strength over the group's sphere (eq. 5), samples per unit area
//! V   mean of max(n·s, 0) over the group's surface: the visible share of its projection factor
//! p   likelihood of a silhouette in the group, where c·n is 0 but an error is seen edge-on
//!
//! V = (μ + √(μ² + v)) / 2,   μ = m·s,   v = (1 − |m|²) / 4
//! p = 1 / (1 + u + u²/2),    u = μ² / (2v + 0.005)
//! m   mean of the group's unit normals;  s  unit vector from the group to the camera
//! ```
//! V, p and the constants are ours, not the paper's: a smooth estimate from the mean normal alone.
//! V is taken relative to that of a surface with normals in all directions, 1/4, so that such a surface
//! shows e √c. At the same threshold the picture is then about as near to the source as that of
//! rotation-invariant metrics; that, and the weight of p, were measured on a set of training models and
//! poses (`fieldlod-lab chart --training`).
//!
//! The screen error is RMS-like: it weighs errors by how much of the picture they touch, and is no
//! upper bound of a displacement.

use camera_field::{Camera, Intrinsics, SphereBound, SphereExtent};
use fieldlod_hierarchy::{Group, Sphere};
use glam::Vec3;

use crate::settings::{LodSettings, Offscreen};
use crate::view::InstanceView;

/// Of V: 1 over that of a surface with normals in all directions.
pub(crate) const VISIBLE_WEIGHT: f32 = 4.0;
/// Of p, times [`VISIBLE_WEIGHT`].
pub(crate) const SILHOUETTE_WEIGHT: f32 = 0.1 * VISIBLE_WEIGHT;
pub(crate) const FLATNESS_FLOOR: f32 = 0.005;
/// Rounding of the widest aspect ratio, added so that no threshold is relaxed by it.
pub(crate) const ASPECT_ROUNDING: f32 = 1e-6;

/// The screen-space error of the simplification of `group`, in pixels: what [`select`] compares with
/// [`LodSettings::error_px`].
///
/// Zero outside the field of view ([`Offscreen::Coarsest`]); infinite for a terminal group and
/// where the group's sphere reaches the camera plane inside the field of view. Never negative; NaN
/// only for input that holds NaN.
///
/// [`select`]: crate::select
#[must_use]
pub fn screen_error_px(group: &Group, instance: &InstanceView) -> f32 {
    group_error_px(group, instance, &LodSettings::default(), false)
}

/// The most that a point of `group`'s surface moves on screen by its simplification, in pixels:
/// what [`select`](crate::select) compares with [`LodSettings::displacement_px`].
///
/// ```text
/// E = d · √(c / cos φ)       at most, over the sphere
/// ```
/// with `d` the deviation of the two surfaces, times what the instance stretches lengths across the
/// sight rays of the sphere. Zero, infinite and NaN as in [`screen_error_px`].
#[must_use]
pub fn screen_displacement_px(group: &Group, instance: &InstanceView) -> f32 {
    group_error_px(group, instance, &LodSettings::guaranteed(1.0), false)
}

/// The error of `group` in pixels under `settings`: the group is refined where it is more than
/// [`LodSettings::threshold_px`].
///
/// With both thresholds it is the greater of the screen-space error and the displacement times
/// `error_px / displacement_px`; with neither it is 0. Zero, infinite and NaN as in
/// [`screen_error_px`].
///
/// A group that `was_refined` in the last cut leaves a wider view than it entered, if the view has
/// [margins](crate::View::with_margins): its error is never less than that of one that was not.
#[must_use]
pub fn group_error_px(
    group: &Group,
    instance: &InstanceView,
    settings: &LodSettings,
    was_refined: bool,
) -> f32 {
    if group.is_terminal() {
        return f32::INFINITY;
    }
    let seen = SeenGroup::new(group, instance, was_refined);
    let criterion = settings.criterion();
    let error_px = criterion.counts_error.then(|| seen.error_px(settings));
    let displacement_px = criterion
        .displacement_weight
        .map(|weight| seen.displacement_px(settings) * weight);
    match (error_px, displacement_px) {
        (Some(error_px), Some(displacement_px)) => larger(error_px, displacement_px),
        (error_px, displacement_px) => error_px.or(displacement_px).unwrap_or(0.0),
    }
}

/// The larger of two numbers; NaN if either is.
fn larger(a: f32, b: f32) -> f32 {
    if a > b || a.is_nan() { a } else { b }
}

/// A group in camera space.
struct SeenGroup<'a> {
    group: &'a Group,
    instance: &'a InstanceView,
    sphere: Sphere,
    distance: f32,
    extent: SphereExtent,
}

impl<'a> SeenGroup<'a> {
    fn new(group: &'a Group, instance: &'a InstanceView, was_refined: bool) -> Self {
        let sphere = instance.sphere_in_camera(&group.bounds);
        let extent = match extent(&instance.kept_camera, &sphere) {
            // So that nothing leaves where it enters: the wider view may exclude more of what reaches
            // from behind the camera plane to before it.
            SphereExtent::Outside => SphereExtent::Outside,
            leaving if was_refined => leaving,
            _ => extent(&instance.camera, &sphere),
        };
        Self {
            group,
            instance,
            sphere,
            distance: sphere.center.length(),
            extent,
        }
    }

    /// `e √(c (4 V + 0.4 p))`.
    fn error_px(&self, settings: &LodSettings) -> f32 {
        let SphereBound::Bounded(strength) = self.strength(settings) else {
            return f32::INFINITY;
        };
        let mean_normal = self.group.mean_normal;
        let facing = self
            .instance
            .facing(mean_normal, self.sphere.center, self.distance);
        let weight = picture_weight(facing, normal_variance(mean_normal));
        let error = self.group.error_in_local * self.stretch();
        error * (strength * weight).sqrt() * self.relaxation(settings.min_aspect_ratio)
    }

    /// `d √(c / cos φ)`.
    fn displacement_px(&self, settings: &LodSettings) -> f32 {
        let SphereBound::Bounded(scale) = self.pixel_scale(settings) else {
            return f32::INFINITY;
        };
        let deviation = self.group.deviation_in_local * self.stretch();
        deviation * scale * self.relaxation(settings.min_aspect_ratio)
    }

    fn stretch(&self) -> f32 {
        self.instance.stretch_seen(&self.sphere, self.distance)
    }

    fn pixel_scale(&self, settings: &LodSettings) -> SphereBound {
        match &self.instance.camera {
            Camera::Perspective(camera) if self.is_on_axis(settings) => {
                bounded(camera.focal_px.x.max(camera.focal_px.y) / self.distance)
            }
            Camera::Perspective(camera) => camera.pixel_scale_over_extent(self.extent),
            Camera::Orthographic(camera) => {
                let scale = camera.pixels_per_unit.x.max(camera.pixels_per_unit.y);
                self.constant(scale, settings)
            }
        }
    }

    /// Whether the group is outside the view and counts still.
    fn is_on_axis(&self, settings: &LodSettings) -> bool {
        self.extent == SphereExtent::Outside && settings.offscreen == Offscreen::OnAxis
    }

    /// The field's strength for the whole group: its bound over the sphere, or one sample where the
    /// field is flat enough; outside the field of view zero or that on the axis.
    fn strength(&self, settings: &LodSettings) -> SphereBound {
        let center = self.sphere.center;
        let camera = match &self.instance.camera {
            Camera::Perspective(camera) => camera,
            Camera::Orthographic(camera) => {
                let strength = camera.pixels_per_unit.x * camera.pixels_per_unit.y;
                return self.constant(strength, settings);
            }
        };
        if self.is_on_axis(settings) {
            return bounded(camera.constant_px2() / (self.distance * self.distance));
        }
        let bound = camera.strength_over_extent(self.extent);
        if !(matches!(self.extent, SphereExtent::Visible { .. }) && self.is_flat(settings.max_curl))
        {
            return bound;
        }
        let sample = camera.constant_px2() * self.distance / (center.z * center.z * center.z);
        // The centre may lie beyond the edge of the image.
        if sample < bound.or_infinity() {
            SphereBound::Bounded(sample)
        } else {
            bound
        }
    }

    /// A bound that does not depend on where the sphere is.
    fn constant(&self, value: f32, settings: &LodSettings) -> SphereBound {
        match self.extent {
            SphereExtent::Outside if !self.is_on_axis(settings) => SphereBound::Bounded(0.0),
            SphereExtent::Unbounded => SphereBound::Unbounded,
            _ => bounded(value),
        }
    }

    /// `κ < max_curl`, without dividing by depth.
    fn is_flat(&self, max_curl: f32) -> bool {
        let Sphere { center, radius } = self.sphere;
        let z_squared = center.z * center.z;
        let off_axis_squared = center.x * center.x + center.y * center.y;
        let change = radius * radius * (4.0 * z_squared + 9.0 * off_axis_squared);
        let allowed = max_curl * max_curl * (self.distance * self.distance) * z_squared;
        center.z > 0.0 && change < allowed
    }

    /// The factor of [`LodSettings::min_aspect_ratio`].
    fn relaxation(&self, min_aspect_ratio: f32) -> f32 {
        match &self.instance.camera {
            Camera::Perspective(camera) if min_aspect_ratio > 0.0 => {
                let aspect = widest_aspect_ratio(camera, &self.sphere, self.distance);
                if aspect < min_aspect_ratio {
                    aspect / min_aspect_ratio
                } else {
                    1.0
                }
            }
            _ => 1.0,
        }
    }
}

fn bounded(value: f32) -> SphereBound {
    if (0.0..f32::INFINITY).contains(&value) {
        SphereBound::Bounded(value)
    } else {
        SphereBound::Unbounded
    }
}

/// Of a sphere in the view. Where the field is constant it has neither secant nor depth.
fn extent(camera: &Camera, sphere: &Sphere) -> SphereExtent {
    let Sphere { center, radius } = *sphere;
    match camera {
        Camera::Perspective(camera) => camera.sphere_extent(center, radius),
        Camera::Orthographic(_) if !(center.is_finite() && radius >= 0.0) => {
            SphereExtent::Unbounded
        }
        Camera::Orthographic(camera) if camera.touches_sphere(center, radius) => {
            SphereExtent::Visible {
                secant_max: 1.0,
                depth_min: 1.0,
            }
        }
        Camera::Orthographic(_) => SphereExtent::Outside,
    }
}

/// The greatest aspect ratio `cos φ` in the visible part of a sphere that does not hold the camera:
/// `cos(φ − δ)`, or 1 where the sphere meets the axis; at least that of the widest corner.
fn widest_aspect_ratio(camera: &Intrinsics, sphere: &Sphere, distance: f32) -> f32 {
    let Sphere { center, radius } = *sphere;
    let off_axis = (center.x * center.x + center.y * center.y).sqrt();
    if off_axis <= radius {
        return 1.0;
    }
    let tangent_length = ((distance - radius) * (distance + radius)).sqrt();
    let cosine = (center.z * tangent_length + off_axis * radius) / (distance * distance);
    (cosine + ASPECT_ROUNDING).max(1.0 / camera.max_secant())
}

/// `v` of the module's formula. Rounding may leave |m| a hair above 1.
pub(crate) fn normal_variance(mean_normal: Vec3) -> f32 {
    (1.0 - mean_normal.length_squared()).max(0.0) * 0.25
}

/// `4 V + 0.4 p` of the module's formula, for `μ` and `v`.
pub(crate) fn picture_weight(facing: f32, variance: f32) -> f32 {
    let facing_squared = facing * facing;
    let visible = 0.5 * VISIBLE_WEIGHT * (facing + (facing_squared + variance).sqrt());
    let u = facing_squared / (2.0 * variance + FLATNESS_FLOOR);
    let silhouette = 1.0 / (1.0 + u + 0.5 * u * u);
    visible.max(0.0) + SILHOUETTE_WEIGHT * silhouette
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture_weight(mean_normal: Vec3, to_camera: Vec3) -> f32 {
        super::picture_weight(mean_normal.dot(to_camera), normal_variance(mean_normal))
    }

    #[test]
    fn a_flat_group_facing_the_camera_counts_in_full() {
        let weight = picture_weight(Vec3::Z, Vec3::Z);
        assert!((weight - VISIBLE_WEIGHT).abs() < 4e-3, "{weight}");
    }

    #[test]
    fn a_flat_group_turned_away_counts_nothing() {
        let weight = picture_weight(Vec3::Z, Vec3::NEG_Z);
        assert!((0.0..4e-3).contains(&weight), "{weight}");
    }

    #[test]
    fn a_flat_group_seen_edge_on_counts_by_its_silhouette() {
        let weight = picture_weight(Vec3::Z, Vec3::X);
        assert!((weight - SILHOUETTE_WEIGHT).abs() < 1e-6, "{weight}");
    }

    #[test]
    fn a_closed_group_counts_the_same_from_everywhere() {
        let weight = picture_weight(Vec3::ZERO, Vec3::X);
        assert_eq!(weight, picture_weight(Vec3::ZERO, Vec3::NEG_Y));
        // The mean of max(n·s, 0) over a sphere is 1/4: what V gives for m = 0.
        assert!((weight - (1.0 + SILHOUETTE_WEIGHT)).abs() < 1e-6);
    }
}
