//! The criterion: the error of a group's simplification in a view, in pixels.
//!
//! It is based on the camera-sampling field (P.-H. Lin and T.-Y. Lee, "Camera-Sampling Field and Its Applications",
//! IEEE TVCG 2004). The error of a piece of surface is weighed by its projection factor c·n (eq. 16), the samples per
//! unit area of surface.
//!
//! ```text
//! screen error = e √( c (4 V + 0.4 p) o )      pixels
//!
//! e   error of the simplification, a length, times the largest stretch of the instance
//! c   upper bound of the field's strength over the group's sphere (eq. 5), samples per unit area
//! V   mean of max(n·s, 0) over the group's surface: the visible share of its projection factor
//! p   likelihood of a silhouette in the group, where c·n is 0 but an error is seen edge-on
//! o   visible share of the group, 1 without [`VisibleFlux`](crate::VisibleFlux)
//!
//! V = (μ + √(μ² + v)) / 2,   μ = m·s,   v = (1 − |m|²) / 4
//! p = 1 / (1 + u + u²/2),    u = μ² / (2v + 0.005)
//! m   mean of the group's unit normals;  s  unit vector from the group to the camera
//! ```
//! V, p and the constants are ours, not the paper's: a smooth estimate from the mean normal alone.
//! V is relative to that of a surface with normals in all directions, 1/4, which has the error e √c. At the same
//! threshold the picture is then about as near to the source as that of rotation-invariant metrics. The weight of p was
//! measured on a set of training models and poses (`fieldlod-lab chart --training`): less coarsens silhouettes, more
//! refines surfaces seen edge-on.
//!
//! The screen error is RMS-like: it weighs errors by their area in the picture, and is not an upper bound of a
//! displacement.
//!
//! Bounds of the criterion save most evaluations, and must follow a change of it: [`limits`] (of a level),
//! [`error_bounds`] and `select/bounds_test.rs` (of many groups), `select/limits/keep_test.rs` (of whole instances),
//! and [`Drift`] (of a moving camera). `tests/matches_naive.rs` compares the result with the criterion.

pub(crate) mod error_bounds;
pub(crate) mod extent;
pub(crate) mod limits;

use camera_field::Camera;
use fieldlod_hierarchy::Group;
use glam::{Vec2, Vec3};

use crate::lanes::{Lane, M3, V3};
use crate::settings::{ErrorWeights, LodSettings, Offscreen};
use crate::view::InstanceView;
use extent::{ROUNDING, SeenExtent, SeenSphere, corner_secant, is_unusable, outside};

/// Weight of V: 1 over the V of a surface with normals in all directions.
pub(crate) const VISIBLE_WEIGHT: f32 = 4.0;
/// Weight of p: a tenth of the weight of V. At equal silhouettes, a prototype drew 0.97 of clusterlod's triangles with
/// it, and 1.02 without p.
pub(crate) const SILHOUETTE_WEIGHT: f32 = 0.1 * VISIBLE_WEIGHT;
/// Keeps `u` finite for flat groups. A smaller value makes their silhouettes narrower, and a larger value makes them
/// wider.
pub(crate) const FLATNESS_FLOOR: f32 = 0.005;
/// Bound of the rounding of the widest aspect ratio. With a smaller bound, rounding may relax thresholds.
const ASPECT_ROUNDING: f32 = 1e-6;

/// The screen-space error of the simplification of `group`, in pixels, which [`select`] compares with
/// [`LodSettings::error_px`].
///
/// Zero outside the field of view ([`Offscreen::Coarsest`]). Infinite for a terminal group, or if the group's sphere
/// reaches the camera plane inside the field of view. Never negative. NaN only for input that holds NaN.
///
/// [`select`]: crate::select
#[must_use]
pub fn screen_error_px(group: &Group, instance: &InstanceView) -> f32 {
    group_error_px(group, instance, &LodSettings::default(), false)
}

/// The largest displacement on screen of a point of `group`'s surface by its simplification, in pixels, which
/// [`select`](crate::select) compares with [`LodSettings::displacement_px`].
///
/// ```text
/// E = d · √(c / cos φ)       at most, over the sphere
/// ```
/// with `d` the deviation of the two surfaces, times the stretch of the instance across the sight rays of the sphere.
/// Zero, infinite and NaN as in [`screen_error_px`].
#[must_use]
pub fn screen_displacement_px(group: &Group, instance: &InstanceView) -> f32 {
    group_error_px(group, instance, &LodSettings::guaranteed(1.0), false)
}

