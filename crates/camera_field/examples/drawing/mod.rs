//! Drawing helpers of the figures: SVG pictures, planes in scene units, graphs with axes, and random numbers.

#![allow(
    dead_code,
    unused_imports,
    reason = "each example compiles this file and uses a part of it"
)]

use std::env;
use std::error::Error;
use std::fs;
use std::ops::Range;
use std::path::PathBuf;

use camera_field::double::Intrinsics;
use glam::{DVec2, DVec3, dvec3};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
pub(crate) use plotters::prelude::*;

pub(crate) type Fallible<T = ()> = Result<T, Box<dyn Error>>;
pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Coordinates = Cartesian2d<RangedCoordf64, RangedCoordf64>;
/// A part of a picture with coordinates.
pub(crate) type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Coordinates>;

pub(crate) const INK: RGBColor = RGBColor(34, 40, 49);
pub(crate) const GRAY: RGBColor = RGBColor(150, 156, 165);
pub(crate) const OURS: RGBColor = RGBColor(38, 98, 188);
pub(crate) const PAPER: RGBColor = RGBColor(206, 52, 56);
pub(crate) const OTHER: RGBColor = RGBColor(224, 122, 20);

const FONT: (&str, u32) = ("sans-serif", 16);

/// Creates the output folder: the first argument, or `paper-out`.
pub(crate) fn out_folder() -> Fallible<PathBuf> {
    let folder = PathBuf::from(env::args_os().nth(1).unwrap_or_else(|| "paper-out".into()));
    let cause = |error| format!("could not create {}: {error}", folder.display());
    fs::create_dir_all(&folder).map_err(cause)?;
    Ok(folder)
}

/// Draws an SVG picture into the output folder.
pub(crate) fn draw(
    name: &str,
    size_px: (u32, u32),
    draw: impl FnOnce(&Area) -> Fallible,
) -> Fallible {
    let path = out_folder()?.join(name);
    let area = SVGBackend::new(&path, size_px).into_drawing_area();
    area.fill(&WHITE)?;
    draw(&area)?;
    let cause = |error| format!("could not write {}: {error}", path.display());
    area.present().map_err(cause)?;
    Ok(())
}

/// A plane in scene units around `center`, with the same scale along both axes.
pub(crate) fn plane<'a, 'b>(
    area: &'a Area<'b>,
    title: &str,
    center: DVec2,
    px_per_unit: f64,
) -> Fallible<Chart<'a, 'b>> {
    const TITLE_PX: u32 = 28;
    let (width, height) = area.dim_in_pixel();
    let size_px = DVec2::new(width.into(), (height - TITLE_PX).into());
    let half = size_px * 0.5 / px_per_unit;
    let (min, max) = (center - half, center + half);
    let chart = ChartBuilder::on(area)
        .margin_top(TITLE_PX)
        .build_cartesian_2d(min.x..max.x, min.y..max.y)?;
    area.draw(&Text::new(title.to_owned(), (8, 6), FONT))?;
    Ok(chart)
}

/// A curve of a graph.
pub(crate) struct Series<'a> {
    pub(crate) name: &'a str,
    pub(crate) color: RGBColor,
    pub(crate) points: Vec<DVec2>,
}

/// A graph with axes and named curves.
pub(crate) fn graph(
    area: &Area,
    title: &str,
    x: (&str, Range<f64>),
    y: (&str, Range<f64>),
    series: &[Series],
) -> Fallible {
    let mut chart = ChartBuilder::on(area)
        .caption(title, FONT)
        .margin(10)
        .x_label_area_size(44)
        .y_label_area_size(56)
        .build_cartesian_2d(x.1, y.1)?;
    let mut mesh = chart.configure_mesh();
    mesh.x_desc(x.0).y_desc(y.0).label_style(FONT);
    mesh.light_line_style(TRANSPARENT).draw()?;
    for series in series {
        let color = series.color;
        let points = series.points.iter().map(|&point| point.into());
        let drawn = chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
        let sample = move |(x, y)| PathElement::new([(x, y), (x + 20, y)], color.stroke_width(2));
        drawn.label(series.name).legend(sample);
    }
    let mut names = chart.configure_series_labels();
    names.position(SeriesLabelPosition::UpperRight);
    names.background_style(WHITE);
    names.label_font(FONT).draw()?;
    Ok(())
}

