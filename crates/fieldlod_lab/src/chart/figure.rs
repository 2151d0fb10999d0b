//! Charts of few curves with their names beside them.

use std::path::Path;

use glam::DVec2;

use crate::canvas::{Align, Canvas, Color, Rect};
use crate::files::WriteError;

const PANEL_SIZE: DVec2 = DVec2::new(560.0, 400.0);
/// Left for tick labels, above for titles, right for names, below for the axis.
const LEFT: f64 = 84.0;
const ABOVE: f64 = 124.0;
const RIGHT: f64 = 216.0;
const BELOW: f64 = 64.0;
/// Least distance of two names.
const NAME_HEIGHT: f64 = 19.0;

/// A picture of one or more charts side by side.
pub(super) struct Figure {
    /// The sentence that the picture shows.
    pub(super) title: String,
    /// What is measured, and on what.
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

pub(super) struct Series {
    pub(super) name: String,
    pub(super) color: Color,
    pub(super) is_dashed: bool,
    pub(super) points: Vec<DVec2>,
}

impl Figure {
    pub(super) fn draw(&self, path: &Path) -> Result<(), WriteError> {
        let step = LEFT + PANEL_SIZE.x + RIGHT;
        let width = step * self.panels.len() as f64;
        let height = ABOVE + PANEL_SIZE.y + BELOW;
        let mut canvas = Canvas::new(width as u32, height as u32);
        canvas.title(DVec2::new(24.0, 32.0), Align::Left, &self.title);
        for (line, text) in self.note.lines().enumerate() {
            let at = DVec2::new(24.0, 58.0 + 20.0 * line as f64);
            canvas.text(at, Align::Left, text, Color::INK);
        }
        // One scale for all panels, so that they can be compared.
        let series = self.panels.iter().flat_map(|panel| &panel.series);
        let all: Vec<DVec2> = series.flat_map(|series| &series.points).copied().collect();
        let axes = Axes {
            x: LogAxis::around(all.iter().map(|p| p.x)),
            y: LogAxis::around(all.iter().map(|p| p.y)),
        };
        for (index, panel) in self.panels.iter().enumerate() {
            let left = LEFT + step * index as f64;
            let area = Rect::new(left, ABOVE, PANEL_SIZE.x, PANEL_SIZE.y);
            panel.draw(&mut canvas, area, &axes);
        }
        canvas.save(path)
    }
}

impl Panel {
    fn draw(&self, canvas: &mut Canvas, area: Rect, axes: &Axes) {
        let Axes { x, y } = axes;
        let place = |p: DVec2| area.min + DVec2::new(x.share(p.x), 1.0 - y.share(p.y)) * area.size;
        self.draw_frame(canvas, area, x, y);
        for series in &self.series {
            let points: Vec<DVec2> = series.points.iter().map(|&p| place(p)).collect();
            if series.is_dashed {
                dashes(canvas, &points, series.color);
            } else {
                canvas.polyline(&points, 3.0, series.color);
            }
        }
        self.draw_names(canvas, area, place);
    }

    fn draw_frame(&self, canvas: &mut Canvas, area: Rect, x: &LogAxis, y: &LogAxis) {
        let (min, max) = (area.min, area.max());
        for tick in x.ticks() {
            let at = min.x + x.share(tick) * area.size.x;
            canvas.line(
                DVec2::new(at, min.y),
                DVec2::new(at, max.y),
                1.0,
                Color::PALE,
            );
            let below = DVec2::new(at, max.y + 14.0);
            canvas.text(below, Align::Center, &number(tick), Color::INK);
        }
        for tick in y.ticks() {
            let at = max.y - y.share(tick) * area.size.y;
            canvas.line(
                DVec2::new(min.x, at),
                DVec2::new(max.x, at),
                1.0,
                Color::PALE,
            );
            let beside = DVec2::new(min.x - 8.0, at);
            canvas.text(beside, Align::Right, &number(tick), Color::INK);
        }
        canvas.frame(area, Color::GRAY);
        let below = DVec2::new(area.center().x, max.y + 38.0);
        canvas.text(below, Align::Center, &self.x, Color::INK);
        let above = min - DVec2::new(60.0, 14.0);
        let label = if self.name.is_empty() {
            self.y.clone()
        } else {
            format!("{}: {}", self.name, self.y)
        };
        canvas.text(above, Align::Left, &label, Color::INK);
    }

