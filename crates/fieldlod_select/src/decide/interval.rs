//! The test that tells both ways: which of eight groups are certainly below their thresholds and which
//! certainly above, wherever in a ball around it the camera stands and however it has turned to there.
//!
//! For similarities and perspective views, which most are. A point goes at most a way `D` in camera space;
//! all lengths are local. With `X = φ + δ` the widest angle of the sphere to the axis, `t² = ρ² − r²`:
//! ```text
//! |∇ cos X| = 1/t ≤ 1/(ρ − r)                       so  cos X ± y,  y = D/(ρ − r − D)
//! κ = 1/sec = max(cos X, 1/S)
//! depth = max(z − r, (ρ − r) κ),  |∇ depth| < 1.15   so  depth ± 1.15 D
//! μ = m·s,  |∇ s| = 1/ρ                              so  μ ± y
//!
//! e² C W < τ² κ depth²      below, with the least of the right and the most of the left; else above
//! d f    < τ  κ depth
//! ```
//! `|∇ ((ρ − r) cos X)|² ≤ 1 + (r/ρ) √((ρ − r)/(ρ + r)) ≤ 1.31`. Above counts only where the sphere
//! certainly touches the view. The same with D no more than what rounding moves a point by decides
//! most groups for less than the criterion costs.

mod edge;

use camera_field::Camera;
use glam::Mat3;
use wide::f32x8;

use super::conservative::InLocal;
use crate::criterion::{FLATNESS_FLOOR, SILHOUETTE_WEIGHT, VISIBLE_WEIGHT};
use crate::settings::Thresholds;
use crate::table::GroupTable;
use crate::{InstanceView, LodSettings, Offscreen};
pub(crate) use edge::IntervalView;
use edge::{ByMemory, Sides, lanes, least_inside};

const ZERO: f32x8 = f32x8::splat(0.0);
/// Relative allowance for rounding, and for what a similarity may differ from one.
const ALLOWANCE: f32 = 2e-3;
/// The same of cosines.
const COSINE_ALLOWANCE: f32 = 4e-6;
/// Of the slope of depth.
const DEPTH_SLOPE: f32 = 1.15;
/// Sizes whose squares can be trusted.
const SIZES: std::ops::Range<f32> = 1e-4..1e12;

/// Which lanes are certain, and how.
pub(crate) struct Certain {
    pub(crate) below: f32x8,
    pub(crate) above: f32x8,
}

pub(crate) struct IntervalTest<'a> {
    view: &'a IntervalView,
    eye: [f32x8; 3],
    /// Rows: camera space, in local lengths.
    camera_from_local: [[f32x8; 3]; 3],
    way: f32x8,
    /// `C` and `f`, where asked.
    of_error: Option<f32>,
    of_deviation: Option<f32>,
    threshold_px: ByMemory,
    offscreen: Offscreen,
    tells_above: bool,
}

impl<'a> IntervalTest<'a> {
    /// `None` where the instance is no similarity, the view is orthographic, or sizes are beyond what
    /// squares can hold.
    pub(super) fn new(
        view: &'a IntervalView,
        table: &GroupTable,
        instance: &InstanceView,
        in_local: &InLocal,
        settings: &LodSettings,
        thresholds: Thresholds,
    ) -> Option<Self> {
        let Camera::Perspective(camera) = &instance.camera else {
            return None;
        };
        let whole = &table.whole;
        let is_usable = instance.seen_stretch.is_none()
            && SIZES.contains(&in_local.size)
            && whole.error_weighed.max(whole.deviation) < SIZES.end;
        if !is_usable {
            return None;
        }
        let focal = camera.focal_px.x.max(camera.focal_px.y);
        let constant = camera.constant_px2();
        let criterion = settings.criterion();
        Some(Self {
            view,
            eye: in_local.eye.to_array().map(f32x8::splat),
            camera_from_local: rows(&instance.camera_from_local, 1.0 / instance.camera_per_local),
            // Rounding at this place and at the other.
            way: f32x8::splat(in_local.slack + in_local.rounding),
            of_error: criterion.counts_error.then_some(constant),
            of_deviation: criterion.displacement_weight.map(|weight| focal * weight),
            threshold_px: ByMemory {
                entering: thresholds.refine_above_px,
                leaving: thresholds.coarsen_below_px,
            },
            offscreen: settings.offscreen,
            // What relaxes the criterion makes it smaller than these bounds.
            tells_above: settings.max_curl == 0.0 && settings.min_aspect_ratio == 0.0,
        })
    }