/// The error of `group` in pixels under `settings`: a group is refined if its error exceeds
/// [`LodSettings::threshold_px`].
///
/// With both thresholds it is the greater of the screen-space error and the displacement times
/// `error_px / displacement_px`; with neither it is 0. Zero, infinite and NaN as in
/// [`screen_error_px`].
///
/// If the view has [margins](crate::View::with_margins), a group that `was_refined` in the previous cut leaves a wider
/// view than it entered. Its error is then at least that of a group that was not refined.
#[must_use]
pub fn group_error_px(
    group: &Group,
    instance: &InstanceView,
    settings: &LodSettings,
    was_refined: bool,
) -> f32 {
    visible_error_px(group, instance, settings, was_refined, 1.0)
}

/// [`group_error_px`] of a group with a visible share, as a [`Selector`](crate::Selector) compares it with
/// [`LodSettings::visible_flux`]. Displacements are not weighed, since the share is an estimate.
#[must_use]
pub fn visible_error_px(
    group: &Group,
    instance: &InstanceView,
    settings: &LodSettings,
    was_refined: bool,
    visible_share: f32,
) -> f32 {
    if group.is_terminal() {
        return f32::INFINITY;
    }
    let criterion = Criterion::<f32>::new(instance, settings);
    let input = CriterionInput {
        share: visible_share,
        ..CriterionInput::of_group(group)
    };
    criterion.error_px(&input, was_refined)
}

/// Deviation of groups without a measured deviation. It is larger than any threshold allows, but finite: outside the
/// view it is multiplied by zero, and infinity times zero is NaN.
const UNMEASURED: f32 = 1e24;

pub(crate) fn usable_deviation(group: &Group) -> f32 {
    group.deviation_in_local.min(UNMEASURED)
}

/// Input of the criterion from a group, in local space.
#[derive(Clone, Copy)]
pub(crate) struct CriterionInput<L> {
    pub(crate) center: V3<L>,
    pub(crate) radius: L,
    pub(crate) error: L,
    pub(crate) deviation: L,
    pub(crate) mean_normal: V3<L>,
    /// `|m|` and `v` of the module's formula.
    pub(crate) normal_length: L,
    pub(crate) normal_variance: L,
    /// The share of the group that is not hidden.
    pub(crate) share: L,
}

impl CriterionInput<f32> {
    fn of_group(group: &Group) -> Self {
        Self {
            center: V3::splat(group.bounds.center),
            radius: group.bounds.radius,
            error: group.error_in_local,
            deviation: usable_deviation(group),
            mean_normal: V3::splat(group.mean_normal),
            normal_length: group.mean_normal.length(),
            normal_variance: normal_variance(group.mean_normal),
            share: 1.0,
        }
    }
}

/// A motion of the camera: lengths of the paths of its eye and, in radians or more, of its axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motion {
    pub(crate) travel: f32,
    pub(crate) turn: f32,
}

/// Bounds of the motion of an instance's groups in camera space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drift {
    /// Bound of the distance that a center moves.
    pub(crate) distance: f32,
    /// Bound of the change of the unit vector from a center to the camera.
    pub(crate) chord: f32,
}

/// The criterion of one instance in one view under one set of settings.
pub(crate) struct Criterion<'a, L> {
    pub(crate) instance: &'a InstanceView,
    pub(crate) settings: &'a LodSettings,
    weights: ErrorWeights,
    camera_from_local: M3<L>,
    origin_in_camera: V3<L>,
    normal_in_camera_from_local: M3<L>,
    /// Secant of the image's widest corner.
    corner: f32,
    /// Secant of the widest corner of the view that refined groups leave; `None` if it is the view that groups enter.
    leaving_corner: Option<f32>,
    /// The motion of groups, if any. Errors of refined groups are then their least errors during the motion, and errors
    /// of other groups their largest. The instance must stay inside the view or outside.
    pub(crate) drift: Option<Drift>,
}