    /// Each name at the end of its curve, moved apart where they would overlap.
    fn draw_names(&self, canvas: &mut Canvas, area: Rect, place: impl Fn(DVec2) -> DVec2) {
        let named = self.series.iter().filter(|series| !series.name.is_empty());
        let end = |series: &Series| {
            let ends = series
                .points
                .iter()
                .copied()
                .max_by(|a, b| a.x.total_cmp(&b.x));
            ends.map(&place)
        };
        let mut names: Vec<(&Series, DVec2)> = named.filter_map(|s| Some((s, end(s)?))).collect();
        names.sort_by(|a, b| a.1.y.total_cmp(&b.1.y));
        let lowest = area.max().y - NAME_HEIGHT * names.len() as f64;
        let mut free = area.min.y;
        for (index, (series, end)) in names.iter().enumerate() {
            let y = end
                .y
                .max(free)
                .min(lowest + NAME_HEIGHT * (index as f64 + 1.0));
            free = y + NAME_HEIGHT;
            let at = DVec2::new(area.max().x + 14.0, y);
            let color = series.color.faded(110);
            canvas.line(*end, at - DVec2::new(3.0, 0.0), 1.0, color);
            canvas.text(at, Align::Left, &series.name, series.color);
        }
    }
}

fn dashes(canvas: &mut Canvas, points: &[DVec2], color: Color) {
    const DASH: f64 = 8.0;
    for pair in points.windows(2) {
        let (from, along) = (pair[0], pair[1] - pair[0]);
        let count = (along.length() / (2.0 * DASH)).ceil().max(1.0) as u32;
        for dash in 0..count {
            let at = |share: f64| from + along * ((f64::from(dash) + share) / f64::from(count));
            canvas.line(at(0.0), at(0.5), 2.0, color);
        }
    }
}

struct Axes {
    x: LogAxis,
    y: LogAxis,
}

/// A logarithmic axis.
struct LogAxis {
    least: f64,
    greatest: f64,
}

impl LogAxis {
    /// Holds all values, with a little room.
    fn around(values: impl Iterator<Item = f64>) -> Self {
        let usable = values.filter(|value| *value > 0.0 && value.is_finite());
        let ends = (f64::INFINITY, 0.0);
        let (least, greatest) = usable.fold(ends, |(a, b), v| (f64::min(a, v), f64::max(b, v)));
        if least <= greatest {
            let room = (greatest / least).powf(0.05).max(1.1);
            Self {
                least: least / room,
                greatest: greatest * room,
            }
        } else {
            Self {
                least: 0.1,
                greatest: 10.0,
            }
        }
    }

    fn share(&self, value: f64) -> f64 {
        (value / self.least).ln() / (self.greatest / self.least).ln()
    }

    /// 1, 2 and 5 times powers of ten; powers of ten alone over a wide range, more over a narrow one.
    fn ticks(&self) -> Vec<f64> {
        let decades = (self.greatest / self.least).log10();
        let steps: &[f64] = match decades {
            3.0.. => &[1.0],
            1.0.. => &[1.0, 2.0, 5.0],
            _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
        };
        let first = self.least.log10().floor() as i32;
        let powers = (first..=first + decades.ceil() as i32 + 1).map(|power| 10f64.powi(power));
        let ticks = powers.flat_map(|power| steps.iter().map(move |step| step * power));
        let inside = |tick: &f64| (self.least..=self.greatest).contains(tick);
        ticks.filter(inside).collect()
    }
}

/// 0.05, 2, 500, 20k, 3M.
pub(super) fn number(value: f64) -> String {
    match value {
        1e6.. => format!("{}M", trimmed(value / 1e6)),
        1e3.. => format!("{}k", trimmed(value / 1e3)),
        _ => trimmed(value),
    }
}

/// Three digits, no zeros at the end.
fn trimmed(value: f64) -> String {
    let digits = (2.0 - value.abs().max(1e-12).log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let texts = [0.05, 2.0, 500.0, 20_000.0, 3e6, 0.123_456].map(number);
        assert_eq!(texts, ["0.05", "2", "500", "20k", "3M", "0.123"]);
    }

    #[test]
    fn ticks_lie_on_the_axis() {
        let axis = LogAxis::around([1.0, 30.0].into_iter());
        assert_eq!(axis.ticks(), [1.0, 2.0, 5.0, 10.0, 20.0]);
        let narrow = LogAxis::around([9.0, 21.0].into_iter());
        assert_eq!(narrow.ticks(), [10.0, 15.0, 20.0]);
    }
}