/// A line through the points inside the chart. plotters would move points outside to the border.
pub(crate) fn curve(
    chart: &mut Chart,
    points: impl IntoIterator<Item = DVec2>,
    style: impl Into<ShapeStyle>,
) -> Fallible {
    let points = points.into_iter().filter(|&point| contains(chart, point));
    let points: Vec<(f64, f64)> = points.map(DVec2::into).collect();
    chart.draw_series([PathElement::new(points, style)])?;
    Ok(())
}

/// Returns `true` if a point is inside the chart.
pub(crate) fn contains(chart: &Chart, point: DVec2) -> bool {
    chart.x_range().contains(&point.x) && chart.y_range().contains(&point.y)
}

/// A filled shape.
pub(crate) fn fill(
    chart: &mut Chart,
    points: impl IntoIterator<Item = DVec2>,
    style: impl Into<ShapeStyle>,
) -> Fallible {
    let points: Vec<(f64, f64)> = points.into_iter().map(DVec2::into).collect();
    chart.draw_series([Polygon::new(points, style)])?;
    Ok(())
}

/// A dot with a radius in pixels.
pub(crate) fn dot(chart: &mut Chart, at: DVec2, radius_px: i32, color: RGBColor) -> Fallible {
    chart.draw_series([Circle::new(at.into(), radius_px, color.filled())])?;
    Ok(())
}

/// An arrow with a head.
pub(crate) fn arrow(chart: &mut Chart, from: DVec2, to: DVec2, color: RGBColor) -> Fallible {
    let along = (to - from) * 0.3;
    let side = along.perp() * 0.5;
    curve(chart, [from, to], color.stroke_width(2))?;
    fill(
        chart,
        [to, to - along + side, to - along - side],
        color.filled(),
    )
}

/// Colours a chart in squares of `cell` units. Squares with `None` stay white.
pub(crate) fn shade(
    chart: &mut Chart,
    cell: f64,
    color_at: impl Fn(DVec2) -> Option<RGBColor>,
) -> Fallible {
    let (x, y) = (chart.x_range(), chart.y_range());
    let steps = |range: &Range<f64>| ((range.end - range.start) / cell).ceil() as u32;
    let (columns, rows) = (steps(&x), steps(&y));
    let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let rectangles = cells.filter_map(|(column, row)| {
        let corner = DVec2::new(x.start, y.start) + DVec2::new(column.into(), row.into()) * cell;
        let color = color_at(corner + cell * 0.5)?;
        let ends = [corner, corner + cell].map(DVec2::into);
        Some(Rectangle::new(ends, color.filled()))
    });
    chart.draw_series(rectangles)?;
    Ok(())
}

/// A colour from pale to dark blue for a share from 0 to 1.
pub(crate) fn blues(share: f64) -> RGBColor {
    let (pale, dark) = (dvec3(247.0, 242.0, 240.0), dvec3(23.0, 70.0, 130.0));
    let mixed = pale.lerp(dark, share.clamp(0.0, 1.0));
    RGBColor(mixed.x as u8, mixed.y as u8, mixed.z as u8)
}

/// A camera with a field of view of 85° to each side.
pub(crate) fn wide_camera(focal_px: f64) -> Intrinsics {
    Intrinsics {
        focal_px: DVec2::splat(focal_px),
        slope_min: DVec2::splat(-12.0),
        slope_max: DVec2::splat(12.0),
    }
}

/// The point at distance `rho` and angle `phi` off the axis, in the plane y = 0.
pub(crate) fn polar(rho: f64, phi: f64) -> DVec3 {
    dvec3(phi.sin(), 0.0, phi.cos()) * rho
}

/// A point of the plane y = 0 in pictures that look along y: x to the right, depth upwards.
pub(crate) fn flat(p: DVec3) -> DVec2 {
    DVec2::new(p.x, p.z)
}

/// The random number generator xorshift64* (S. Vigna, 2016). A seed gives equal numbers on all machines.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed + 1)
    }

    /// A number in `0..1`.
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40;
        bits as f64 / f64::from(1u32 << 24)
    }

    /// A number in `min..max`.
    pub(crate) fn between(&mut self, min: f64, max: f64) -> f64 {
        min + (max - min) * self.unit()
    }
}