impl<'a, L: Lane> Criterion<'a, L> {
    pub(crate) fn new(instance: &'a InstanceView, settings: &'a LodSettings) -> Self {
        let has_margin = instance.kept_camera != instance.camera;
        Self {
            instance,
            settings,
            weights: settings.error_weights(),
            camera_from_local: M3::splat(&instance.camera_from_local),
            origin_in_camera: V3::splat(instance.origin_in_camera),
            normal_in_camera_from_local: M3::splat(&instance.normal_in_camera_from_local),
            corner: corner_secant(&instance.camera),
            leaving_corner: has_margin.then(|| corner_secant(&instance.kept_camera)),
            drift: None,
        }
    }

    /// The error to compare with [`LodSettings::threshold_px`], of groups that are not terminal.
    #[inline(always)]
    pub(crate) fn error_px(&self, group: &CriterionInput<L>, was_refined: L::Mask) -> L {
        // The sphere in camera space and its extent in the view.
        let seen = self.seen(group, was_refined);
        let extent = self.extent(&seen, was_refined);
        // Factors of both errors.
        let stretch = self.stretch(&seen);
        let relaxation = self.relaxation(&seen);
        // e √(c (4 V + 0.4 p) o); infinite if the strength is infinite, even if a factor is 0.
        let screen_error = || {
            let strength = self.strength(&seen, &extent);
            let facing = self.facing(group, &seen);
            let weight = self.weight(facing, group, was_refined) * group.share;
            let error_px = group.error * stretch * (strength * weight).sqrt() * relaxation;
            L::choose(L::infinity().is_at_most(strength), L::infinity(), error_px)
        };
        // d √(c / cos φ).
        let displacement = || {
            let pixel_scale = self.pixel_scale(&seen, &extent);
            let displacement_px = group.deviation * stretch * pixel_scale * relaxation;
            L::choose(
                L::infinity().is_at_most(pixel_scale),
                L::infinity(),
                displacement_px,
            )
        };
        match (self.weights.counts_error, self.weights.displacement_weight) {
            (true, None) => screen_error(),
            (false, Some(weight)) => displacement() * L::splat(weight),
            (true, Some(weight)) => {
                let (a, b) = (screen_error(), displacement() * L::splat(weight));
                // NaN if either error is NaN.
                L::choose(b.is_below(a) | a.not_a_number(), a, b)
            }
            (false, None) => L::zero(),
        }
    }

    #[inline]
    fn seen(&self, group: &CriterionInput<L>, was_refined: L::Mask) -> SeenSphere<L> {
        let center = self
            .camera_from_local
            .of(group.center)
            .plus(self.origin_in_camera);
        let distance_squared = center.dot(center);
        let radius = L::splat(self.instance.camera_per_local) * group.radius;
        let reach = self.drift.map_or(radius, |drift| {
            let distance = L::splat(drift.distance);
            radius + L::choose(was_refined, -distance, distance)
        });
        SeenSphere {
            center,
            radius,
            reach,
            distance_squared,
            distance: distance_squared.sqrt(),
        }
    }

    /// The extent of a sphere in the view that its group enters or, if it was refined, leaves.
    #[inline]
    fn extent(&self, seen: &SeenSphere<L>, was_refined: L::Mask) -> SeenExtent<L> {
        let entering = outside(&self.instance.camera, seen);
        let corner = L::splat(self.corner);
        let (outside, corner) = match self.leaving_corner {
            None => (entering, corner),
            Some(leaving_corner) => {
                let leaving = outside(&self.instance.kept_camera, seen);
                // A group must not leave where it enters: the wider view may exclude more spheres that cross the camera
                // plane.
                let outside = leaving | (entering & !was_refined);
                (
                    outside,
                    L::choose(was_refined, L::splat(leaving_corner), corner),
                )
            }
        };
        match self.instance.camera {
            Camera::Perspective(_) => SeenExtent::new(seen, outside, corner),
            Camera::Orthographic(_) => SeenExtent {
                outside,
                unbounded: is_unusable(seen),
                // The field is constant, so that its bounds do not depend on the sphere.
                secant: L::one(),
                depth: L::one(),
            },
        }
    }

