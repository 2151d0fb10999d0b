//! The chart as a picture: triangles against image error.

use std::error::Error;
use std::ops::Range;
use std::path::Path;

use fieldlod_cli::output::{Failure, write_whole};
use plotters::prelude::*;

use super::curve::Measure;
use super::report::{Report, TrianglesAtError};
use crate::method::Method;

const SIZE_PX: (u32, u32) = (860, 600);
const TITLE: (&str, u32) = ("sans-serif", 24);
const TEXT: (&str, u32) = ("sans-serif", 15);
/// The methods that are drawn. [`Method::Guaranteed`] is missing because it limits displacements, not image errors.
/// [`Method::VisibilityRange`] is missing because it reaches clusterlod's errors in few poses only.
const DRAWN: [Method; 4] = [
    Method::Clusterlod,
    Method::ClusterlodOnOurLevels,
    Method::Godot,
    Method::Quality,
];

/// Writes the chart to `triangles.svg` and its numbers to `report.json` in a folder.
///
/// # Errors
/// If a file could not be written.
pub fn draw_chart(report: &Report, folder: &Path) -> Result<(), Failure> {
    let numbers = folder.join("report.json");
    write_whole(&numbers, &serde_json::to_vec(report)?)?;
    let picture = folder.join("triangles.svg");
    let mut svg = String::new();
    draw(report, &mut svg).map_err(|error| Failure::new(&picture, error))?;
    write_whole(&picture, svg.as_bytes())
}

fn draw(report: &Report, svg: &mut String) -> Result<(), Box<dyn Error>> {
    let area = SVGBackend::with_string(svg, SIZE_PX).into_drawing_area();
    area.fill(&WHITE)?;
    area.draw(&Text::new(title(report), (24, 20), TITLE))?;
    for (line, text) in (0..).zip(notes(report)) {
        area.draw(&Text::new(text, (24, 54 + 20 * line), TEXT))?;
    }
    let drawn = |point: &&TrianglesAtError| DRAWN.contains(&point.method);
    let points = || report.curves.iter().filter(drawn);
    let x = range(points().map(|point| point.rmse));
    let y = range(points().map(|point| point.triangles));
    let (x_ticks, y_ticks) = (ticks(&x), ticks(&y));
    let mut chart = ChartBuilder::on(&area)
        .margin(24)
        // The title and the notes are above the chart.
        .margin_top(100)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(
            x.log_scale().with_key_points(x_ticks),
            y.log_scale().with_key_points(y_ticks),
        )?;
    let mut mesh = chart.configure_mesh();
    mesh.x_desc("image error: RMSE, in levels of 255")
        .y_desc("triangles in view")
        .y_label_formatter(&|triangles| thousands(*triangles))
        .light_line_style(TRANSPARENT)
        .label_style(TEXT)
        .draw()?;
    for method in DRAWN {
        let curve = points().filter(|point| point.method == method);
        let curve: Vec<(f64, f64)> = curve.map(|point| (point.rmse, point.triangles)).collect();
        let style = color(method).stroke_width(2);
        // A dashed line separates the gain of the levels from that of the criterion.
        let drawn = if method == Method::ClusterlodOnOurLevels {
            chart.draw_series(DashedLineSeries::new(curve, 8, 6, style))?
        } else {
            chart.draw_series(LineSeries::new(curve, style))?
        };
        let sample = move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style);
        drawn.label(method.name()).legend(sample);
    }
    let mut labels = chart.configure_series_labels();
    labels.position(SeriesLabelPosition::UpperRight);
    labels.background_style(WHITE).label_font(TEXT).draw()?;
    area.present()?;
    Ok(())
}

fn title(report: &Report) -> String {
    match report.all.ratio(Method::Quality, Measure::Rmse, 1.0) {
        Some(ratio) => format!(
            "For the same image error, fieldlod draws {:.0} % of clusterlod's triangles",
            100.0 * ratio.mean
        ),
        None => "Triangles against image error".to_owned(),
    }
}

fn notes(report: &Report) -> [String; 2] {
    let models = report.models.iter();
    let names: Vec<&str> = models.map(|model| model.name.as_str()).collect();
    let ([width, height], poses, adapter) = (report.size_px, report.poses, &report.adapter);
    [
        format!(
            "Geometric means over {}; {poses} poses each, pictures of {width} x {height} px.",
            names.join(", "),
        ),
        format!("clusterlod has its own levels, all others ours. Drawn by {adapter}."),
    ]
}

fn color(method: Method) -> RGBColor {
    match method {
        Method::Clusterlod => RGBColor(224, 122, 20),
        Method::ClusterlodOnOurLevels => RGBColor(150, 156, 165),
        Method::Godot | Method::VisibilityRange => RGBColor(34, 148, 84),
        _ => RGBColor(38, 98, 188),
    }
}

/// The range of some values, with a margin of 10 %.
fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let ends = (f64::INFINITY, 0.0);
    let (least, greatest) = values.fold(ends, |(a, b), v| (f64::min(a, v), f64::max(b, v)));
    if least > 0.0 && least <= greatest {
        least / 1.1..greatest * 1.1
    } else {
        // An axis needs a range even if no point could be compared.
        0.1..10.0
    }
}

/// The ticks of an axis: 1, 2 and 5 times powers of ten.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    let powers = (-9..=12).map(|power| 10f64.powi(power));
    let ticks = powers.flat_map(|power| [power, 2.0 * power, 5.0 * power]);
    ticks.filter(|tick| range.contains(tick)).collect()
}

/// Formats a number as `500` or `20k`.
fn thousands(count: f64) -> String {
    if count >= 1e3 {
        format!("{:.0}k", count / 1e3)
    } else {
        format!("{count:.0}")
    }
}
