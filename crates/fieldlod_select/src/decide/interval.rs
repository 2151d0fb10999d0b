//! The test that tells both ways: which of eight groups are certainly below their thresholds and which
//! certainly above, wherever in a ball around it the camera stands and however it has turned to there.
//!
//! Points move by at most `D` in camera space, and then turn about the eye by at most `θ`. In perspective views
//! all lengths are local, those of camera space by the greatest stretch. With `X = φ + δ` the widest angle of the
//! sphere to the axis, `t² = ρ² − r²`:
//! ```text
//! |∇ X| = 1/t ≤ 1/(ρ − r)                           so  X ± β,  β = y + θ,  y = D/(ρ − r − D)
//! κ = 1/sec = max(cos X, 1/S)                        so  cos X ± (sin X β + β²/2)
//! depth = max(z − r, (ρ − r) κ),  |∇ depth| < 1.15   so  depth ± (1.15 D + (ρ + D) ((sin X + y) θ + θ²/2))
//! μ = m·s,  |∇ s| = 1/ρ                              so  μ ± y
//!
//! e² C W o < τ² κ depth²     below, with the least of the right and the most of the left; else above
//! d f    < τ  κ depth
//! ```
//! `|∇ ((ρ − r) cos X)|² ≤ 1 + (r/ρ) √((ρ − r)/(ρ + r)) ≤ 1.31`. A zoom by `z` (see [`crate::zoom`]) takes
//! `C`, `f`, `κ` and what the depth owes to it times `exp(±z)` at most, and a side nearer by `z ρ`. Above counts only where the sphere
//! certainly touches the view.
//!
//! What is no similarity shows errors by less than its greatest stretch `σ`, by how the sight ray lies to it:
//! ```text
//! q = min(√λ(s)/σ + r/ρ, 1)                         so  q ± 2 y,   as  |√λ(s) − √λ(s')| ≤ σ |s − s'|
//! ```
//! and its mean normals are turned and made as long as they were, which neither moves nor turns of the eye change.
//!
//! In orthographic views lengths are those of camera space, the field's strength is the same everywhere, `s` is the
//! axis, and moves change nothing but on which side of the view's edges something is:
//! ```text
//! μ ± θ,   q ± 2 θ,   κ = depth = 1
//! ```
//! A zoom takes the sides nearer by `E (exp(z) − 1)`, with `E` their [reach](crate::sides::Sides::reach).
//!
//! With D no more than what rounding moves a point by, the test decides most
//! groups for less than the criterion costs.

use camera_field::Camera;
use glam::Vec3;
use wide::f32x8;

use super::local_view::LocalView;
use crate::criterion::{VISIBLE_WEIGHT, silhouette_weight, silhouette_width, visible_weight};
use crate::error_bounds::ErrorBounds;
use crate::lane::{Lane, M3, V3, mask_of};
use crate::settings::{Offscreen, Thresholds};
use crate::sides::LensSides;
use crate::stretch::SeenStretch;
use crate::table::GroupTable;
use crate::validity::Tolerance;
use crate::view_parts::ViewParts;
use crate::zoom::GROWTH;

const ZERO: f32x8 = f32x8::splat(0.0);
/// Relative allowance for rounding, and for what a similarity may differ from one.
const ALLOWANCE: f32 = 2e-3;
/// The same of cosines.
const COSINE_ALLOWANCE: f32 = 4e-6;
/// The angle of a turn is at most so many times [the change of a unit vector](Tolerance::turned).
const ANGLE_PER_TURN: f32 = 1.02;
/// What rounding may take off `q`, and off cosines of what is no similarity, which may be one after a turn: the latter
/// grows with how uneven the map is, up to this.
const STRETCH_ALLOWANCE: f32 = 4e-3;
const UNEVEN_COSINE_ALLOWANCE: f32 = 2e-4;
const MOST_UNEVEN: f32 = 50.0;
/// Greatest stretches whose fourth powers, and in orthographic views squares, can be trusted.
const TRUSTED_STRETCHES: std::ops::Range<f32> = 1e-5..1e5;
/// How fast depth changes at most.
const DEPTH_SLOPE: f32 = 1.15;
/// Errors whose squares can be trusted.
const LARGEST_ERROR: f32 = 1e12;

/// Which lanes are certain, and how.
pub(super) struct Certain {
    pub(super) below: f32x8,
    pub(super) above: f32x8,
}