    /// The field's strength for the whole group: its bound over the sphere, or one sample if the field is flat enough.
    /// Outside the field of view, it is zero or the strength on the axis.
    #[inline]
    fn strength(&self, seen: &SeenSphere<L>, extent: &SeenExtent<L>) -> L {
        let px_per_unit = px_per_unit(&self.instance.camera);
        let constant = L::splat(px_per_unit.x * px_per_unit.y);
        match &self.instance.camera {
            Camera::Perspective(_) => {
                let bound = constant * extent.secant / (extent.depth * extent.depth);
                let bound = bound * L::splat(1.0 + ROUNDING);
                let distance = seen.reached_distance();
                let on_axis = |bias: L| constant * bias * bias / (distance * distance);
                let bound = self.unless_outside(extent, bound, on_axis);
                self.sampled_where_flat(constant, seen, extent, bound)
            }
            Camera::Orthographic(_) => {
                self.unless_outside(extent, constant, |bias| constant * bias * bias)
            }
        }
    }

    /// Pixels per unit of a displacement across the sight ray, `√(c / cos φ)`, at most.
    #[inline]
    fn pixel_scale(&self, seen: &SeenSphere<L>, extent: &SeenExtent<L>) -> L {
        let px_per_unit = L::splat(px_per_unit(&self.instance.camera).max_element());
        match &self.instance.camera {
            Camera::Perspective(_) => {
                let bound = px_per_unit * extent.secant / extent.depth * L::splat(1.0 + ROUNDING);
                let distance = seen.reached_distance();
                self.unless_outside(extent, bound, |bias| px_per_unit * bias / distance)
            }
            Camera::Orthographic(_) => {
                self.unless_outside(extent, px_per_unit, |bias| px_per_unit * bias)
            }
        }
    }

    /// Returns `bound` in the view. Outside, returns zero or, with [`Offscreen::OnAxis`], the result of `on_axis` for
    /// its bias.
    #[inline]
    fn unless_outside(&self, extent: &SeenExtent<L>, bound: L, on_axis: impl Fn(L) -> L) -> L {
        let finite = |value: L| L::choose(value.is_length(), value, L::infinity());
        let outside = match self.settings.advanced.offscreen {
            Offscreen::Coarsest => L::zero(),
            Offscreen::OnAxis { bias } => finite(on_axis(L::splat(bias))),
        };
        let inside = L::choose(extent.unbounded, L::infinity(), finite(bound));
        L::choose(extent.outside, outside, inside)
    }

    /// One sample of the strength at the centre instead of its bound, if `κ < max_curl`.
    #[inline]
    fn sampled_where_flat(
        &self,
        constant: L,
        seen: &SeenSphere<L>,
        extent: &SeenExtent<L>,
        bound: L,
    ) -> L {
        let max_curl = self.settings.advanced.max_curl;
        if max_curl == 0.0 {
            return bound;
        }
        let SeenSphere {
            center,
            radius,
            distance,
            ..
        } = *seen;
        // κ < max_curl, without dividing by depth.
        let z_squared = center.z * center.z;
        let off_axis_squared = center.x * center.x + center.y * center.y;
        let change =
            radius * radius * (L::splat(4.0) * z_squared + L::splat(9.0) * off_axis_squared);
        let allowed = L::splat(max_curl * max_curl) * (distance * distance) * z_squared;
        let is_flat = L::zero().is_below(center.z) & change.is_below(allowed);
        let sample = constant * distance / (center.z * center.z * center.z);
        // Zero outside the view and infinity stay as they are; the centre may be outside the image.
        let is_visible = !(extent.outside | extent.unbounded);
        L::choose(is_flat & is_visible & sample.is_below(bound), sample, bound)
    }

    /// `m·s` for a group's mean normal.
    #[inline]
    fn facing(&self, group: &CriterionInput<L>, seen: &SeenSphere<L>) -> L {
        // Against the sight ray, which is the same everywhere in an orthographic view.
        let turned = self.normal_in_camera_from_local.of(group.mean_normal);
        let (along, distance) = match self.instance.camera {
            Camera::Perspective(_) => (seen.center, seen.distance),
            Camera::Orthographic(_) => (V3::splat(Vec3::Z), L::one()),
        };
        let away = turned.dot(along);
        if self.instance.seen_stretch.is_none() {
            return -away / distance;
        }
        // An instance that is not a similarity changes the normal's length.
        let length = turned.dot(turned).sqrt();
        let facing = -away * group.normal_length / (length * distance);
        L::choose(L::zero().is_below(length), facing, L::zero())
    }

