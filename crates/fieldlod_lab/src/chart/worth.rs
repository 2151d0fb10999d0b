//! What each term of the criterion is worth: in triangles, in promises kept, in time.

use std::fmt::Write;
use std::path::Path;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::promise::ABLATED_AT_PX;
use super::report::geometric_mean;
use super::{ABLATED, Kept, Measure, ModelResult, PoseResult, Ratios, Way, ratios};
use crate::canvas::{Align, Canvas, Color};
use crate::files::WriteError;

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

/// What each column of the table is.
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

fn cells(worth: &Worth) -> [String; 9] {
    let some = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.2}"));
    [
        worth.way.name().to_owned(),
        some(worth.triangles),
        some(worth.worst_pose),
        some(worth.silhouette),
        format!("{:.2}", worth.triangles_at_1_px),
        format!("{:.2}", worth.max_px),
        format!("{:.2}", worth.p99_9_px),
        format!("{:.1}", worth.plain_ns),
        some(worth.fast_ns),
    ]
}

/// As a table in Markdown.
pub(super) fn markdown(all: &[Worth]) -> String {
    let mut text = format!("| {} |\n|---{}|\n", HEAD.join(" | "), "|---:".repeat(8));
    for worth in all {
        let _ = writeln!(text, "| {} |", cells(worth).join(" | "));
    }
    text
}

const MARGIN: f64 = 24.0;
const NAME_WIDTH: f64 = 230.0;
const COLUMN_WIDTH: f64 = 124.0;
const ROW_HEIGHT: f64 = 26.0;
const ABOVE: f64 = 130.0;

/// As a picture.
pub(super) fn draw(all: &[Worth], subject: &str, path: &Path) -> Result<(), WriteError> {
    let width = 2.0 * MARGIN + NAME_WIDTH + COLUMN_WIDTH * 8.0;
    let height = ABOVE + ROW_HEIGHT * (all.len() as f64 + 1.5);
    let mut canvas = Canvas::new(width as u32, height as u32);
    let line = |y| DVec2::new(MARGIN, y);
    let title = "What each term of the criterion is worth";
    canvas.title(line(32.0), Align::Left, title);
    let notes = [
        subject,
        "Triangles relative to clusterlod's: at the image error of its 1 px (mean, worst pose), at its \
         silhouette's,",
        "and at a threshold of 1 px towards the picture's corner; displacements there; time for a group.",
    ];
    for (index, note) in (0u8..).zip(notes) {
        let at = line(58.0 + 20.0 * f64::from(index));
        canvas.text(at, Align::Left, note, Color::INK);
    }
    let rows = std::iter::once((HEAD.map(str::to_owned), Color::GRAY));
    let rows = rows.chain(all.iter().map(|worth| (cells(worth), Color::INK)));
    for (row, (cells, color)) in (0u8..).zip(rows) {
        let y = ABOVE + ROW_HEIGHT * f64::from(row);
        draw_row(&mut canvas, y, &cells, color);
    }
    canvas.save(path)
}

fn draw_row(canvas: &mut Canvas, y: f64, cells: &[String; 9], color: Color) {
    let [name, numbers @ ..] = cells;
    canvas.text(DVec2::new(MARGIN, y), Align::Left, name, color);
    for (column, number) in (1u8..).zip(numbers) {
        let right = MARGIN + NAME_WIDTH + COLUMN_WIDTH * f64::from(column);
        canvas.text(DVec2::new(right, y), Align::Right, number, color);
    }
    let below = y + 0.5 * ROW_HEIGHT;
    let right = MARGIN + NAME_WIDTH + COLUMN_WIDTH * 8.0;
    let ends = [DVec2::new(MARGIN, below), DVec2::new(right, below)];
    canvas.line(ends[0], ends[1], 1.0, Color::PALE);
}