/// The test of one instance in one view under one set of settings.
pub(super) struct IntervalTest<'a> {
    parts: &'a ViewParts<'a>,
    eye: V3<f32x8>,
    /// To camera space in the test's lengths.
    camera_from_local: M3<f32x8>,
    /// What those are of local ones.
    per_local: f32,
    /// What normals count along the axis of an orthographic view.
    facing_axis: Option<V3<f32x8>>,
    /// [`CameraParts`](crate::view_parts::CameraParts)' for errors in the test's lengths.
    constant_px2: Option<f32x8>,
    focal_px: Option<f32x8>,
    /// `None` for a similarity.
    uneven: Option<Uneven>,
    /// What rounding may move points by, and take off cosines.
    rounding: f32,
    cosine_allowance: f32x8,
    /// `D` and `θ` of the module's formulas.
    max_move: f32x8,
    max_turn: f32x8,
    /// `z` of the formulas times what the sides owe to it besides the distance, its factors `1 − z` and `1 + 1.3 z`,
    /// and what all factors come to in the comparison.
    max_zoom: f32x8,
    depth_factors: [f32x8; 2],
    factors: [f32x8; 2],
    thresholds: Thresholds,
    tells_above: bool,
}

/// What an instance that is no similarity does to lengths and normals.
struct Uneven {
    stretch: SeenStretch,
    per_largest: f32x8,
    normal_in_camera_from_local: M3<f32x8>,
}

/// Eight groups from an eye that may be anywhere near by.
struct SeenInterval {
    /// In camera space, as [`LensSides`] take it, and its depth, infinite in an orthographic view.
    center: V3<f32x8>,
    ahead: f32x8,
    radius: f32x8,
    /// From the eye at least and at most.
    distance: [f32x8; 2],
    /// Whether the eye stays out of the sphere, farther than what the bounds need; and inside.
    is_apart: f32x8,
    holds_eye: f32x8,
    /// How far it moves at most, turns included.
    max_shift: f32x8,
    /// `y`: how much its direction changes at most for one who does not turn; all of that in an orthographic view.
    change: f32x8,
    /// `κ` at least and at most, and depths.
    cosine: [f32x8; 2],
    depth: [f32x8; 2],
    /// `μ = m·s`.
    facing: f32x8,
    /// `q` at least and at most.
    stretch: [f32x8; 2],
}

/// How spheres lie to the edge of the view, where that is certain.
struct Placement {
    outside: f32x8,
    inside: f32x8,
}

impl Uneven {
    /// `m·s`, of mean normals as long as they were.
    #[inline]
    fn facing(&self, table: &GroupTable, block: usize, along: V3<f32x8>) -> f32x8 {
        let turned = self
            .normal_in_camera_from_local
            .of(table.facings.normal(block));
        let length = turned.dot(turned).sqrt();
        let facing = -turned.dot(along) * table.normal_length[block] / length;
        f32x8::choose(ZERO.is_below(length), facing, ZERO)
    }

    /// `q` at least and at most, of spheres of so many times their distance in radius.
    #[inline]
    fn stretch(&self, along: V3<f32x8>, radius: f32x8, change: f32x8) -> [f32x8; 2] {
        let one = f32x8::splat(1.0);
        let seen = self.stretch.across(along) * self.per_largest + radius;
        let change = change * f32x8::splat(2.0) + f32x8::splat(STRETCH_ALLOWANCE);
        // Nothing where that is not a number.
        let least = one.smaller(seen) - change;
        [least.larger(ZERO), (seen + change).smaller(one)]
    }
}

