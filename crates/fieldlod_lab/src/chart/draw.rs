//! The charts of a report: a picture for each question, and all numbers behind them.

use std::path::Path;

use glam::DVec2;

use super::costs::CostAtError;
use super::curve::{CHARTED, Measure};
use super::figure::{Figure, Panel, Series};
use super::promise::{PROMISE_FOVS_DEG, PromiseResult};
use super::report::Report;
use crate::canvas::Color;
use crate::files::{WriteError, write_file};
use crate::method::Method;

/// Writes all charts into a folder: pictures, `report.json` with their numbers, and `ablation.md`, what
/// each term of the criterion is worth.
///
/// # Errors
/// [`WriteError`] for a folder that takes no files.
pub fn write_charts(report: &Report, folder: &Path) -> Result<(), WriteError> {
    let write = |name: &str, text: &str| write_file(&folder.join(name), text.as_bytes());
    write(
        "report.json",
        &serde_json::to_string(report).unwrap_or_default(),
    )?;
    for chart in &COST_CHARTS {
        let path = folder.join(format!("{}.png", chart.name));
        cost_figure(report, chart).draw(&path)?;
    }
    if !report.promise.is_empty() {
        promise_figure(report).draw(&folder.join("promise.png"))?;
    }
    if !report.flicker.is_empty() {
        flicker_figure(report).draw(&folder.join("flicker.png"))?;
    }
    if !report.ablation.is_empty() {
        write("ablation.md", &report.ablation_table())?;
    }
    Ok(())
}

/// The models and poses that were measured.
fn subject(report: &Report) -> String {
    let models = report.models.iter();
    let names: Vec<&str> = models.map(|model| model.name.as_str()).collect();
    let [width, height] = report.size_px;
    format!(
        "{}; {} poses each, pictures of {width} x {height} px",
        names.join(", "),
        report.poses
    )
}

/// A chart of one cost against the error of the picture.
struct CostChart {
    name: &'static str,
    label: &'static str,
    cost: fn(&CostAtError) -> f64,
    methods: &'static [Method],
    note: &'static str,
}

/// How the systems differ.
const NOTE: &str = "clusterlod has levels of its own, all others ours.\n\
                    Godot chooses whole levels; the oracle knows the pictures.";

const COST_CHARTS: [CostChart; 3] = [
    CostChart {
        name: "triangles",
        label: "triangles in view",
        cost: |c| c.triangles,
        methods: &CHARTED,
        note: NOTE,
    },
    CostChart {
        name: "selection",
        label: "time to choose for one object, in microseconds",
        cost: |c| c.select_us,
        methods: &[Method::Quality, Method::Clusterlod],
        note: "From scratch on one thread, both eight groups at once, units gathered.",
    },
    CostChart {
        name: "frame",
        label: "time to draw a frame, in milliseconds",
        cost: |c| c.frame_ms,
        methods: &CHARTED,
        note: NOTE,
    },
];

fn cost_figure(report: &Report, chart: &CostChart) -> Figure {
    let series = chart.methods.iter().map(|&method| {
        let costs = report.costs.iter().filter(|cost| cost.method == method);
        let points = costs.map(|cost| DVec2::new(cost.rmse, (chart.cost)(cost)));
        Series::new(method, points)
    });
    Figure {
        title: title_of_costs(report, chart.label),
        note: format!(
            "Geometric means over {}.\n{} Drawn by {}.",
            subject(report),
            chart.note,
            report.adapter
        ),
        panels: vec![Panel {
            name: String::new(),
            x: "image error: RMSE, in levels of 255".to_owned(),
            y: chart.label.to_owned(),
            series: series.collect(),
        }],
    }
}

fn title_of_costs(report: &Report, label: &str) -> String {
    let ratio = report.ratio(Method::Quality, Measure::Rmse, 1.0);
    match ratio {
        Some(ratio) if label.starts_with("triangles") => format!(
            "For the same picture, fieldlod draws {:.0} % of clusterlod's triangles",
            100.0 * ratio.mean
        ),
        _ => format!("Image error against {label}"),
    }
}

fn promise_figure(report: &Report) -> Figure {
    let panels = PROMISE_FOVS_DEG.map(|fov| promise_panel(report, fov));
    let mut guaranteed = report
        .promise
        .iter()
        .filter(|p| p.method == Method::Guaranteed);
    let title = if guaranteed.all(|promise| promise.max_px <= promise.requested_px) {
        "Guaranteed keeps what it promises, towards the picture's corner too"
    } else {
        "Guaranteed does not keep what it promises"
    };
    Figure {
        title: title.to_owned(),
        note: format!(
            "Displacement of the surface on screen against the pixels asked for; the worst of {}.\n\
             Solid: greatest. Dashed: one point in a thousand is beyond. Gray: what was asked for.",
            subject(report)
        ),
        panels: panels.into(),
    }
}

fn promise_panel(report: &Report, fovy_deg: f32) -> Panel {
    let points = |method: Method, value: fn(&PromiseResult) -> f64| {
        let results = report.promise.iter();
        let of_method = results.filter(move |p| p.method == method && p.fovy_deg == fovy_deg);
        of_method.map(move |p| DVec2::new(p.requested_px, value(p)))
    };
    let mut series = vec![Series {
        name: "asked for".to_owned(),
        color: Color::GRAY,
        is_dashed: false,
        points: vec![DVec2::splat(0.25), DVec2::splat(8.0)],
    }];
    // The greatest displacements, and those that one in a thousand exceeds.
    for method in [Method::Guaranteed, Method::Quality, Method::Clusterlod] {
        series.push(Series::new(method, points(method, |p| p.max_px)));
        series.push(Series {
            name: String::new(),
            is_dashed: true,
            ..Series::new(method, points(method, |p| p.p99_9_px))
        });
    }
    Panel {
        name: format!("field of view {fovy_deg} degrees"),
        x: "pixels asked for".to_owned(),
        y: "measured pixels".to_owned(),
        series,
    }
}

fn flicker_figure(report: &Report) -> Figure {
    let methods = [
        Method::Quality,
        Method::Clusterlod,
        Method::Godot43,
        Method::VisibilityRange,
    ];
    let series = methods.map(|method| {
        let results = report.flicker.iter().filter(|path| path.method == method);
        Series::new(
            method,
            results.map(|path| DVec2::new(path.triangles, path.temporal_error)),
        )
    });
    Figure {
        title: "What flickers while one walks by".to_owned(),
        note: format!(
            "Change from frame to frame beyond the scene's own, half a second of a walk.\n{}.",
            subject(report)
        ),
        panels: vec![Panel {
            name: String::new(),
            x: "triangles in view".to_owned(),
            y: "temporal error: RMSE, in levels of 255".to_owned(),
            series: series.into(),
        }],
    }
}
