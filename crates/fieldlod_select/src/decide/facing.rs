//! The test that knows depth and facing, without a quotient: for similarities and perspective views,
//! which most are.
//!
//! With `sec ≤ (ρ + r)/(z − r)` and `sec ≤ S`, `z_min ≥ z − r`, and `W ≤ 4 (max(m·s, 0) + ½√v + 0.1)`,
//! all in local space, the squared screen-space error is below τ² if
//! ```text
//! X = (2 e f/τ)² (max(−m·(p − eye), 0) + (½√v + 0.1) ρ),    Y = ρ (z − r)²
//! X (ρ + r) < Y (z − r)   or   X S < Y
//! ```
//! For eight groups at once, `m` is the mean of theirs, the weight beside it counts by how much they
//! differ, and the sphere around theirs has the place of theirs. The displacement is below τ if
//! ```text
//! (d f/τ) (ρ + r) < (z − r)²   or   (d f/τ) S < z − r
//! ```

use wide::f32x8;

use super::local_view::LocalView;
use crate::criterion::VISIBLE_WEIGHT;
use crate::error_scale::ROUNDING_ALLOWANCE;
use crate::lane::{Lane, V3};
use crate::table::{BoundsLanes, FacingLanes, GroupTable};
use crate::view_parts::CameraParts;

/// The test of one instance against one threshold.
pub(super) struct FacingTest {
    eye: V3<f32x8>,
    /// The view's axis, a hair short.
    axis: V3<f32x8>,
    /// `2 f/τ` for the screen-space error, `f/τ` for the displacement, where they count.
    error: Option<f32x8>,
    deviation: Option<f32x8>,
    secant: f32x8,
    slack: f32x8,
}

impl FacingTest {
    #[inline]
    pub(super) fn new(local: &LocalView, camera: &CameraParts, threshold_px: f32) -> Self {
        let per_px = |scale: f32| f32x8::splat(scale * (ROUNDING_ALLOWANCE / threshold_px));
        let of_error = |constant_px2: f32| per_px((constant_px2 * VISIBLE_WEIGHT).sqrt());
        let axis = local.instance.camera_from_local.transpose().z_axis;
        Self {
            eye: local.eye,
            // Similarities are so but for 1e-4, which the other slacks cover too.
            axis: V3::splat(axis * (0.9998 / local.instance.camera_per_local)),
            error: camera.constant_px2.map(of_error),
            deviation: camera.focal_px.map(per_px),
            secant: f32x8::splat(camera.secant),
            slack: f32x8::splat(local.slack),
        }
    }

    /// Which groups of a block are certainly below the threshold.
    #[inline]
    pub(super) fn passes_groups(&self, table: &GroupTable, block: usize) -> f32x8 {
        self.passes(&table.groups, &table.facings, block, f32x8::splat(0.0))
    }

    /// Which blocks of a word are, with all of their groups.
    #[inline]
    pub(super) fn passes_blocks(&self, table: &GroupTable, word: usize) -> f32x8 {
        let spread = table.blocks.radius[word] * f32x8::splat(ROUNDING_ALLOWANCE);
        self.passes(&table.blocks, &table.block_facings, word, spread)
    }

    /// `spread` is how far the centres of groups may be from that of their bound.
    #[inline]
    fn passes(
        &self,
        bounds: &BoundsLanes,
        facings: &FacingLanes,
        element: usize,
        spread: f32x8,
    ) -> f32x8 {
        let zero = f32x8::splat(0.0);
        let from_eye = bounds.center(element).minus(self.eye);
        let radius = bounds.radius[element] * f32x8::splat(ROUNDING_ALLOWANCE) + self.slack;
        let distance = from_eye.dot(from_eye).sqrt();
        let depth = from_eye.dot(self.axis) - (radius + self.slack);
        let farthest = distance + radius + self.slack;
        let mut below = zero.is_below(depth);
        if let Some(per_px) = self.error {
            let spread = spread + self.slack;
            // X of the module's formula.
            let towards = (spread - from_eye.dot(facings.normal(element))).larger(zero);
            let error = facings.error[element] * per_px;
            let edge_on = facings.edge_on_weight[element] * (distance + spread);
            let shows = error * error * (towards + edge_on);
            // Y of the module's formula.
            let nearest = (distance - spread).larger(zero);
            let allowed = nearest * depth * depth;
            below &= (shows * farthest).is_below(allowed * depth)
                | (shows * self.secant).is_below(allowed);
        }
        if let Some(per_px) = self.deviation {
            let shows = bounds.deviation[element] * per_px;
            below &=
                (shows * farthest).is_below(depth * depth) | (shows * self.secant).is_below(depth);
        }
        below
    }
}
