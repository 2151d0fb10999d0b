//! Costs of ways relative to clusterlod's at equal error, over poses and models.

use serde::{Deserialize, Serialize};

use super::curve::{Measure, triangles_at_error};
use super::{PoseResult, Way};

/// Thresholds of clusterlod at whose errors ways are compared, in pixels.
pub const COMPARED_AT_PX: [f64; 3] = [0.4, 1.0, 2.5];

/// Triangles of a way over those of clusterlod at the same error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratios {
    /// The way.
    pub way: Way,
    /// What is equal.
    pub measure: Measure,
    /// Clusterlod's threshold at which the error is taken, in pixels.
    pub at_px: f64,
    /// Geometric mean over poses.
    pub mean: f64,
    /// The best pose.
    pub least: f64,
    /// The worst pose.
    pub greatest: f64,
    /// Over how many poses. The others' error is not on the way's curve.
    pub poses: usize,
}

/// Compares a way with clusterlod over poses; `None` where no pose can be compared.
#[must_use]
pub fn ratios(results: &[&PoseResult], way: Way, measure: Measure, at_px: f64) -> Option<Ratios> {
    let found = results.iter().filter_map(|r| ratio(r, way, measure, at_px));
    let found: Vec<f64> = found.collect();
    let logs: f64 = found.iter().map(|ratio| ratio.ln()).sum();
    (!found.is_empty()).then(|| Ratios {
        way,
        measure,
        at_px,
        mean: (logs / found.len() as f64).exp(),
        least: found.iter().copied().fold(f64::INFINITY, f64::min),
        greatest: found.iter().copied().fold(0.0, f64::max),
        poses: found.len(),
    })
}

/// The ratio in one pose.
pub(super) fn ratio(result: &PoseResult, way: Way, measure: Measure, at_px: f64) -> Option<f64> {
    let base = result.curve(Way::Clusterlod)?;
    let point = base
        .points
        .iter()
        .find(|point| (point.threshold - at_px).abs() < 1e-4)?;
    let error = measure.of(point);
    let of_base = triangles_at_error(base, measure, error)?;
    Some(triangles_at_error(result.curve(way)?, measure, error)? / of_base)
}
