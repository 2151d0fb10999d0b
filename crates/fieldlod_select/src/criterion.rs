//! The criterion: the error of a group's simplification in a view, in pixels.
//!
//! It is based on the camera-sampling field (P.-H. Lin and T.-Y. Lee, "Camera-Sampling Field and Its Applications",
//! IEEE TVCG 2004). The error of a piece of surface is weighed by its projection factor c·n (eq. 16), the samples per
//! unit area of surface.
//!
//! ```text
//! screen error = e √( c (4 V + 0.4 p) ) w      pixels
//!
//! e   error of the simplification, a length, times the largest stretch across the sight rays
//! c   upper bound of the field's strength over the group's sphere (eq. 5), samples per unit area
//! V   mean of max(n·s, 0) over the group's surface: the visible share of its projection factor
//! p   likelihood of a silhouette in the group, where c·n is 0 but an error is seen edge-on
//! w   weight of the instance, 1 without [`Weights`](crate::Weights)
//!
//! V = (μ + √(μ² + v)) / 2,   μ = m·s,   v = (1 − |m|²) / 4
//! p = 1 / (1 + u + u²/2),    u = μ² / (2v + 0.005)
//! m   mean of the group's unit normals;  s  unit vector from the group to the camera
//! ```
//! V, p and the constants are ours, not the paper's: a smooth estimate from the mean normal alone.
//! The factor 4 is relative to a surface with normals in all directions, for which 4 V is 1. At the same
//! threshold the picture is then about as near to the source as that of rotation-invariant metrics. The weight of p was
//! measured on a set of training models and poses (`fieldlod-lab chart --training`): less coarsens silhouettes, more
//! refines surfaces seen edge-on.
//!
//! The screen error is RMS-like: it weighs errors by their area in the picture, and is not an upper bound of a
//! displacement.
//!
//! Bounds of the criterion save most evaluations, and must change with it: [`limits`] (of a level),
//! [`error_bounds`] and `select/bounds_test.rs` (of many groups), and `select/limits/keep_test.rs` (of whole instances).
//! The field over a group's sphere is that of [`camera_field::FieldOfView`].
//! `tests/matches_naive.rs` compares the result with the criterion.

pub(crate) mod error_bounds;
pub(crate) mod limits;

use camera_field::{FieldOfView, FieldOverSphere, SeenSphere};
use fieldlod_hierarchy::{Group, SILHOUETTE_WEIGHT, VISIBLE_WEIGHT};
use glam::Vec3;

use crate::lanes::{larger, smaller};
use crate::settings::{LodSettings, Offscreen};
use crate::view::InstanceView;

/// Keeps `u` finite for flat groups. A smaller value makes their silhouettes narrower, and a larger value makes them
/// wider.
pub(crate) const FLATNESS_FLOOR: f32 = 0.005;

/// The rounding that shortcuts of the criterion allow for. Smaller values skip groups that the criterion refines, which
/// the tests against the criterion find; larger values only test more groups.
///
/// A coordinate in camera space is a sum of nine products of rounded factors, twice: at most 30 roundings of 6e-8 of the
/// largest coordinate, here five times as much.
pub(crate) const PLACE_SLACK: f32 = 1e-5;
/// Factor of errors: a few operations, and fields that are bounds within [`camera_field`]'s own rounding.
pub(crate) const ROUNDING: f32 = 1.001;

/// The error of `group` in pixels under `settings`. A group is refined if its error, times
/// [`LodSettings::resolution_scale`], exceeds [`LodSettings::threshold_px`].
///
/// With [`LodSettings::error_px`] it is the screen-space error of the group's simplification. With
/// [`LodSettings::displacement_px`] it is the largest displacement on screen of a point of the group's surface:
/// ```text
/// E = d · √(c / cos φ)       at most, over the sphere
/// ```
/// with `d` the deviation of the two surfaces, times the stretch of the instance across the sight rays of the sphere.
/// With both thresholds it is the greater of the screen-space error and the displacement times
/// `error_px / displacement_px`; with neither it is 0.
///
/// Zero outside the field of view ([`Offscreen::Coarsest`]). Infinite for a terminal group, or if the group's sphere
/// holds the eye of a perspective camera. Never negative. NaN only for input that holds NaN.
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
    weighed_error_px(group, instance, settings, was_refined, 1.0)
}

