//! Lines, shapes and text on a picture. Coordinates are pixels from the upper left corner.

use std::io;
use std::path::Path;

use glam::{DVec2, dvec2};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, PremultipliedColorU8, Stroke,
    Transform,
};

use crate::files::{WriteError, write_file};

/// An opaque colour, or a translucent one with [`Color::faded`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Color {
    rgb: [u8; 3],
    alpha: u8,
}

impl Color {
    pub(crate) const WHITE: Self = Self::new(255, 255, 255);
    pub(crate) const INK: Self = Self::new(34, 40, 49);
    pub(crate) const GRAY: Self = Self::new(150, 156, 165);
    pub(crate) const PALE: Self = Self::new(225, 228, 233);
    pub(crate) const BLUE: Self = Self::new(38, 98, 188);
    pub(crate) const ORANGE: Self = Self::new(224, 122, 20);
    pub(crate) const GREEN: Self = Self::new(34, 148, 84);
    pub(crate) const PURPLE: Self = Self::new(130, 72, 170);
    pub(crate) const RED: Self = Self::new(206, 52, 56);

    pub(crate) const fn new(red: u8, green: u8, blue: u8) -> Self {
        Self {
            rgb: [red, green, blue],
            alpha: 255,
        }
    }

    /// A gray from 0 (black) to 1.
    pub(crate) fn gray(value: f64) -> Self {
        let level = to_byte(value);
        Self::new(level, level, level)
    }

    /// A colour of red, green and blue in 0..=1.
    pub(crate) fn from_unit(rgb: [f64; 3]) -> Self {
        let [red, green, blue] = rgb.map(to_byte);
        Self::new(red, green, blue)
    }

    pub(crate) const fn faded(self, alpha: u8) -> Self {
        Self { alpha, ..self }
    }

    /// A colour scale from pale to dark blue, for a share of 0..=1. Lightness falls evenly.
    pub(crate) fn scale(share: f64) -> Self {
        const STOPS: [[f64; 3]; 4] = [
            [0.97, 0.98, 0.95],
            [0.66, 0.83, 0.84],
            [0.22, 0.55, 0.72],
            [0.09, 0.20, 0.42],
        ];
        // Between which stops, and how far from the first of them.
        let position = share.clamp(0.0, 1.0) * 3.0;
        let index = (position as usize).min(2);
        let rest = position - index as f64;
        let channel = |c: usize| STOPS[index][c] * (1.0 - rest) + STOPS[index + 1][c] * rest;
        Self::from_unit([channel(0), channel(1), channel(2)])
    }

    fn paint(self) -> Paint<'static> {
        let [red, green, blue] = self.rgb;
        let mut paint = Paint::default();
        paint.set_color_rgba8(red, green, blue, self.alpha);
        paint
    }
}

fn to_byte(value: f64) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Placement of a text beside its position; texts are always centred vertically on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Center,
    Right,
}

/// A rectangle of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rect {
    pub(crate) min: DVec2,
    pub(crate) size: DVec2,
}

impl Rect {
    pub(crate) const fn new(x: f64, y: f64, width: f64, height: f64) -> Self {
        Self {
            min: dvec2(x, y),
            size: dvec2(width, height),
        }
    }

    pub(crate) fn center(&self) -> DVec2 {
        self.min + self.size * 0.5
    }

    pub(crate) fn max(&self) -> DVec2 {
        self.min + self.size
    }

    fn corners(&self) -> [DVec2; 4] {
        let (min, max) = (self.min, self.max());
        [min, dvec2(max.x, min.y), max, dvec2(min.x, max.y)]
    }
}

/// A picture under way.
pub(crate) struct Canvas {
    pixmap: Pixmap,
    clip: Option<tiny_skia::Mask>,
}

impl Canvas {
    /// A white picture.
    pub(crate) fn new(width: u32, height: u32) -> Self {
        let mut pixmap = Pixmap::new(width, height).expect("pictures are not empty");
        pixmap.fill(tiny_skia::Color::WHITE);
        Self { pixmap, clip: None }
    }

    /// Restricts shapes and lines to a rectangle, until called with `None`.
    pub(crate) fn clip_to(&mut self, rect: Option<Rect>) {
        self.clip = rect.and_then(|rect| {
            let mut mask = tiny_skia::Mask::new(self.pixmap.width(), self.pixmap.height())?;
            let path = outline(&rect.corners(), true)?;
            mask.fill_path(&path, FillRule::Winding, false, Transform::identity());
            Some(mask)
        });
    }

    pub(crate) fn polygon(&mut self, points: &[DVec2], color: Color) {
        if let Some(path) = outline(points, true) {
            let (paint, clip) = (color.paint(), self.clip.as_ref());
            self.pixmap.fill_path(
                &path,
                &paint,
                FillRule::Winding,
                Transform::identity(),
                clip,
            );
        }
    }

    pub(crate) fn polyline(&mut self, points: &[DVec2], width: f64, color: Color) {
        self.stroke(points, false, width, color);
    }

    pub(crate) fn loop_line(&mut self, points: &[DVec2], width: f64, color: Color) {
        self.stroke(points, true, width, color);
    }

    pub(crate) fn line(&mut self, from: DVec2, to: DVec2, width: f64, color: Color) {
        self.stroke(&[from, to], false, width, color);
    }

    fn stroke(&mut self, points: &[DVec2], closed: bool, width: f64, color: Color) {
        if let Some(path) = outline(points, closed) {
            let stroke = Stroke {
                width: width as f32,
                line_cap: LineCap::Round,
                line_join: LineJoin::Round,
                ..Stroke::default()
            };
            let (paint, clip) = (color.paint(), self.clip.as_ref());
            self.pixmap
                .stroke_path(&path, &paint, &stroke, Transform::identity(), clip);
        }
    }

