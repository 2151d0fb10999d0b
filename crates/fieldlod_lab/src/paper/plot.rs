//! A line chart: a frame with ticks, curves and a legend.

use core::ops::RangeInclusive;

use glam::DVec2;

use crate::canvas::{Align, Canvas, Color, Rect};

/// One axis of a chart.
pub(super) struct Axis<'a> {
    pub(super) label: &'a str,
    pub(super) range: RangeInclusive<f64>,
    pub(super) step: f64,
    pub(super) decimals: usize,
}

impl Axis<'_> {
    fn share(&self, value: f64) -> f64 {
        (value - self.range.start()) / (self.range.end() - self.range.start())
    }

    fn ticks(&self) -> impl Iterator<Item = f64> {
        let count = ((self.range.end() - self.range.start()) / self.step + 0.5) as u32;
        (0..=count).map(|index| self.range.start() + self.step * f64::from(index))
    }
}

/// A chart in a rectangle of a picture; labels lie outside of the rectangle.
pub(super) struct Chart<'a> {
    pub(super) area: Rect,
    pub(super) x: Axis<'a>,
    pub(super) y: Axis<'a>,
}

impl Chart<'_> {
    /// Frame, grid, tick labels and axis labels. The y label stands above the axis.
    pub(super) fn draw_frame(&self, canvas: &mut Canvas) {
        let (min, max) = (self.area.min, self.area.max());
        for tick in self.x.ticks() {
            let x = self.place(DVec2::new(tick, *self.y.range.start())).x;
            canvas.line(DVec2::new(x, min.y), DVec2::new(x, max.y), 1.0, Color::PALE);
            let text = format!("{tick:.*}", self.x.decimals);
            canvas.text(
                DVec2::new(x, max.y + 14.0),
                Align::Center,
                &text,
                Color::INK,
            );
        }
        for tick in self.y.ticks() {
            let y = self.place(DVec2::new(*self.x.range.start(), tick)).y;
            canvas.line(DVec2::new(min.x, y), DVec2::new(max.x, y), 1.0, Color::PALE);
            let text = format!("{tick:.*}", self.y.decimals);
            canvas.text(DVec2::new(min.x - 8.0, y), Align::Right, &text, Color::INK);
        }
        canvas.frame(self.area, Color::GRAY);
        let below = DVec2::new(self.area.center().x, max.y + 36.0);
        canvas.text(below, Align::Center, self.x.label, Color::INK);
        canvas.text(
            min - DVec2::new(0.0, 16.0),
            Align::Left,
            self.y.label,
            Color::INK,
        );
    }

    /// Where a pair of values lies in the picture.
    pub(super) fn place(&self, value: DVec2) -> DVec2 {
        let share = DVec2::new(self.x.share(value.x), 1.0 - self.y.share(value.y));
        self.area.min + share * self.area.size
    }

    pub(super) fn curve(&self, canvas: &mut Canvas, values: &[DVec2], color: Color) {
        let points: Vec<DVec2> = values.iter().map(|&value| self.place(value)).collect();
        canvas.clip_to(Some(self.area));
        canvas.polyline(&points, 2.5, color);
        canvas.clip_to(None);
    }

    /// Dots in place of a line, for measured values on a computed curve.
    pub(super) fn dots(&self, canvas: &mut Canvas, values: &[DVec2], color: Color) {
        for &value in values {
            canvas.dot(self.place(value), 4.0, color);
        }
    }
}

/// Names of the curves, one below the other.
pub(super) fn draw_legend(canvas: &mut Canvas, at: DVec2, entries: &[(&str, Color)]) {
    for (row, &(name, color)) in entries.iter().enumerate() {
        let y = at.y + 20.0 * row as f64;
        canvas.line(DVec2::new(at.x, y), DVec2::new(at.x + 24.0, y), 3.0, color);
        canvas.text(DVec2::new(at.x + 32.0, y), Align::Left, name, Color::INK);
    }
}