impl<'a> IntervalTest<'a> {
    /// `None` where the instance is nearly flat, or sizes are beyond what squares can hold.
    #[inline]
    pub(super) fn new(
        local: &LocalView<'a>,
        bounds: &ErrorBounds,
        thresholds: Thresholds,
    ) -> Option<Self> {
        let LocalView {
            instance, parts, ..
        } = *local;
        // Deviations may be unmeasured where they do not count.
        let camera = &parts.entering;
        let deviation = camera.focal_px.map_or(0.0, |_| bounds.deviation);
        let is_orthographic = matches!(instance.camera, Camera::Orthographic(_));
        let is_even = instance.seen_stretch.is_none();
        let is_usable = (is_even || local.unevenness < MOST_UNEVEN)
            && (is_even && !is_orthographic
                || TRUSTED_STRETCHES.contains(&instance.camera_per_local))
            && local.has_usable_size
            && bounds.error_weighed.max(deviation) < LARGEST_ERROR;
        let per_largest = 1.0 / instance.camera_per_local;
        let per_local = if is_orthographic {
            instance.camera_per_local
        } else {
            1.0
        };
        let in_lengths = instance.camera_from_local * (per_local * per_largest);
        let uneven = instance.seen_stretch.map(|stretch| Uneven {
            stretch,
            per_largest: f32x8::splat(per_largest),
            normal_in_camera_from_local: M3::splat(&instance.normal_in_camera_from_local),
        });
        let (unevenness, cosine_allowance) = match uneven {
            None => (1.0, 0.0),
            Some(_) => (local.unevenness, UNEVEN_COSINE_ALLOWANCE),
        };
        let rounding = local.rounding * unevenness;
        let cosine_allowance = cosine_allowance + COSINE_ALLOWANCE * unevenness;
        is_usable.then(|| Self {
            parts,
            eye: local.eye,
            camera_from_local: M3::splat(&in_lengths),
            per_local,
            facing_axis: is_orthographic
                .then(|| V3::splat(instance.normal_in_camera_from_local.transpose().z_axis)),
            constant_px2: camera
                .constant_px2
                .map(|c| f32x8::splat(c * per_local * per_local)),
            focal_px: camera
                .focal_px
                .map(|focal_px| f32x8::splat(focal_px * per_local)),
            uneven,
            rounding,
            cosine_allowance: f32x8::splat(cosine_allowance),
            // Rounding at this place and at the other.
            max_move: f32x8::splat((local.slack - local.rounding + 2.0 * rounding) * per_local),
            // In a perspective view it is in the moves.
            max_turn: match is_orthographic {
                true => f32x8::splat(local.turned * ANGLE_PER_TURN),
                false => ZERO,
            },
            max_zoom: ZERO,
            depth_factors: [f32x8::splat(1.0); 2],
            factors: [1.0 + ALLOWANCE, 1.0 - ALLOWANCE].map(f32x8::splat),
            thresholds,
            // What relaxes the criterion of perspective views makes it smaller than these bounds; with no error
            // at all nothing is above.
            tells_above: (is_orthographic
                || parts.settings.max_curl == 0.0 && parts.settings.min_aspect_ratio == 0.0)
                && (camera.constant_px2.is_some() || camera.focal_px.is_some()),
        })
    }

    /// Asks for all poses within some of this one from now on.
    pub(super) fn tolerate(&mut self, local: &LocalView, tolerance: &Tolerance) {
        let moved = tolerance.moved / local.instance.camera_per_local * 1.001;
        self.max_move = f32x8::splat((self.rounding * 2.0 + moved) * self.per_local);
        self.max_turn = f32x8::splat(tolerance.turned * ANGLE_PER_TURN);
        let (less, more) = (1.0 - tolerance.zoomed, 1.0 + GROWTH * tolerance.zoomed);
        self.max_zoom = f32x8::splat(match self.facing_axis {
            None => tolerance.zoomed,
            Some(_) => GROWTH * tolerance.zoomed * self.parts.reach,
        });
        self.depth_factors = [less, more].map(f32x8::splat);
        self.factors = [
            (1.0 + ALLOWANCE) * more * more / less,
            (1.0 - ALLOWANCE) * less * less / more,
        ]
        .map(f32x8::splat);
    }

    /// What is certain of the groups of one block, of which `was_refined` has the bits and `share` the
    /// visible shares.
    #[inline]
    pub(super) fn certain(
        &self,
        table: &GroupTable,
        block: usize,
        was_refined: u32,
        share: f32x8,
    ) -> Certain {
        let was = mask_of(was_refined);
        let either = |entering: f32, leaving: f32| {
            f32x8::choose(was, f32x8::splat(leaving), f32x8::splat(entering))
        };
        let threshold_px = either(
            self.thresholds.refine_above_px,
            self.thresholds.coarsen_below_px,
        );
        let least_cosine = match was_refined {
            0 => f32x8::splat(self.parts.entering.least_cosine),
            _ => either(
                self.parts.entering.least_cosine,
                self.parts.leaving().least_cosine,
            ),
        };
        let seen = match self.facing_axis {
            None => self.seen(table, block, least_cosine),
            Some(axis) => self.seen_along(axis, table, block),
        };
        let placement = self.placement(&seen, was_refined, was);
        // In the view.
        let allowed = |side: usize| threshold_px * seen.cosine[side] * seen.depth[side];
        let allowed_squared = |side: usize| allowed(side) * threshold_px * seen.depth[side];
        let sides = self.compare(&seen, table, block, share, allowed_squared, allowed);
        let holds_eye = seen.holds_eye & threshold_px.is_below(f32x8::infinity());
        let mut certain = Certain {
            below: seen.is_apart & sides.below,
            above: holds_eye | (seen.is_apart & placement.inside & sides.above),
        };
        // Outside of it.
        match self.parts.settings.offscreen {
            Offscreen::Coarsest => certain.below |= placement.outside,
            Offscreen::OnAxis { bias } => {
                // As far away as it counts.
                let threshold_px = threshold_px / f32x8::splat(bias);
                let on_axis = self.compare_on_axis(&seen, table, block, share, threshold_px);
                certain.below |= seen.is_apart & placement.outside & on_axis.below;
                // No place in the view shows less than one on its axis.
                certain.above |= seen.is_apart & on_axis.above;
            }
        }
        if !self.tells_above {
            certain.above = ZERO;
        }
        // What is hidden for certain shows nothing.
        let is_hidden = share.is_at_most(ZERO);
        certain.below |= is_hidden;
        certain.above &= !is_hidden;
        certain
    }

