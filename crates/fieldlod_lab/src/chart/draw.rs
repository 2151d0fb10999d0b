//! The charts of a report: a picture and the numbers behind it for each question.

use std::fmt::Write;
use std::path::Path;

use glam::DVec2;

use super::figure::{Figure, Panel, Series};
use super::report::CHARTED;
use super::worth;
use super::{CostAtError, Kept, Measure, OnPath, PROMISE_FOVS_DEG, Report, Way};
use crate::canvas::Color;
use crate::files::{WriteError, write_file};

const PURPLE: Color = Color::new(130, 72, 170);

/// Writes all charts into a folder: pictures, a CSV file beside each, and `report.json`.
///
/// # Errors
/// [`WriteError`] for a folder that takes no files.
pub fn write_charts(report: &Report, folder: &Path) -> Result<(), WriteError> {
    let write = |name: &str, text: &str| write_file(&folder.join(name), text.as_bytes());
    write(
        "report.json",
        &serde_json::to_string(report).unwrap_or_default(),
    )?;
    write("ratios.csv", &ratios_csv(report))?;
    for chart in &COST_CHARTS {
        let path = folder.join(format!("{}.png", chart.name));
        cost_figure(report, chart).draw(&path)?;
    }
    write("costs.csv", &costs_csv(report))?;
    if !report.promise.is_empty() {
        promise_figure(report).draw(&folder.join("promise.png"))?;
        write("promise.csv", &promise_csv(report))?;
    }
    if !report.temporal.is_empty() {
        temporal_figure(report).draw(&folder.join("temporal.png"))?;
        write("temporal.csv", &temporal_csv(report))?;
    }
    if !report.worth.is_empty() {
        write("ablation.md", &report.worth_table())?;
        worth::draw(
            &report.worth,
            &subject(report),
            &folder.join("ablation.png"),
        )?;
    }
    Ok(())
}

/// On what it was measured.
fn subject(report: &Report) -> String {
    let names: Vec<&str> = report
        .models
        .iter()
        .map(|model| model.name.as_str())
        .collect();
    format!(
        "{}; {} poses each, pictures of {} x {} px",
        names.join(", "),
        report.poses,
        report.size_px[0],
        report.size_px[1]
    )
}

/// A chart of one cost against the error of the picture.
struct CostChart {
    name: &'static str,
    label: &'static str,
    cost: fn(&CostAtError) -> f64,
    ways: &'static [Way],
    note: &'static str,
}

const COST_CHARTS: [CostChart; 3] = [
    CostChart {
        name: "triangles",
        label: "triangles in view",
        cost: |c| c.triangles,
        ways: &CHARTED,
        note: "Godot chooses whole levels; the oracle knows the pictures.",
    },
    CostChart {
        name: "selection",
        label: "time to choose for one object, in microseconds",
        cost: |c| c.select_us,
        ways: &[Way::Quality, Way::Clusterlod],
        note: "From scratch on one thread, both eight groups at once, units gathered.",
    },
    CostChart {
        name: "frame",
        label: "time to draw a frame, in milliseconds",
        cost: |c| c.frame_ms,
        ways: &CHARTED,
        note: "Godot chooses whole levels; the oracle knows the pictures.",
    },
];

fn cost_figure(report: &Report, chart: &CostChart) -> Figure {
    let series = chart.ways.iter().map(|&way| {
        let of_way = report.costs.iter();
        let of_way = of_way.filter(|c| c.way == way && (chart.cost)(c) > 0.0);
        Series {
            name: way.name().to_owned(),
            color: color_of(way),
            is_dashed: way == Way::Oracle,
            points: of_way
                .map(|c| DVec2::new(c.rmse, (chart.cost)(c)))
                .collect(),
        }
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
            series: series.filter(|s| !s.points.is_empty()).collect(),
        }],
    }
}

fn color_of(way: Way) -> Color {
    match way {
        Way::Clusterlod => Color::ORANGE,
        Way::Godot => Color::GREEN,
        Way::Oracle => Color::GRAY,
        _ => Color::BLUE,
    }
}

fn title_of_costs(report: &Report, label: &str) -> String {
    let ratio = report.ratio(Way::Quality, Measure::Rmse, 1.0);
    match ratio {
        Some(ratio) if label.starts_with("triangles") => format!(
            "For the same picture, fieldlod draws {:.0} % of clusterlod's triangles",
            100.0 * ratio.mean
        ),
        _ => format!("Image error against {label}"),
    }
}

fn promise_figure(report: &Report) -> Figure {
    let panels = PROMISE_FOVS_DEG
        .iter()
        .map(|&fov| promise_panel(report, fov));
    Figure {
        title: promise_title(report),
        note: format!(
            "Displacement of the surface on screen against the pixels asked for; the worst of {}.\n\
             Solid: greatest. Dashed: one point in a thousand is beyond. Gray: what was asked for.",
            subject(report)
        ),
        panels: panels.collect(),
    }
}