    pub(crate) fn arrow(&mut self, from: DVec2, to: DVec2, width: f64, color: Color) {
        let along = (to - from).normalize_or_zero() * (2.0 + 2.5 * width);
        let side = along.perp() * 0.55;
        self.line(from, to - along * 0.5, width, color);
        self.polygon(&[to, to - along + side, to - along - side], color);
    }

    pub(crate) fn dot(&mut self, center: DVec2, radius: f64, color: Color) {
        let path = PathBuilder::from_circle(center.x as f32, center.y as f32, radius as f32);
        if let Some(path) = path {
            let (paint, clip) = (color.paint(), self.clip.as_ref());
            self.pixmap.fill_path(
                &path,
                &paint,
                FillRule::Winding,
                Transform::identity(),
                clip,
            );
        }
    }

    pub(crate) fn frame(&mut self, rect: Rect, color: Color) {
        self.loop_line(&rect.corners(), 1.0, color);
    }

    pub(crate) fn fill(&mut self, rect: Rect, color: Color) {
        self.polygon(&rect.corners(), color);
    }

    /// Sets every pixel of a rectangle by its position, given as pixel centre from the rectangle's
    /// corner.
    pub(crate) fn shade(&mut self, rect: Rect, mut color_at: impl FnMut(DVec2) -> Color) {
        let (x0, y0) = (rect.min.x as u32, rect.min.y as u32);
        for row in 0..rect.size.y as u32 {
            for column in 0..rect.size.x as u32 {
                let color = color_at(dvec2(f64::from(column), f64::from(row)) + 0.5);
                self.set_pixel(x0 + column, y0 + row, color.rgb);
            }
        }
    }

    fn set_pixel(&mut self, x: u32, y: u32, [red, green, blue]: [u8; 3]) {
        let (width, height) = (self.pixmap.width(), self.pixmap.height());
        if x < width && y < height {
            let opaque = PremultipliedColorU8::from_rgba(red, green, blue, 255);
            let index = (y * width + x) as usize;
            self.pixmap.pixels_mut()[index] = opaque.expect("opaque colours are premultiplied");
        }
    }

    pub(crate) fn text(&mut self, at: DVec2, align: Align, text: &str, color: Color) {
        let font = (FontWeight::Regular, RasterHeight::Size16);
        self.write(at, align, text, color, font);
    }

    /// A text in ink, centred on a point.
    pub(crate) fn caption(&mut self, at: DVec2, text: &str) {
        self.text(at, Align::Center, text, Color::INK);
    }

    /// Lines of text in ink, the first of them centred on a point and the others below it.
    pub(crate) fn captions(&mut self, at: DVec2, lines: &[&str]) {
        for (row, line) in lines.iter().enumerate() {
            self.caption(at + DVec2::new(0.0, 20.0 * row as f64), line);
        }
    }

    /// A text in large, bold letters, centred on a point.
    pub(crate) fn title(&mut self, at: DVec2, text: &str) {
        let font = (FontWeight::Bold, RasterHeight::Size20);
        self.write(at, Align::Center, text, Color::INK, font);
    }

    /// A text in large, bold letters, to the right of a point.
    pub(crate) fn heading(&mut self, at: DVec2, text: &str) {
        let font = (FontWeight::Bold, RasterHeight::Size20);
        self.write(at, Align::Left, text, Color::INK, font);
    }

    fn write(
        &mut self,
        at: DVec2,
        align: Align,
        text: &str,
        color: Color,
        (weight, height): (FontWeight, RasterHeight),
    ) {
        // Where the first letter begins.
        let advance = get_raster_width(weight, height) as f64;
        let width = advance * text.chars().count() as f64;
        let left = match align {
            Align::Left => at.x,
            Align::Center => at.x - 0.5 * width,
            Align::Right => at.x - width,
        };
        let top = (at.y - 0.5 * height.val() as f64).round();
        // Letter by letter, each a small picture of how much it covers of every pixel.
        for (index, letter) in text.chars().enumerate() {
            let Some(raster) = get_raster(letter, weight, height) else {
                continue;
            };
            let x = (left + advance * index as f64).round();
            for (row, line) in raster.rows().enumerate() {
                for (column, &cover) in line.iter().enumerate() {
                    self.blend(
                        x as i64 + column as i64,
                        top as i64 + row as i64,
                        color,
                        cover,
                    );
                }
            }
        }
    }

    fn blend(&mut self, x: i64, y: i64, color: Color, cover: u8) {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else {
            return;
        };
        let Some(below) = self.pixmap.pixel(x, y) else {
            return;
        };
        // The colour over what is below, by how much of the pixel it covers.
        let mix = |over: u8, under: u8| {
            let cover = u32::from(cover);
            ((u32::from(over) * cover + u32::from(under) * (255 - cover)) / 255) as u8
        };
        let [red, green, blue] = color.rgb;
        let mixed = [
            mix(red, below.red()),
            mix(green, below.green()),
            mix(blue, below.blue()),
        ];
        self.set_pixel(x, y, mixed);
    }

    /// Writes the picture as PNG.
    pub(crate) fn save(&self, path: &Path) -> Result<(), WriteError> {
        let encoded = self.pixmap.encode_png();
        let bytes = encoded.map_err(|error| WriteError::new(path, io::Error::other(error)))?;
        write_file(path, &bytes)
    }
}

fn outline(points: &[DVec2], closed: bool) -> Option<tiny_skia::Path> {
    let mut builder = PathBuilder::new();
    let (first, rest) = points.split_first()?;
    builder.move_to(first.x as f32, first.y as f32);
    for point in rest {
        builder.line_to(point.x as f32, point.y as f32);
    }
    if closed {
        builder.close();
    }
    builder.finish()
}