    /// `4 V + 0.4 p`.
    #[inline]
    fn weight(&self, facing: L, group: &CriterionInput<L>, was_refined: L::Mask) -> L {
        let Some(drift) = &self.drift else {
            return picture_weight(facing, group.normal_variance);
        };
        let change = L::splat(drift.chord) * group.normal_length;
        let change = L::choose(was_refined, -change, change);
        // V grows with μ and p falls with |μ|.
        let aside = (facing.abs() - change).larger(L::zero());
        let flatness = aside * aside / silhouette_width(group.normal_variance);
        let visible = visible_weight(facing + change, group.normal_variance);
        visible.larger(L::zero()) + silhouette_weight(flatness)
    }

    /// The largest stretch across the sight rays of the sphere, in camera units per local unit. It is exact at the ray
    /// of the centre. For the other rays, `sin δ = r/ρ` times the largest stretch is added.
    #[inline]
    fn stretch(&self, seen: &SeenSphere<L>) -> L {
        let most = L::splat(self.instance.camera_per_local);
        let Some(stretch) = &self.instance.seen_stretch else {
            return most;
        };
        let across = match self.instance.camera {
            Camera::Perspective(_) => {
                let along = seen.center.times(L::one() / seen.distance);
                stretch.across(along) + most * (seen.radius / seen.distance)
            }
            Camera::Orthographic(_) => stretch.across(V3::splat(Vec3::Z)),
        };
        across.smaller(most)
    }

    /// The factor of errors by `min_aspect_ratio`, from the largest aspect ratio in the visible part of a sphere. It is
    /// `cos(φ − δ)`, or 1 if the sphere meets the axis, and at least the ratio of the widest corner.
    #[inline]
    fn relaxation(&self, seen: &SeenSphere<L>) -> L {
        let min_aspect_ratio = self.settings.advanced.min_aspect_ratio;
        let is_perspective = matches!(self.instance.camera, Camera::Perspective(_));
        if !(is_perspective && min_aspect_ratio > 0.0) {
            return L::one();
        }
        let SeenSphere {
            center,
            radius,
            distance,
            ..
        } = *seen;
        // cos(φ − δ).
        let off_axis = (center.x * center.x + center.y * center.y).sqrt();
        let tangent_length = ((distance - radius) * (distance + radius)).sqrt();
        let cosine = (center.z * tangent_length + off_axis * radius) / (distance * distance);
        let widest = (cosine + L::splat(ASPECT_ROUNDING)).larger(L::splat(1.0 / self.corner));
        let aspect = L::choose(off_axis.is_at_most(radius), L::one(), widest);
        // The factor relaxes errors only below the limit.
        let limit = L::splat(min_aspect_ratio);
        L::choose(aspect.is_below(limit), aspect / limit, L::one())
    }
}

/// Pixels per unit of length along both axes, at unit depth in a perspective view.
pub(crate) fn px_per_unit(camera: &Camera) -> Vec2 {
    match camera {
        Camera::Perspective(camera) => camera.focal_px,
        Camera::Orthographic(camera) => camera.pixels_per_unit,
    }
}

/// `v` of the module's formula. Rounding may leave |m| slightly above 1.
pub(crate) fn normal_variance(mean_normal: Vec3) -> f32 {
    (1.0 - mean_normal.length_squared()).max(0.0) * 0.25
}

/// `4 V + 0.4 p` of the module's formula, for `μ` and `v`.
#[inline]
pub(crate) fn picture_weight<L: Lane>(facing: L, variance: L) -> L {
    let flatness = facing * facing / silhouette_width(variance);
    visible_weight(facing, variance).larger(L::zero()) + silhouette_weight(flatness)
}

/// `4 V`, which grows with the facing `μ`. Rounding may make it slightly negative for back faces.
#[inline]
pub(crate) fn visible_weight<L: Lane>(facing: L, variance: L) -> L {
    let root = (facing * facing + variance).sqrt();
    L::splat(0.5 * VISIBLE_WEIGHT) * (facing + root)
}

/// `2v + 0.005`, the divisor of `μ²` in `u`.
#[inline]
pub(crate) fn silhouette_width<L: Lane>(variance: L) -> L {
    L::splat(2.0) * variance + L::splat(FLATNESS_FLOOR)
}

/// `0.4 p` for `u`, with which it falls.
#[inline]
pub(crate) fn silhouette_weight<L: Lane>(u: L) -> L {
    let silhouette = L::one() / (L::one() + u + L::splat(0.5) * u * u);
    L::splat(SILHOUETTE_WEIGHT) * silhouette
}
