//! The test that knows depth and facing, without a quotient: for similarities and perspective views,
//! which most are.
//!
//! With `sec ≤ (ρ + r)/(z − r)` and `sec ≤ S`, `z_min ≥ z − r`, and `W ≤ 4 (max(m·s, 0) + ½√v + 0.1)`,
//! all in local space, the squared quality error is below τ² if
//! ```text
//! X = (2 e f/τ)² (max(−m·(p − eye), 0) + (½√v + 0.1) ρ),    Y = ρ (z − r)²
//! X (ρ + r) < Y (z − r)   or   X S < Y
//! ```
//! For eight groups at once, `m` is the mean of theirs, the weight beside it counts by how much they
//! differ, and the sphere around theirs has the place of theirs. The displacement is below τ if
//! ```text
//! (d f/τ) (ρ + r) < (z − r)²   or   (d f/τ) S < z − r
//! ```

use camera_field::Camera;
use wide::f32x8;

use super::conservative::{CameraParts, InLocal, SLACK};
use crate::criterion::VISIBLE_WEIGHT;
use crate::table::{Bounds, Facings, GroupTable};
use crate::{InstanceView, LodSettings};

const ZERO: f32x8 = f32x8::splat(0.0);

pub(crate) struct FacingTest {
    eye: [f32x8; 3],
    /// The view's axis, a hair short.
    axis: [f32x8; 3],
    /// `2 f/τ` for the quality error, `f/τ` for the displacement, where asked.
    error: Option<f32x8>,
    deviation: Option<f32x8>,
    secant: f32x8,
    slack: f32x8,
}

impl FacingTest {
    /// `None` where the instance is no similarity or the view is orthographic.
    pub(super) fn new(
        instance: &InstanceView,
        in_local: InLocal,
        parts: &CameraParts,
        settings: &LodSettings,
        threshold_px: f32,
    ) -> Option<Self> {
        let Camera::Perspective(camera) = &parts.camera else {
            return None;
        };
        let focal = camera.focal_px.x.max(camera.focal_px.y);
        let quality = (camera.constant_px2() * VISIBLE_WEIGHT).sqrt();
        let criterion = settings.criterion();
        let error = criterion.counts_error.then_some(quality);
        let deviation = criterion.displacement_weight.map(|weight| focal * weight);
        let per_px = |scale: f32| f32x8::splat(scale * (SLACK / threshold_px));
        let axis = instance.camera_from_local.transpose().z_axis;
        let is_similarity = instance.seen_stretch.is_none();
        is_similarity.then(|| Self {
            eye: in_local.eye.to_array().map(f32x8::splat),
            // Similarities are so but for 1e-4, which the other slacks bear too.
            axis: (axis * (0.9998 / instance.camera_per_local))
                .to_array()
                .map(f32x8::splat),
            error: error.map(per_px),
            deviation: deviation.map(per_px),
            secant: f32x8::splat(parts.secant),
            slack: f32x8::splat(in_local.slack),
        })
    }

    /// Which groups of a block are certainly below the threshold.
    #[inline]
    pub(super) fn passed_by(&self, table: &GroupTable, block: usize) -> f32x8 {
        self.passed(&table.groups, &table.facings, block, ZERO)
    }

    /// Which blocks of a word are, with all of their groups.
    #[inline]
    pub(super) fn passed_by_blocks(&self, table: &GroupTable, word: usize) -> f32x8 {
        let spread = table.blocks.radius[word] * f32x8::splat(SLACK);
        self.passed(&table.blocks, &table.block_facings, word, spread)
    }

    /// `spread`: how far the centres of groups may be from that of their bound.
    #[inline]
    fn passed(&self, bounds: &Bounds, facings: &Facings, element: usize, spread: f32x8) -> f32x8 {
        let (x, y, z) = (
            bounds.x[element] - self.eye[0],
            bounds.y[element] - self.eye[1],
            bounds.z[element] - self.eye[2],
        );
        let radius = bounds.radius[element] * f32x8::splat(SLACK) + self.slack;
        let distance = (x * x + y * y + z * z).sqrt();
        let [a_x, a_y, a_z] = self.axis;
        let depth = x * a_x + y * a_y + z * a_z - (radius + self.slack);
        let farthest = distance + radius + self.slack;
        let mut below = depth.simd_gt(ZERO);
        let spread = spread + self.slack;
        if let Some(per_px) = self.error {
            let [m_x, m_y, m_z] = &facings.normal;
            let away = x * m_x[element] + y * m_y[element] + z * m_z[element];
            let towards = spread - away;
            let towards = towards.simd_gt(ZERO).bitselect(towards, ZERO);
            let error = facings.error[element] * per_px;
            let edge_on = facings.edge_on_weight[element] * (distance + spread);
            let shows = error * error * (towards + edge_on);
            let nearest = distance - spread;
            let allowed = nearest.simd_gt(ZERO).bitselect(nearest, ZERO) * depth * depth;
            below &= (shows * farthest).simd_lt(allowed * depth)
                | (shows * self.secant).simd_lt(allowed);
        }
        if let Some(per_px) = self.deviation {
            let shows = bounds.deviation[element] * per_px;
            below &=
                (shows * farthest).simd_lt(depth * depth) | (shows * self.secant).simd_lt(depth);
        }
        below
    }
}
