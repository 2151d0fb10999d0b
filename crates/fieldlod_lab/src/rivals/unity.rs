//! Unity 6.2's Mesh LOD: one level for the whole object, from a fitted line.
//!
//! ```text
//! level = ⌊ slope · log₂( d C / (2 |extents|) ) + bias ⌋        C = 2 tan(fovy/2)
//! ```
//! `extents` are those of the box along the *world's* axes, so that turning the object changes its
//! level. Slope and bias are the least-squares line through the starts of the tuned ranges. Source:
//! Unity 6.2 manual, "Mesh LOD"; `Mesh.lodSelectionCurve`.

use super::{LodObject, REFERENCE_FOCAL_PX, Seen};

/// Height of the reference view's window, in pixels.
const REFERENCE_HEIGHT_PX: f32 = 1080.0;

pub(super) fn level(seen: &Seen, threshold_px: f32) -> u32 {
    let curve = SelectionCurve::fit(seen.object, threshold_px);
    let aabb = seen.aabb_relative_to_eye();
    let size = (aabb.max - aabb.min).length();
    let seen_height = seen.eye.height_px() / seen.eye.focal_px();
    let covered = if seen.eye.is_orthographic() {
        seen_height
    } else {
        seen_height * seen.distance_to_center()
    };
    let level = (curve.slope * (covered / size).log2() + curve.bias).floor();
    // NaN becomes 0.
    (level.max(0.0) as u32).min(seen.object.level_count().saturating_sub(1))
}

struct SelectionCurve {
    slope: f32,
    bias: f32,
}

impl SelectionCurve {
    fn fit(object: &LodObject, threshold_px: f32) -> Self {
        let size = (object.aabb.max - object.aabb.min).length();
        let height = REFERENCE_HEIGHT_PX / REFERENCE_FOCAL_PX;
        let points = (1..object.level_count()).map(|level| {
            let covered = object.range_start(level, threshold_px) * height;
            ((covered / size).log2(), level as f32)
        });
        let points: Vec<(f32, f32)> = points.collect();
        let count = points.len().max(1) as f32;
        let mean_x = points.iter().map(|p| p.0).sum::<f32>() / count;
        let mean_y = points.iter().map(|p| p.1).sum::<f32>() / count;
        let variance: f32 = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
        let covariance: f32 = points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
        let slope = if variance > 0.0 {
            covariance / variance
        } else {
            0.0
        };
        Self {
            slope,
            bias: mean_y - slope * mean_x,
        }
    }
}