    #[inline]
    fn seen(&self, table: &GroupTable, block: usize, least_cosine: f32x8) -> SeenInterval {
        // The sphere in camera space.
        let from_eye = table.groups.center(block).minus(self.eye);
        let center = self.camera_from_local.of(from_eye);
        let V3 { x, y, z } = center;
        let radius = table.groups.radius[block];
        let off_axis_squared = x * x + y * y;
        let distance = (off_axis_squared + z * z).sqrt();
        let inverse_distance = f32x8::splat(1.0) / distance;
        let gap = distance - radius;
        let nearest_gap = gap - self.max_move;
        // cos X, and what the moves and turns of the eye do to it and to the depth.
        let tangent_length = (gap * (distance + radius)).sqrt();
        let off_axis = off_axis_squared.sqrt();
        let per_square = inverse_distance * inverse_distance;
        let cosine = (z * tangent_length - off_axis * radius) * per_square;
        let sine = (off_axis * tangent_length + z * radius) * per_square;
        let sine = sine.abs().larger(off_axis * inverse_distance);
        let move_angle = self.max_move / nearest_gap;
        let angle = move_angle + self.max_turn;
        let half = f32x8::splat(0.5);
        let change = angle * (sine + angle * half) + self.cosine_allowance;
        let turn = self.max_turn * (sine + move_angle + self.max_turn * half);
        let farthest = distance + self.max_move;
        let slope = self.max_move * f32x8::splat(DEPTH_SLOPE) + farthest * turn;
        let ahead = z - radius;
        let depth = ahead.larger(gap * cosine.larger(least_cosine));
        let [less, more] = self.depth_factors;
        let along = center.times(inverse_distance);
        let (facing, stretch) = match &self.uneven {
            None => {
                let facing = -table.facings.normal(block).dot(from_eye) * inverse_distance;
                (facing, [f32x8::splat(1.0); 2])
            }
            Some(uneven) => (
                uneven.facing(table, block, along),
                uneven.stretch(along, radius * inverse_distance, move_angle),
            ),
        };
        SeenInterval {
            center,
            ahead: z,
            radius,
            distance: [distance - self.max_move, farthest],
            is_apart: self.max_move.is_below(nearest_gap),
            holds_eye: (distance + self.max_move).is_below(radius * f32x8::splat(1.0 - ALLOWANCE)),
            max_shift: self.max_move + farthest * (self.max_turn + self.max_zoom),
            change: move_angle + self.cosine_allowance,
            cosine: [
                (cosine - change).larger(least_cosine),
                (cosine + change).larger(least_cosine),
            ],
            depth: [(depth * less - slope).larger(ZERO), depth * more + slope],
            facing,
            stretch,
        }
    }

    /// The same in an orthographic view.
    #[inline]
    fn seen_along(&self, axis: V3<f32x8>, table: &GroupTable, block: usize) -> SeenInterval {
        let one = f32x8::splat(1.0);
        let from_eye = table.groups.center(block).minus(self.eye);
        let center = self.camera_from_local.of(from_eye);
        let radius = table.groups.radius[block] * f32x8::splat(self.per_local);
        let farthest = center.dot(center).sqrt() + self.max_move;
        let (facing, stretch) = match &self.uneven {
            None => (-table.facings.normal(block).dot(axis), [one; 2]),
            Some(uneven) => {
                let along = V3::splat(Vec3::Z);
                let stretch = uneven.stretch(along, ZERO, self.max_turn);
                (uneven.facing(table, block, along), stretch)
            }
        };
        SeenInterval {
            center: V3 { z: one, ..center },
            ahead: f32x8::infinity(),
            radius,
            distance: [one; 2],
            is_apart: ZERO.is_at_most(radius) & (farthest + radius).is_below(f32x8::infinity()),
            holds_eye: ZERO,
            max_shift: self.max_move + farthest * self.max_turn + self.max_zoom,
            change: self.max_turn + self.cosine_allowance,
            cosine: [one; 2],
            depth: [one; 2],
            facing,
            stretch,
        }
    }