    /// Of the groups of one block, of which `was_refined` has the bits.
    #[inline]
    pub(super) fn certain(&self, table: &GroupTable, block: usize, was_refined: u32) -> Certain {
        let seen = self.seen(table, block, was_refined);
        let threshold = lanes(self.threshold_px, was_refined);
        let (below, above) = self.sides_of(&seen, table, block, threshold);
        let on_axis = self.offscreen == Offscreen::OnAxis;
        let beyond = self.beyond(&seen, was_refined);
        let mut certain = Certain {
            below: seen.is_apart & below,
            above: seen.holds_eye & threshold.simd_lt(f32x8::splat(f32::INFINITY)),
        };
        if on_axis {
            let (far_below, far_above) = self.sides_on_axis(&seen, table, block, threshold);
            certain.below |= seen.is_apart & beyond.outside & far_below;
            // No place in the view shows less than one on its axis.
            certain.above |= seen.is_apart & far_above;
        } else {
            certain.below |= beyond.outside;
        }
        certain.above |= seen.is_apart & beyond.inside & above;
        if !self.tells_above {
            certain.above = ZERO;
        }
        certain
    }
}

/// Eight groups from an eye that may be anywhere near by.
struct Seen {
    /// In camera space, local lengths.
    center: [f32x8; 3],
    radius: f32x8,
    distance: f32x8,
    /// Whether the eye stays out of the sphere, farther than what the bounds need; and inside.
    is_apart: f32x8,
    holds_eye: f32x8,
    /// How much cosines at most change: `y`.
    change: f32x8,
    /// `1/sec` at least and at most, and depths.
    cosine: [f32x8; 2],
    depth: [f32x8; 2],
    /// `m·s`.
    facing: f32x8,
}

/// How spheres lie to the edge of the view, where that is certain.
struct Beyond {
    outside: f32x8,
    inside: f32x8,
}

impl IntervalTest<'_> {
    #[inline]
    fn seen(&self, table: &GroupTable, block: usize, was_refined: u32) -> Seen {
        let groups = &table.groups;
        let from_eye = [
            groups.x[block] - self.eye[0],
            groups.y[block] - self.eye[1],
            groups.z[block] - self.eye[2],
        ];
        let [right, down, ahead] = &self.camera_from_local;
        let center = [
            dot(right, &from_eye),
            dot(down, &from_eye),
            dot(ahead, &from_eye),
        ];
        let [x, y, z] = center;
        let radius = groups.radius[block];
        let off_axis_squared = x * x + y * y;
        let distance = (off_axis_squared + z * z).sqrt();
        let inverse_distance = f32x8::splat(1.0) / distance;
        let gap = distance - radius;
        let nearest_gap = gap - self.way;
        let change = self.way / nearest_gap + f32x8::splat(COSINE_ALLOWANCE);
        let tangent_length = (gap * (distance + radius)).sqrt();
        let cosine = (z * tangent_length - off_axis_squared.sqrt() * radius)
            * (inverse_distance * inverse_distance);
        let [widest, narrowest] = self.least_cosines(was_refined);
        let ahead = z - radius;
        let [normal_x, normal_y, normal_z] = &table.facings.normal;
        let normal = [normal_x[block], normal_y[block], normal_z[block]];
        let slope = self.way * f32x8::splat(DEPTH_SLOPE);
        Seen {
            center,
            radius,
            distance,
            is_apart: nearest_gap.simd_gt(self.way),
            holds_eye: (distance + self.way).simd_lt(radius * f32x8::splat(1.0 - ALLOWANCE)),
            change,
            cosine: [
                larger(cosine - change, widest),
                larger(cosine + change, narrowest),
            ],
            depth: [
                larger(larger(ahead, gap * larger(cosine, widest)) - slope, ZERO),
                larger(ahead, gap * larger(cosine, narrowest)) + slope,
            ],
            facing: -dot(&normal, &from_eye) * inverse_distance,
        }
    }

    /// `1/S` at least and at most, of the views of a block's groups.
    #[inline]
    fn least_cosines(&self, was_refined: u32) -> [f32x8; 2] {
        let ByMemory { entering, leaving } = self.view.least_cosine;
        [
            f32x8::splat(if was_refined == 0 { entering } else { leaving }),
            f32x8::splat(if was_refined == 0xff {
                leaving
            } else {
                entering
            }),
        ]
    }

    /// Below and above, of groups in the view.
    #[inline]
    fn sides_of(
        &self,
        seen: &Seen,
        table: &GroupTable,
        block: usize,
        threshold: f32x8,
    ) -> (f32x8, f32x8) {
        let allowed = |side: usize| threshold * seen.cosine[side] * seen.depth[side];
        let allowed_squared = |side: usize| allowed(side) * threshold * seen.depth[side];
        self.compare(seen, table, block, allowed_squared, allowed)
    }

    /// The same on the axis.
    #[inline]
    fn sides_on_axis(
        &self,
        seen: &Seen,
        table: &GroupTable,
        block: usize,
        threshold: f32x8,
    ) -> (f32x8, f32x8) {
        let distance = [seen.distance - self.way, seen.distance + self.way];
        let allowed = |side: usize| threshold * distance[side];
        self.compare(
            seen,
            table,
            block,
            |side| allowed(side) * allowed(side),
            allowed,
        )
    }

    /// Whether the error keeps below `allowed(0)`, and above `allowed(1)`.
    #[inline]
    fn compare(
        &self,
        seen: &Seen,
        table: &GroupTable,
        block: usize,
        allowed_squared: impl Fn(usize) -> f32x8,
        allowed: impl Fn(usize) -> f32x8,
    ) -> (f32x8, f32x8) {
        let (more, less) = (f32x8::splat(1.0 + ALLOWANCE), f32x8::splat(1.0 - ALLOWANCE));
        let mut below = ZERO.simd_eq(ZERO);
        let mut above = ZERO;
        if let Some(constant) = self.of_error {
            let error = table.facings.error[block];
            let shows = error * error * f32x8::splat(constant);
            let [least, most] = weights(seen, table.normal_variance[block]);
            below = (shows * most * more).simd_lt(allowed_squared(0));
            above = (shows * least * less).simd_gt(allowed_squared(1));
        }
        if let Some(focal) = self.of_deviation {
            let shows = table.groups.deviation[block] * f32x8::splat(focal);
            below &= (shows * more).simd_lt(allowed(0));
            above |= (shows * less).simd_gt(allowed(1));
        }
        (below, above)
    }

    #[inline]
    fn beyond(&self, seen: &Seen, was_refined: u32) -> Beyond {
        let entered = self.beyond_sides(seen, &self.view.entering);
        // What touches the view that is entered, and is wholly ahead, touches the wider one too.
        let ahead = (seen.center[2] - seen.radius).simd_gt(self.way);
        let entered = Beyond {
            inside: entered.inside & ahead,
            ..entered
        };
        match &self.view.leaving {
            // What was refined leaves the wider view; nothing leaves where it enters.
            Some(sides) if was_refined != 0 => {
                let left = self.beyond_sides(seen, sides);
                let was = lanes(ByMemory::BIT, was_refined).simd_gt(ZERO);
                Beyond {
                    outside: was.bitselect(left.outside, entered.outside),
                    inside: was.bitselect(left.inside, entered.inside),
                }
            }
            _ => entered,
        }
    }

    #[inline]
    fn beyond_sides(&self, seen: &Seen, sides: &Sides) -> Beyond {
        let inside_by = least_inside(sides, seen.center);
        let reach = seen.radius * f32x8::splat(1.0 + ALLOWANCE) + self.way;
        let within = seen.radius * f32x8::splat(1.0 - ALLOWANCE) - self.way;
        let behind_by = seen.center[2] + within;
        Beyond {
            outside: (inside_by + reach).simd_lt(ZERO),
            inside: (inside_by + within).simd_gt(ZERO) & behind_by.simd_gt(ZERO),
        }
    }
}