/// [`group_error_px`] of an instance with a weight, as [`Selector::select_weighed`](crate::Selector::select_weighed)
/// computes it. Displacements are not weighed.
#[cfg_attr(
    not(any(test, feature = "test-support")),
    expect(unreachable_pub, reason = "tests compare with it")
)]
#[must_use]
pub fn weighed_error_px(
    group: &Group,
    instance: &InstanceView,
    settings: &LodSettings,
    was_refined: bool,
    weight: f32,
) -> f32 {
    if group.is_terminal() {
        return f32::INFINITY;
    }
    let criterion = Criterion::new(instance, settings, weight);
    criterion.error_px(criterion_input(group), was_refined)
}

/// Deviation of groups without a measured deviation. It is larger than any threshold allows, but finite: outside the
/// view it is multiplied by zero, and infinity times zero is NaN.
const UNMEASURED: f32 = 1e24;

pub(crate) fn usable_deviation(group: &Group) -> f32 {
    group.deviation_in_local.min(UNMEASURED)
}

/// Input of the criterion from a group, in local space: centre, radius, error, deviation and mean normal.
pub(crate) type CriterionInput = [f32; 9];

pub(crate) fn criterion_input(group: &Group) -> CriterionInput {
    let [x, y, z] = group.bounds.center.to_array();
    let [m_x, m_y, m_z] = group.mean_normal.to_array();
    let (radius, error) = (group.bounds.radius, group.error_in_local);
    let deviation = usable_deviation(group);
    [x, y, z, radius, error, deviation, m_x, m_y, m_z]
}

/// The criterion of one instance in one view under one set of settings.
#[derive(Clone, Copy)]
pub(crate) struct Criterion {
    branches: Branches,
    error_weight: f32,
    displacement_weight: f32,
    instance: InstanceView,
    /// The views that groups enter, and that refined groups leave.
    entering: FieldOfView,
    leaving: FieldOfView,
    /// Factor of errors outside the view.
    bias: f32,
    max_curl: f32,
    min_aspect_ratio: f32,
}

/// The parts of the criterion that count for an instance.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Branches {
    is_perspective: bool,
    is_similarity: bool,
    /// Whether the aspect ratio or the curl relaxes errors.
    is_relaxed: bool,
    counts_outside: bool,
    counts_error: bool,
    counts_displacement: bool,
}

impl Criterion {
    /// Screen-space errors count `error_weight` times.
    pub(crate) fn new(instance: &InstanceView, settings: &LodSettings, error_weight: f32) -> Self {
        let (weights, advanced) = (settings.error_weights(), &settings.advanced);
        let bias = match advanced.offscreen {
            Offscreen::Coarsest => None,
            Offscreen::OnAxis { bias } => Some(bias),
        };
        let entering = FieldOfView::of(&instance.camera);
        let branches = Branches {
            is_perspective: entering.is_perspective,
            is_similarity: instance.seen_stretch.is_none(),
            is_relaxed: advanced.max_curl != 0.0 || advanced.min_aspect_ratio > 0.0,
            counts_outside: bias.is_some(),
            counts_error: weights.counts_error,
            counts_displacement: weights.displacement_weight.is_some(),
        };
        Self {
            branches,
            error_weight,
            displacement_weight: weights.displacement_weight.unwrap_or(0.0),
            instance: *instance,
            entering,
            leaving: FieldOfView::of(&instance.kept_camera),
            bias: bias.unwrap_or(0.0),
            max_curl: advanced.max_curl,
            min_aspect_ratio: advanced.min_aspect_ratio,
        }
    }

    /// Calls `run` with this criterion, in which most branches are compile-time constants. Vectorized loops compute
    /// both sides of the other branches.
    #[inline(always)]
    pub(crate) fn with_known_branches<R>(&self, run: impl Fn(&Self) -> R) -> R {
        let known = |view: FieldOfView, is_perspective| FieldOfView {
            is_perspective,
            ..view
        };
        let run_with = |branches: Branches| {
            run(&Self {
                branches,
                entering: known(self.entering, branches.is_perspective),
                leaving: known(self.leaving, branches.is_perspective),
                ..*self
            })
        };
        let branches = self.branches;
        let usual = |is_perspective, counts_outside| Branches {
            is_perspective,
            is_similarity: true,
            is_relaxed: false,
            counts_outside,
            counts_error: true,
            counts_displacement: false,
        };
        let deviations = Branches {
            counts_error: false,
            counts_displacement: true,
            ..usual(true, branches.counts_outside)
        };
        match branches {
            _ if branches == usual(true, false) => run_with(usual(true, false)),
            _ if branches == usual(true, true) => run_with(usual(true, true)),
            _ if branches == usual(false, false) => run_with(usual(false, false)),
            _ if branches == usual(false, true) => run_with(usual(false, true)),
            _ if branches == deviations => run_with(deviations),
            Branches {
                is_perspective: false,
                ..
            } => run_with(Branches {
                is_perspective: false,
                ..branches
            }),
            Branches {
                is_relaxed: false, ..
            } => run_with(Branches {
                is_perspective: true,
                is_relaxed: false,
                ..branches
            }),
            Branches { .. } => run_with(Branches {
                is_perspective: true,
                ..branches
            }),
        }
    }