    /// Below and above of groups that count as on the axis.
    #[inline]
    fn compare_on_axis(
        &self,
        seen: &SeenInterval,
        table: &GroupTable,
        block: usize,
        share: f32x8,
        threshold_px: f32x8,
    ) -> Certain {
        let allowed = |side: usize| threshold_px * seen.distance[side];
        let allowed_squared = |side: usize| allowed(side) * allowed(side);
        self.compare(seen, table, block, share, allowed_squared, allowed)
    }

    /// Whether the error keeps below `allowed(0)`, or above `allowed(1)`.
    #[inline]
    fn compare(
        &self,
        seen: &SeenInterval,
        table: &GroupTable,
        block: usize,
        share: f32x8,
        allowed_squared: impl Fn(usize) -> f32x8,
        allowed: impl Fn(usize) -> f32x8,
    ) -> Certain {
        let [more, less] = self.factors;
        let [least_stretch, most_stretch] = seen.stretch;
        let mut below = ZERO.is_at_most(ZERO);
        let mut above = ZERO;
        if let Some(constant) = self.constant_px2 {
            let shows = |stretch: f32x8| {
                let error = table.facings.error[block] * stretch;
                error * error * constant * share
            };
            let [least, most] = weights(seen, table.normal_variance[block]);
            below = (shows(most_stretch) * most * more).is_below(allowed_squared(0));
            above = allowed_squared(1).is_below(shows(least_stretch) * least * less);
        }
        if let Some(focal_px) = self.focal_px {
            let shows = table.groups.deviation[block] * focal_px;
            below &= (shows * most_stretch * more).is_below(allowed(0));
            above |= allowed(1).is_below(shows * least_stretch * less);
        }
        Certain { below, above }
    }

    /// Where the groups are in the view that they enter or, if they were refined, leave.
    #[inline]
    fn placement(&self, seen: &SeenInterval, was_refined: u32, was: f32x8) -> Placement {
        let entered = self.placement_in(seen, self.parts.entering.lens_sides());
        // What touches the view that is entered, and is wholly ahead, touches the wider one too.
        let ahead = seen.max_shift.is_below(seen.ahead - seen.radius);
        let entered = Placement {
            inside: entered.inside & ahead,
            ..entered
        };
        if was_refined == 0 || !self.parts.has_margin() {
            return entered;
        }
        // What was refined leaves the wider view; nothing leaves where it enters.
        let left = self.placement_in(seen, self.parts.leaving().lens_sides());
        Placement {
            outside: f32x8::choose(was, left.outside, entered.outside),
            inside: f32x8::choose(was, left.inside, entered.inside),
        }
    }

    #[inline]
    fn placement_in(&self, seen: &SeenInterval, sides: &LensSides<f32x8>) -> Placement {
        let inside_by = sides.least_inside(seen.center);
        let at_most = seen.radius * f32x8::splat(1.0 + ALLOWANCE) + seen.max_shift;
        let at_least = seen.radius * f32x8::splat(1.0 - ALLOWANCE) - seen.max_shift;
        Placement {
            outside: (inside_by + at_most).is_below(ZERO),
            inside: ZERO.is_below(inside_by + at_least) & ZERO.is_below(seen.ahead + at_least),
        }
    }
}

/// The criterion's weight `4 V + 0.4 p` at least and at most.
#[inline]
fn weights(seen: &SeenInterval, variance: f32x8) -> [f32x8; 2] {
    let (facing, change) = (seen.facing, seen.change);
    // Rounding, where what is turned away cancels.
    let most_visible = visible_weight(facing + change, variance) + f32x8::splat(2e-6);
    // V grows no faster than what faces.
    let least_visible =
        most_visible - f32x8::splat(2.0 * VISIBLE_WEIGHT) * change - f32x8::splat(4e-6);
    let per_square = f32x8::splat(1.0) / silhouette_width(variance);
    let silhouette = |facing: f32x8| silhouette_weight(facing * facing * per_square);
    let away = facing.abs();
    [
        least_visible.larger(ZERO) + silhouette(away + change),
        most_visible + silhouette((away - change).larger(ZERO)),
    ]
}
