//! What methods cost at equal image error, over poses and models.

use serde::{Deserialize, Serialize};

use super::curve::{
    CHARTED, Curve, Measure, Point, PoseResult, THRESHOLDS_PX, cost_at_triangles,
    triangles_at_error,
};
use super::ratios::geometric_mean;
use crate::method::Method;

/// Methods are shown at an error only where at least this share of poses can be compared.
const LEAST_SHARE: f64 = 0.6;

/// Costs of a method at an error, as geometric means over poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CostAtError {
    /// The method.
    pub method: Method,
    /// The threshold of clusterlod with that error, in pixels.
    pub at_px: f64,
    /// Root mean squared difference of the picture, in levels of 255.
    pub rmse: f64,
    /// The threshold at which the method has that error, in pixels.
    pub threshold_px: f64,
    /// Triangles of units in view.
    pub triangles: f64,
    /// Units in view: draw commands.
    pub units: f64,
    /// Time to choose, in microseconds.
    pub select_us: f64,
    /// Time to draw, in milliseconds.
    pub frame_ms: f64,
}

/// The costs of all charted methods at the errors of all of clusterlod's thresholds.
pub(super) fn costs(poses: &[&PoseResult]) -> Vec<CostAtError> {
    let at = THRESHOLDS_PX.map(f64::from);
    let all = CHARTED
        .into_iter()
        .flat_map(|method| at.map(|at_px| (method, at_px)));
    all.filter_map(|(method, at_px)| cost(poses, method, at_px))
        .collect()
}

/// Clusterlod's mean cost times the mean ratio to it, over the poses that have one. Nothing where
/// clusterlod draws the source itself in some pose.
fn cost(poses: &[&PoseResult], method: Method, at_px: f64) -> Option<CostAtError> {
    let pairs_of = |method| -> Vec<Pair> {
        let pairs = poses.iter().map(|pose| Pair::new(pose, method, at_px));
        pairs.flatten().collect()
    };
    let (pairs, based) = (pairs_of(method), pairs_of(Method::Clusterlod));
    // Too few poses would be a mean of others than clusterlod's.
    let enough = LEAST_SHARE * poses.len() as f64;
    if pairs.is_empty() || (pairs.len() as f64) < enough || based.len() < poses.len() {
        return None;
    }
    // Clusterlod's mean over all poses, times the mean ratio over those that can be compared.
    let mean = |of: fn(&Point) -> f64| {
        let base = geometric_mean(based.iter().filter_map(|pair| pair.of_base(of)));
        let ratio = |pair: &Pair| Some(pair.of_method(of)? / pair.of_base(of)?);
        base * geometric_mean(pairs.iter().filter_map(ratio))
    };
    Some(CostAtError {
        method,
        at_px,
        rmse: geometric_mean(based.iter().map(|pair| pair.error)),
        threshold_px: mean(|point| point.threshold),
        triangles: mean(|point| point.triangles as f64),
        units: mean(|point| point.units as f64),
        select_us: mean(|point| point.select_us),
        frame_ms: mean(|point| point.frame_ms),
    })
}

/// A method and clusterlod in one pose at one error.
struct Pair<'a> {
    error: f64,
    method: (&'a Curve, f64),
    base: (&'a Curve, f64),
}

impl<'a> Pair<'a> {
    fn new(pose: &'a PoseResult, method: Method, at_px: f64) -> Option<Self> {
        let base = pose.curve(Method::Clusterlod)?;
        let error = base.at_threshold(at_px)?.error.rmse;
        let at = |curve: &'a Curve| Some((curve, triangles_at_error(curve, Measure::Rmse, error)?));
        Some(Self {
            error,
            method: at(pose.curve(method)?)?,
            base: at(base)?,
        })
    }

    fn of_method(&self, cost: fn(&Point) -> f64) -> Option<f64> {
        cost_at_triangles(self.method.0, self.method.1, cost)
    }

    fn of_base(&self, cost: fn(&Point) -> f64) -> Option<f64> {
        cost_at_triangles(self.base.0, self.base.1, cost)
    }
}