    /// The error to compare with the threshold, of a group that is not terminal.
    #[inline(always)]
    pub(crate) fn error_px(&self, group: CriterionInput, was_refined: bool) -> f32 {
        let [x, y, z, radius, error, deviation, m_x, m_y, m_z] = group;
        let mean_normal = Vec3::new(m_x, m_y, m_z);
        // The sphere in camera space, and the field over it.
        let seen = self.seen(Vec3::new(x, y, z), radius);
        let over = self.over_sphere(&seen, was_refined);
        // Factors of both errors.
        let stretch = self.stretch(&seen);
        let relaxation = self.relaxation(&seen);
        let (mut screen_error, mut displacement) = (0.0, 0.0);
        if self.branches.counts_error {
            // e √(c (4 V + 0.4 p)) w
            let strength = self.strength(&seen, &over);
            let facing = self.facing(mean_normal, &seen);
            let weight = Self::weight(facing, mean_normal);
            let error_px = error * stretch * (strength * weight).sqrt() * relaxation;
            let error_px = error_px * self.error_weight;
            screen_error = unless_infinite(strength, error_px);
        }
        if self.branches.counts_displacement {
            // d √(c / cos φ)
            let pixel_scale = self.pixel_scale(&seen, &over);
            let error_px = deviation * stretch * pixel_scale * relaxation;
            displacement = unless_infinite(pixel_scale, error_px) * self.displacement_weight;
        }
        // NaN if either error is NaN.
        let is_larger = (displacement < screen_error) | screen_error.is_nan();
        if is_larger {
            screen_error
        } else {
            displacement
        }
    }

    #[inline(always)]
    fn seen(&self, center: Vec3, radius: f32) -> SeenSphere {
        let center = self.instance.camera_from_local * center + self.instance.origin_in_camera;
        SeenSphere::new(center, self.instance.camera_per_local * radius)
    }

    /// The field over a sphere in the view that its group enters or, if it was refined, leaves.
    #[inline(always)]
    fn over_sphere(&self, seen: &SeenSphere, was_refined: bool) -> FieldOverSphere {
        // A group must not leave where it enters: the wider view may exclude more spheres that cross the camera plane.
        let is_outside =
            self.leaving.excludes(seen) | (self.entering.excludes(seen) & !was_refined);
        let (leaving, entering) = (self.leaving.corner_secant, self.entering.corner_secant);
        let view = FieldOfView {
            corner_secant: if was_refined { leaving } else { entering },
            ..self.entering
        };
        view.over_sphere(seen, is_outside)
    }

    /// The field's strength for the whole group: its bound over the sphere, or one sample if the field is flat enough.
    /// Outside the field of view, it is zero or the strength on the axis.
    #[inline(always)]
    fn strength(&self, seen: &SeenSphere, over: &FieldOverSphere) -> f32 {
        let px_per_unit = self.entering.px_per_unit;
        let on_axis = px_per_unit.x * px_per_unit.y * self.bias * self.bias;
        let on_axis = self.at_distance(on_axis, seen.distance * seen.distance);
        let bound = over.bound(self.entering.strength(over), on_axis);
        if self.branches.is_relaxed && self.branches.is_perspective && self.max_curl != 0.0 {
            return self
                .entering
                .sampled_where_flat(seen, over, self.max_curl, bound);
        }
        bound
    }

    /// Pixels per unit of a displacement across the sight ray, `√(c / cos φ)`, at most.
    #[inline(always)]
    fn pixel_scale(&self, seen: &SeenSphere, over: &FieldOverSphere) -> f32 {
        let on_axis = self.entering.px_per_unit.max_element() * self.bias;
        let on_axis = self.at_distance(on_axis, seen.distance);
        over.bound(self.entering.pixel_scale(over), on_axis)
    }