fn promise_title(report: &Report) -> String {
    let mut guaranteed = report.promise.iter().filter(|k| k.way == Way::Guaranteed);
    if guaranteed.all(|kept| kept.max_px <= kept.requested_px) {
        "Guaranteed keeps what it promises, towards the picture's corner too".to_owned()
    } else {
        "Guaranteed does not keep what it promises".to_owned()
    }
}

fn promise_panel(report: &Report, fovy_deg: f32) -> Panel {
    let kept = |way: Way, value: fn(&Kept) -> f64| -> Vec<DVec2> {
        let of_way = report.promise.iter();
        let of_way = of_way.filter(|k| k.way == way && k.fovy_deg == fovy_deg && value(k) > 0.0);
        of_way
            .map(|k| DVec2::new(k.requested_px, value(k)))
            .collect()
    };
    let mut series = vec![Series {
        name: "asked for".to_owned(),
        color: Color::GRAY,
        is_dashed: false,
        points: vec![DVec2::splat(0.25), DVec2::splat(8.0)],
    }];
    for (way, color) in [
        (Way::Guaranteed, Color::BLUE),
        (Way::Quality, PURPLE),
        (Way::Clusterlod, Color::ORANGE),
    ] {
        for (name, is_dashed, points) in [
            (way.name(), false, kept(way, |k| k.max_px)),
            ("", true, kept(way, |k| k.p99_9_px)),
        ] {
            series.push(Series {
                name: name.to_owned(),
                color,
                is_dashed,
                points,
            });
        }
    }
    Panel {
        name: format!("field of view {fovy_deg} degrees"),
        x: "pixels asked for".to_owned(),
        y: "measured pixels".to_owned(),
        series,
    }
}

fn temporal_figure(report: &Report) -> Figure {
    let named = [
        ("quality", Way::Quality.name(), Color::BLUE),
        ("clusterlod", Way::Clusterlod.name(), Color::ORANGE),
        ("godot4.3", Way::Godot.name(), Color::GREEN),
        ("range", Way::VisibilityRange.name(), Color::RED),
    ];
    let series = named.map(|(method, name, color)| {
        let of_way = report.temporal.iter().filter(|path| path.way == method);
        let shown = of_way.filter(|path| path.temporal_error > 0.0);
        Series {
            name: name.to_owned(),
            color,
            is_dashed: false,
            points: shown
                .map(|p| DVec2::new(p.triangles, p.temporal_error))
                .collect(),
        }
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
            series: series
                .into_iter()
                .filter(|s| !s.points.is_empty())
                .collect(),
        }],
    }
}

fn ratios_csv(report: &Report) -> String {
    let mut text = "model,way,equal,clusterlod_px,mean,least,greatest,poses\n".to_owned();
    let all = ("all", &report.ratios);
    let models = report.models.iter().map(|m| (m.name.as_str(), &m.ratios));
    for (model, ratios) in std::iter::once(all).chain(models) {
        for r in ratios {
            let _ = writeln!(
                text,
                "{model},{},{},{},{:.4},{:.4},{:.4},{}",
                r.way.name(),
                r.measure.name(),
                r.at_px,
                r.mean,
                r.least,
                r.greatest,
                r.poses
            );
        }
    }
    text
}

fn costs_csv(report: &Report) -> String {
    let mut text =
        "way,clusterlod_px,rmse,threshold_px,triangles,units,select_us,frame_ms\n".to_owned();
    for c in &report.costs {
        let _ = writeln!(
            text,
            "{},{:.2},{:.4},{:.4},{:.0},{:.1},{:.2},{:.3}",
            c.way.name(),
            c.at_px,
            c.rmse,
            c.threshold_px,
            c.triangles,
            c.units,
            c.select_us,
            c.frame_ms
        );
    }
    text
}

fn promise_csv(report: &Report) -> String {
    let mut text = "way,fovy_deg,requested_px,max_px,p99_9_px,mean_px,triangles\n".to_owned();
    for k in &report.promise {
        let _ = writeln!(
            text,
            "{},{},{},{:.4},{:.4},{:.4},{:.0}",
            k.way.name(),
            k.fovy_deg,
            k.requested_px,
            k.max_px,
            k.p99_9_px,
            k.mean_px,
            k.triangles
        );
    }
    text
}

fn temporal_csv(report: &Report) -> String {
    let mut text = "way,threshold_px,triangles,temporal_error,flips_per_frame\n".to_owned();
    for OnPath {
        way,
        threshold_px,
        triangles,
        temporal_error,
        flips_per_frame,
    } in &report.temporal
    {
        let _ = writeln!(
            text,
            "{way},{threshold_px},{triangles:.0},{temporal_error:.4},{flips_per_frame:.4}"
        );
    }
    text
}
