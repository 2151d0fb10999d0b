//! What each term of the criterion is worth: in triangles, in promises kept, in time.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

use super::criterion_cost::{ABLATED, ABLATED_AT_PX};
use super::curve::{Measure, PoseResult};
use super::model_result::ModelResult;
use super::promise::PromiseResult;
use super::ratios::{Ratios, geometric_mean};
use crate::method::Method;

/// A criterion with all or all but one of its terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AblationRow {
    /// The method.
    pub method: Method,
    /// Triangles relative to clusterlod's at the image error of its 1 px, mean over all poses.
    pub triangles: Option<f64>,
    /// Triangles relative to clusterlod's at the image error of its 1 px, in the worst pose.
    pub worst_pose: Option<f64>,
    /// Triangles relative to clusterlod's at its silhouette's error at 1 px.
    pub silhouette: Option<f64>,
    /// Triangles at a threshold of 1 px, relative to clusterlod's, with the object towards the
    /// picture's corner as promises are measured.
    pub triangles_at_1_px: f64,
    /// The greatest displacement there, in pixels.
    pub max_px: f64,
    /// The displacement that one point in a thousand exceeds, in the worst place, in pixels.
    pub p99_9_px: f64,
    /// Time for a group by plain code, in nanoseconds.
    pub plain_ns: f64,
    /// Time for a group as in a frame, in nanoseconds, of methods that have such code.
    pub fast_ns: Option<f64>,
}

/// Sums up models; nothing without promises and times.
pub(super) fn ablation(models: &[ModelResult]) -> Vec<AblationRow> {
    let is_whole = |model: &ModelResult| !model.criterion.is_empty() && !model.promise.is_empty();
    if models.is_empty() || !models.iter().all(is_whole) {
        return Vec::new();
    }
    ABLATED.map(|method| row(models, method)).into()
}

fn row(models: &[ModelResult], method: Method) -> AblationRow {
    // Triangles at equal error.
    let poses: Vec<&PoseResult> = models.iter().flat_map(|model| &model.poses).collect();
    let at_equal = |measure| Ratios::of(&poses, method, measure, f64::from(ABLATED_AT_PX));
    let rmse = at_equal(Measure::Rmse);
    // What is kept of the promise.
    let promises = |method| {
        models
            .iter()
            .flat_map(move |model| promises_of(model, method))
    };
    let pairs = promises(method).zip(promises(Method::Clusterlod));
    // Times.
    let costs = models.iter().flat_map(|model| &model.criterion);
    let costs = || costs.clone().filter(|cost| cost.method == method);
    let fast: Vec<f64> = costs().filter_map(|cost| cost.fast_ns).collect();
    AblationRow {
        method,
        triangles: rmse.map(|ratios| ratios.mean),
        worst_pose: rmse.map(|ratios| ratios.greatest),
        silhouette: at_equal(Measure::Silhouette).map(|ratios| ratios.mean),
        triangles_at_1_px: geometric_mean(pairs.map(|(own, base)| own.triangles / base.triangles)),
        max_px: promises(method).map(|p| p.max_px).fold(0.0, f64::max),
        p99_9_px: promises(method).map(|p| p.p99_9_px).fold(0.0, f64::max),
        plain_ns: geometric_mean(costs().map(|cost| cost.plain_ns)),
        fast_ns: (!fast.is_empty()).then(|| geometric_mean(fast.iter().copied())),
    }
}

/// The results of a method at the threshold at which terms are ablated, one for each field of view.
fn promises_of(model: &ModelResult, method: Method) -> impl Iterator<Item = &PromiseResult> {
    let at = f64::from(ABLATED_AT_PX);
    let all = model.promise.iter();
    all.filter(move |promise| promise.method == method && (promise.requested_px - at).abs() < 1e-6)
}

/// The names of the table's columns.
const HEAD: [&str; 9] = [
    "criterion",
    "triangles",
    "worst pose",
    "by silhouette",
    "at 1 px",
    "most px",
    "p99.9 px",
    "ns plain",
    "ns fast",
];

fn cells(row: &AblationRow) -> [String; 9] {
    let some = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.2}"));
    [
        row.method.label(),
        some(row.triangles),
        some(row.worst_pose),
        some(row.silhouette),
        format!("{:.2}", row.triangles_at_1_px),
        format!("{:.2}", row.max_px),
        format!("{:.2}", row.p99_9_px),
        format!("{:.1}", row.plain_ns),
        some(row.fast_ns),
    ]
}

/// The rows as a table in Markdown.
pub(super) fn markdown(all: &[AblationRow]) -> String {
    let mut text = format!("| {} |\n|---{}|\n", HEAD.join(" | "), "|---:".repeat(8));
    for row in all {
        let _ = writeln!(text, "| {} |", cells(row).join(" | "));
    }
    text
}
