//! Triangles of methods relative to clusterlod on its own levels, at equal error, over poses and models.

use serde::Serialize;

use super::curve::{Measure, PoseResult, triangles_at_error};
use crate::measure::geometric_mean;
use crate::method::Method;

/// Methods are compared at the errors of clusterlod at these thresholds, in pixels.
pub const COMPARED_AT_PX: [f64; 3] = [0.4, 1.0, 2.5];

/// Triangles of a method divided by those of clusterlod at the same error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratios {
    /// The method.
    pub method: Method,
    /// The measure of image error that is equal for both.
    pub measure: Measure,
    /// The threshold of clusterlod that gives the error, in pixels.
    pub at_px: f64,
    /// Geometric mean over poses.
    pub mean: f64,
    /// The ratio in the best pose.
    pub least: f64,
    /// The ratio in the worst pose.
    pub greatest: f64,
    /// The number of compared poses. In the other poses, the error is outside the curve of the method or of clusterlod.
    pub poses: usize,
}

impl Ratios {
    /// Compares a method with clusterlod over poses; `None` if no pose can be compared.
    pub(super) fn of(
        poses: &[&PoseResult],
        method: Method,
        measure: Measure,
        at_px: f64,
    ) -> Option<Self> {
        let ratio = |pose: &&PoseResult| ratio(pose, method, measure, at_px);
        let found: Vec<f64> = poses.iter().filter_map(ratio).collect();
        Some(Self {
            method,
            measure,
            at_px,
            mean: geometric_mean(found.iter().copied())?,
            least: found.iter().copied().fold(f64::INFINITY, f64::min),
            greatest: found.iter().copied().fold(0.0, f64::max),
            poses: found.len(),
        })
    }
}

/// The ratio in one pose.
fn ratio(pose: &PoseResult, method: Method, measure: Measure, at_px: f64) -> Option<f64> {
    let base = pose.curve(Method::Clusterlod)?;
    let error = measure.of(base.at_threshold(at_px)?);
    let of_base = triangles_at_error(base, measure, error)?;
    Some(triangles_at_error(pose.curve(method)?, measure, error)? / of_base)
}
