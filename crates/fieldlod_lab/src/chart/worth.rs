//! What each term of the criterion is worth: in triangles, in promises kept, in time.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

use super::promise::ABLATED_AT_PX;
use super::report::geometric_mean;
use super::{ABLATED, Kept, Measure, ModelResult, PoseResult, Ratios, Way, ratios};

/// A criterion with all or all but one of its terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Worth {
    /// The way.
    pub way: Way,
    /// Triangles relative to clusterlod's at the image error of its 1 px, mean over all poses.
    pub triangles: Option<f64>,
    /// The same in the worst pose.
    pub worst_pose: Option<f64>,
    /// Triangles relative to clusterlod's at its silhouette's error at 1 px.
    pub silhouette: Option<f64>,
    /// Triangles at a threshold of 1 px, relative to clusterlod's, with the object towards the
    /// picture's corner as promises are measured.
    pub triangles_at_1_px: f64,
    /// The greatest displacement there, in pixels.
    pub max_px: f64,
    /// That which one point in a thousand exceeds, in the worst place, in pixels.
    pub p99_9_px: f64,
    /// Time for a group by plain code, in nanoseconds.
    pub plain_ns: f64,
    /// Time for a group as in a frame, in nanoseconds, of ways that have such code.
    pub fast_ns: Option<f64>,
}

/// Sums up models; nothing without promises and times.
pub(super) fn worth(models: &[ModelResult]) -> Vec<Worth> {
    let is_whole = |model: &ModelResult| !model.criterion.is_empty() && !model.promise.is_empty();
    if models.is_empty() || !models.iter().all(is_whole) {
        return Vec::new();
    }
    ABLATED
        .into_iter()
        .map(|way| worth_of(models, way))
        .collect()
}

fn worth_of(models: &[ModelResult], way: Way) -> Worth {
    let poses: Vec<&PoseResult> = models.iter().flat_map(|model| &model.poses).collect();
    let at_equal = |measure| ratios(&poses, way, measure, f64::from(ABLATED_AT_PX));
    let rmse = at_equal(Measure::Rmse);
    let kept = || models.iter().flat_map(move |model| kept_of(model, way));
    let base = models
        .iter()
        .flat_map(|model| kept_of(model, Way::Clusterlod));
    let more = kept()
        .zip(base)
        .map(|(ours, base)| ours.triangles / base.triangles);
    let costs = || {
        let all = models.iter().flat_map(|model| &model.criterion);
        all.filter(move |cost| cost.way == way)
    };
    let fast: Vec<f64> = costs().filter_map(|cost| cost.fast_ns).collect();
    Worth {
        way,
        triangles: rmse.map(|r| r.mean),
        worst_pose: rmse.map(|r| r.greatest),
        silhouette: at_equal(Measure::Silhouette).map(|r: Ratios| r.mean),
        triangles_at_1_px: geometric_mean(more),
        max_px: kept().map(|k| k.max_px).fold(0.0, f64::max),
        p99_9_px: kept().map(|k| k.p99_9_px).fold(0.0, f64::max),
        plain_ns: geometric_mean(costs().map(|cost| cost.plain_ns)),
        fast_ns: (!fast.is_empty()).then(|| geometric_mean(fast.iter().copied())),
    }
}

/// What a way keeps of 1 px, one for each field of view.
fn kept_of(model: &ModelResult, way: Way) -> impl Iterator<Item = &Kept> {
    let at = f64::from(ABLATED_AT_PX);
    let all = model.promise.iter();
    all.filter(move |kept| kept.way == way && (kept.requested_px - at).abs() < 1e-6)
}

/// As a table in Markdown.
pub(super) fn markdown(all: &[Worth]) -> String {
    let mut text = String::from(
        "| criterion | triangles | worst pose | by silhouette | at 1 px | most px | p99.9 px | ns plain | ns fast |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    let some = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.2}"));
    for w in all {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {:.2} | {:.2} | {:.2} | {:.1} | {} |",
            w.way.name(),
            some(w.triangles),
            some(w.worst_pose),
            some(w.silhouette),
            w.triangles_at_1_px,
            w.max_px,
            w.p99_9_px,
            w.plain_ns,
            some(w.fast_ns),
        );
    }
    text
}