/// `4 V + 0.4 p` at least and at most.
#[inline]
fn weights(seen: &Seen, variance: f32x8) -> [f32x8; 2] {
    let (facing, change) = (seen.facing, seen.change);
    let most_facing = facing + change;
    let root = (most_facing * most_facing + variance).sqrt();
    // Rounding, where what is turned away cancels.
    let visible = f32x8::splat(0.5 * VISIBLE_WEIGHT) * (most_facing + root) + f32x8::splat(2e-6);
    // V grows no faster than what faces.
    let least_visible = visible - f32x8::splat(2.0 * VISIBLE_WEIGHT) * change;
    let silhouette = |facing: f32x8| {
        let width = f32x8::splat(2.0) * variance + f32x8::splat(FLATNESS_FLOOR);
        let squared = facing * facing;
        let width_squared = width * width;
        let sum = width_squared + width * squared + f32x8::splat(0.5) * squared * squared;
        f32x8::splat(SILHOUETTE_WEIGHT) * (width_squared / sum)
    };
    let away = facing.abs();
    [
        larger(least_visible - f32x8::splat(4e-6), ZERO) + silhouette(away + change),
        visible + silhouette(larger(away - change, ZERO)),
    ]
}

#[inline]
fn dot(a: &[f32x8; 3], b: &[f32x8; 3]) -> f32x8 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The larger of two numbers; the second where the first is NaN.
#[inline]
fn larger(a: f32x8, b: f32x8) -> f32x8 {
    a.simd_gt(b).bitselect(a, b)
}

fn rows(m: &Mat3, scale: f32) -> [[f32x8; 3]; 3] {
    let turned = m.transpose() * scale;
    [turned.x_axis, turned.y_axis, turned.z_axis].map(|row| row.to_array().map(f32x8::splat))
}