    /// The value of errors outside the view, which falls with `divisor` in a perspective view. It is zero without
    /// [`Offscreen::OnAxis`].
    #[inline(always)]
    fn at_distance(&self, on_axis: f32, divisor: f32) -> f32 {
        if !self.branches.counts_outside {
            0.0
        } else if self.branches.is_perspective {
            on_axis / divisor
        } else {
            on_axis
        }
    }

    /// `m·s` for a group's mean normal.
    #[inline(always)]
    fn facing(&self, mean_normal: Vec3, seen: &SeenSphere) -> f32 {
        // Against the sight ray, which is the same everywhere in an orthographic view.
        let turned = self.instance.normal_in_camera_from_local * mean_normal;
        let (along, distance) = self.sight_ray(seen);
        let away = turned.dot(along);
        if self.branches.is_similarity {
            return -away / distance;
        }
        // An instance that is not a similarity changes the normal's length.
        let length = turned.dot(turned).sqrt();
        let facing = -away * mean_normal.length() / (length * distance);
        if length > 0.0 { facing } else { 0.0 }
    }

    /// A vector along the sight ray, and its length.
    #[inline(always)]
    fn sight_ray(&self, seen: &SeenSphere) -> (Vec3, f32) {
        if self.branches.is_perspective {
            (seen.center, seen.distance)
        } else {
            (Vec3::Z, 1.0)
        }
    }

    /// `4 V + 0.4 p`.
    #[inline(always)]
    fn weight(facing: f32, mean_normal: Vec3) -> f32 {
        let variance = normal_variance(mean_normal);
        let flatness = facing * facing / silhouette_width(variance);
        larger(visible_weight(facing, variance), 0.0) + silhouette_weight(flatness)
    }

    /// The largest stretch across the sight rays of the sphere, in camera units per local unit. It is exact at the ray
    /// of the centre. For the other rays, `sin δ = r/ρ` times the largest stretch is added.
    #[inline(always)]
    fn stretch(&self, seen: &SeenSphere) -> f32 {
        let most = self.instance.camera_per_local;
        let (false, Some(stretch)) = (self.branches.is_similarity, &self.instance.seen_stretch)
        else {
            return most;
        };
        let (along, distance) = self.sight_ray(seen);
        let mut across = stretch.across(along * (1.0 / distance));
        if self.branches.is_perspective {
            across += most * (seen.radius / seen.distance);
        }
        smaller(across, most)
    }

    /// The factor of errors by `min_aspect_ratio`, from the largest aspect ratio in the visible part of a sphere.
    #[inline(always)]
    fn relaxation(&self, seen: &SeenSphere) -> f32 {
        let limit = self.min_aspect_ratio;
        if !(self.branches.is_relaxed && self.branches.is_perspective && limit > 0.0) {
            return 1.0;
        }
        let aspect = self.entering.aspect_ratio(seen);
        // The factor relaxes errors only below the limit.
        let relaxed = aspect / limit;
        if aspect < limit { relaxed } else { 1.0 }
    }
}

/// Infinite if a factor is infinite, even if another is 0.
#[inline(always)]
fn unless_infinite(factor: f32, error_px: f32) -> f32 {
    let is_infinite = factor >= f32::INFINITY;
    if is_infinite { factor } else { error_px }
}

/// `v` of the module's formula. Rounding may leave |m| slightly above 1.
#[inline(always)]
pub(crate) fn normal_variance(mean_normal: Vec3) -> f32 {
    (1.0 - mean_normal.length_squared()).max(0.0) * 0.25
}

/// `4 V`, which grows with the facing `μ`. Rounding may make it slightly negative for back faces.
#[inline(always)]
pub(crate) fn visible_weight(facing: f32, variance: f32) -> f32 {
    let root = (facing * facing + variance).sqrt();
    0.5 * VISIBLE_WEIGHT * (facing + root)
}

/// `2v + 0.005`, the divisor of `μ²` in `u`.
#[inline(always)]
pub(crate) fn silhouette_width(variance: f32) -> f32 {
    2.0 * variance + FLATNESS_FLOOR
}

/// `0.4 p` for `u`, with which it falls.
#[inline(always)]
pub(crate) fn silhouette_weight(u: f32) -> f32 {
    SILHOUETTE_WEIGHT * (1.0 / (1.0 + u + 0.5 * u * u))
}
