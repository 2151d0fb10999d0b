//! The axes of a chart, linear or logarithmic, and curves in them.

use std::ops::RangeInclusive;

use glam::{DVec2, dvec2};

use crate::canvas::{Align, Canvas, Color, Rect};

/// One axis of a chart.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    label: String,
    range: RangeInclusive<f64>,
    is_logarithmic: bool,
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// A linear axis with ticks at equal steps.
    pub(crate) fn linear(
        label: &str,
        range: RangeInclusive<f64>,
        step: f64,
        decimals: usize,
    ) -> Self {
        let count = ((range.end() - range.start()) / step + 0.5) as u32;
        let ticks = (0..=count).map(|index| range.start() + step * f64::from(index));
        Self {
            label: label.to_owned(),
            ticks: ticks
                .map(|tick| (tick, format!("{tick:.decimals$}")))
                .collect(),
            is_logarithmic: false,
            range,
        }
    }

    /// A logarithmic axis that holds all values, with a little room.
    pub(crate) fn logarithmic(label: &str, values: impl Iterator<Item = f64>) -> Self {
        // From the least value to the greatest, with a twentieth of room on each side.
        let usable = values.filter(|value| *value > 0.0 && value.is_finite());
        let ends = (f64::INFINITY, 0.0);
        let (least, greatest) = usable.fold(ends, |(a, b), v| (f64::min(a, v), f64::max(b, v)));
        let range = if least <= greatest {
            let room = (greatest / least).powf(0.05).max(1.1);
            least / room..=greatest * room
        } else {
            0.1..=10.0
        };
        let ticks = logarithmic_ticks(&range).into_iter();
        Self {
            label: label.to_owned(),
            ticks: ticks.map(|tick| (tick, short_number(tick))).collect(),
            is_logarithmic: true,
            range,
        }
    }

    /// The share of the axis that lies before a value, from 0 to 1.
    fn share(&self, value: f64) -> f64 {
        let (least, greatest) = (*self.range.start(), *self.range.end());
        if self.is_logarithmic {
            (value / least).ln() / (greatest / least).ln()
        } else {
            (value - least) / (greatest - least)
        }
    }
}

/// 1, 2 and 5 times powers of ten; powers of ten alone over a wide range, more over a narrow one.
fn logarithmic_ticks(range: &RangeInclusive<f64>) -> Vec<f64> {
    let decades = (range.end() / range.start()).log10();
    let steps: &[f64] = match decades {
        3.0.. => &[1.0],
        1.0.. => &[1.0, 2.0, 5.0],
        _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
    };
    // All steps of all powers of ten around the range, but for those outside of it.
    let first = range.start().log10().floor() as i32;
    let powers = (first..=first + decades.ceil() as i32 + 1).map(|power| 10f64.powi(power));
    let ticks = powers.flat_map(|power| steps.iter().map(move |step| step * power));
    ticks.filter(|tick| range.contains(tick)).collect()
}

/// A chart in a rectangle of a picture; labels lie outside of the rectangle.
#[derive(Clone, Debug)]
pub(crate) struct Plot {
    pub(crate) area: Rect,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
}

impl Plot {
    /// Draws frame, grid, tick labels and axis labels. The label of y stands above the axis.
    pub(crate) fn draw_frame(&self, canvas: &mut Canvas) {
        let (min, max) = (self.area.min, self.area.max());
        // A line and a number for each tick.
        for (tick, text) in &self.x.ticks {
            let x = min.x + self.x.share(*tick) * self.area.size.x;
            canvas.line(dvec2(x, min.y), dvec2(x, max.y), 1.0, Color::PALE);
            canvas.caption(dvec2(x, max.y + 14.0), text);
        }
        for (tick, text) in &self.y.ticks {
            let y = max.y - self.y.share(*tick) * self.area.size.y;
            canvas.line(dvec2(min.x, y), dvec2(max.x, y), 1.0, Color::PALE);
            canvas.text(dvec2(min.x - 8.0, y), Align::Right, text, Color::INK);
        }
        // The frame and what the axes are.
        canvas.frame(self.area, Color::GRAY);
        let below = dvec2(self.area.center().x, max.y + 38.0);
        canvas.caption(below, &self.x.label);
        let above = dvec2((min.x - 60.0).max(8.0), min.y - 16.0);
        canvas.text(above, Align::Left, &self.y.label, Color::INK);
    }

    /// The place of a pair of values in the picture, in pixels.
    pub(crate) fn place(&self, value: DVec2) -> DVec2 {
        let share = dvec2(self.x.share(value.x), 1.0 - self.y.share(value.y));
        self.area.min + share * self.area.size
    }

    /// Draws a line through pairs of values.
    pub(crate) fn curve(&self, canvas: &mut Canvas, values: &[DVec2], color: Color) {
        let points: Vec<DVec2> = values.iter().map(|&value| self.place(value)).collect();
        canvas.clip_to(Some(self.area));
        canvas.polyline(&points, 2.5, color);
        canvas.clip_to(None);
    }

    /// Draws the same line in dashes.
    pub(crate) fn dashed_curve(&self, canvas: &mut Canvas, values: &[DVec2], color: Color) {
        const DASH: f64 = 8.0;
        for pair in values.windows(2) {
            let [from, to] = [self.place(pair[0]), self.place(pair[1])];
            let count = (from.distance(to) / (2.0 * DASH)).ceil().max(1.0) as u32;
            for dash in 0..count {
                let share = |half: f64| (f64::from(dash) + half) / f64::from(count);
                let ends = [0.0, 0.5].map(|half| from.lerp(to, share(half)));
                canvas.line(ends[0], ends[1], 2.0, color);
            }
        }
    }

    /// Draws dots in place of a line, for measured values on a computed curve.
    pub(crate) fn dots(&self, canvas: &mut Canvas, values: &[DVec2], color: Color) {
        for &value in values {
            canvas.dot(self.place(value), 4.0, color);
        }
    }
}

/// Draws the names of curves, one below the other.
pub(crate) fn draw_legend(canvas: &mut Canvas, at: DVec2, entries: &[(&str, Color)]) {
    for (row, &(name, color)) in entries.iter().enumerate() {
        let left = at + dvec2(0.0, 20.0 * row as f64);
        canvas.line(left, left + dvec2(24.0, 0.0), 3.0, color);
        canvas.text(left + dvec2(32.0, 0.0), Align::Left, name, Color::INK);
    }
}

/// 0.05, 2, 500, 20k, 3M.
fn short_number(value: f64) -> String {
    match value {
        1e6.. => format!("{}M", three_digits(value / 1e6)),
        1e3.. => format!("{}k", three_digits(value / 1e3)),
        _ => three_digits(value),
    }
}

/// Three digits, no zeros at the end.
fn three_digits(value: f64) -> String {
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
        let texts = [0.05, 2.0, 500.0, 20_000.0, 3e6, 0.123_456].map(short_number);
        assert_eq!(texts, ["0.05", "2", "500", "20k", "3M", "0.123"]);
    }

    #[test]
    fn ticks_lie_on_the_axis() {
        let ticks = |values: [f64; 2]| -> Vec<f64> {
            let axis = Axis::logarithmic("", values.into_iter());
            axis.ticks.iter().map(|tick| tick.0).collect()
        };
        assert_eq!(ticks([1.0, 30.0]), [1.0, 2.0, 5.0, 10.0, 20.0]);
        assert_eq!(ticks([9.0, 21.0]), [10.0, 15.0, 20.0]);
    }
}
