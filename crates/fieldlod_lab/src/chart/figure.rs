//! A picture of one or more charts side by side, with the name of each curve beside it.

use std::path::Path;

use glam::{DVec2, dvec2};

use crate::canvas::{Align, Canvas, Color, Rect};
use crate::files::WriteError;
use crate::method::Method;
use crate::plot::{Axis, Plot};

const PANEL_SIZE: DVec2 = dvec2(560.0, 400.0);
/// Left for tick labels, above for titles, right for names, below for the axis.
const LEFT: f64 = 84.0;
const ABOVE: f64 = 144.0;
const RIGHT: f64 = 216.0;
const BELOW: f64 = 64.0;
/// Least distance of two names.
const NAME_HEIGHT: f64 = 19.0;

/// A picture of one or more charts side by side.
pub(super) struct Figure {
    /// The sentence that the picture shows.
    pub(super) title: String,
    /// What is measured, and on which models.
    pub(super) note: String,
    pub(super) panels: Vec<Panel>,
}

/// Curves in logarithmic axes.
pub(super) struct Panel {
    pub(super) name: String,
    pub(super) x: String,
    pub(super) y: String,
    pub(super) series: Vec<Series>,
}

/// A curve; nothing is drawn of one without points.
pub(super) struct Series {
    pub(super) name: String,
    pub(super) color: Color,
    pub(super) is_dashed: bool,
    pub(super) points: Vec<DVec2>,
}

impl Series {
    /// A curve of a method, in its colour, through those of `points` that logarithmic axes have. It is
    /// dashed for what knows the pictures, and for what separates the criterion from the levels.
    pub(super) fn new(method: Method, points: impl Iterator<Item = DVec2>) -> Self {
        Self {
            name: method.label(),
            color: match method {
                Method::Clusterlod | Method::ClusterlodOnOurLevels => Color::ORANGE,
                Method::Godot43 => Color::GREEN,
                Method::Guaranteed => Color::PURPLE,
                Method::Oracle => Color::GRAY,
                Method::VisibilityRange => Color::RED,
                _ => Color::BLUE,
            },
            is_dashed: matches!(method, Method::Oracle | Method::ClusterlodOnOurLevels),
            points: points.filter(|point| point.min_element() > 0.0).collect(),
        }
    }
}

impl Figure {
    pub(super) fn draw(&self, path: &Path) -> Result<(), WriteError> {
        let step = LEFT + PANEL_SIZE.x + RIGHT;
        let width = step * self.panels.len() as f64;
        let height = ABOVE + PANEL_SIZE.y + BELOW;
        let mut canvas = Canvas::new(width as u32, height as u32);
        // Title and notes.
        canvas.heading(dvec2(24.0, 32.0), &self.title);
        for (line, text) in self.note.lines().enumerate() {
            let at = dvec2(24.0, 58.0 + 20.0 * line as f64);
            canvas.text(at, Align::Left, text, Color::INK);
        }
        // One scale for all panels, so that they can be compared.
        let series = self.panels.iter().flat_map(|panel| &panel.series);
        let all: Vec<DVec2> = series.flat_map(|series| &series.points).copied().collect();
        for (index, panel) in self.panels.iter().enumerate() {
            let left = LEFT + step * index as f64;
            let plot = Plot {
                area: Rect::new(left, ABOVE, PANEL_SIZE.x, PANEL_SIZE.y),
                x: Axis::logarithmic(&panel.x, all.iter().map(|p| p.x)),
                y: Axis::logarithmic(&panel.label(), all.iter().map(|p| p.y)),
            };
            panel.draw(&mut canvas, &plot);
        }
        canvas.save(path)
    }
}

impl Panel {
    /// The text above the chart.
    fn label(&self) -> String {
        if self.name.is_empty() {
            self.y.clone()
        } else {
            format!("{}: {}", self.name, self.y)
        }
    }

    fn draw(&self, canvas: &mut Canvas, plot: &Plot) {
        // The frame, the curves, and their names on top.
        plot.draw_frame(canvas);
        for series in &self.series {
            if series.is_dashed {
                plot.dashed_curve(canvas, &series.points, series.color);
            } else {
                plot.curve(canvas, &series.points, series.color);
            }
        }
        self.draw_names(canvas, plot);
    }

    /// Each name at the end of its curve, moved apart where they would overlap.
    fn draw_names(&self, canvas: &mut Canvas, plot: &Plot) {
        let end = |series: &Series| {
            let points = series.points.iter().copied();
            let last = points.max_by(|a, b| a.x.total_cmp(&b.x));
            last.map(|last| plot.place(last))
        };
        // From top to bottom.
        let named = self.series.iter().filter(|series| !series.name.is_empty());
        let mut names: Vec<(&Series, DVec2)> = named.filter_map(|s| Some((s, end(s)?))).collect();
        names.sort_by(|a, b| a.1.y.total_cmp(&b.1.y));
        // Each name is below the one before it, and above room enough for those that follow.
        let area = plot.area;
        let mut lowest = area.max().y - NAME_HEIGHT * names.len() as f64;
        let mut free = area.min.y;
        for (series, end) in names {
            lowest += NAME_HEIGHT;
            let y = end.y.max(free).min(lowest);
            free = y + NAME_HEIGHT;
            let at = dvec2(area.max().x + 14.0, y);
            let color = series.color.faded(110);
            canvas.line(end, at - dvec2(3.0, 0.0), 1.0, color);
            canvas.text(at, Align::Left, &series.name, series.color);
        }
    }
}
