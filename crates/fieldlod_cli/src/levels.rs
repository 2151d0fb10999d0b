//! A picture of the levels of a hierarchy side by side, coarser to the right, drawn in software.
//!
//! Each panel shows the coarsest cut whose groups below its level are all refined, in the colour of
//! the level at which each unit stands: orthographic, from half above, in the unit's flat shade.

use std::io::Cursor;

use fieldlod_hierarchy::{Hierarchy, Unit};
use glam::{Mat3, Vec2, Vec3};
use image::{ImageError, ImageFormat, Rgb, RgbImage};

const PANEL_PX: u32 = 400;
const MARGIN_PX: f32 = 12.0;
const COLUMNS: u32 = 5;
const BACKGROUND: [f32; 3] = [0.11, 0.12, 0.14];

/// The colours of levels 0, 1, …, told apart by colour-blind eyes too (M. Okabe, K. Ito, 2008).
const COLORS: [[f32; 3]; 8] = [
    [0.90, 0.90, 0.90],
    [0.34, 0.71, 0.91],
    [0.00, 0.62, 0.45],
    [0.94, 0.89, 0.26],
    [0.90, 0.62, 0.00],
    [0.84, 0.37, 0.00],
    [0.80, 0.47, 0.65],
    [0.00, 0.45, 0.70],
];

/// The bytes of a PNG file.
pub(crate) fn draw_levels(hierarchy: &Hierarchy) -> Result<Vec<u8>, ImageError> {
    // Panels in rows, from the finest level to the coarsest.
    let levels = hierarchy.level_count().max(1);
    let (columns, rows) = (levels.min(COLUMNS), levels.div_ceil(COLUMNS));
    let background = Rgb(BACKGROUND.map(to_byte));
    let mut picture = RgbImage::from_pixel(columns * PANEL_PX, rows * PANEL_PX, background);
    let view = View::of(hierarchy);
    for level in 0..levels {
        // Each unit of the level's cut in the colour of its own level.
        let mut panel = Panel::new();
        for unit in units_of_cut(hierarchy, level) {
            let color = COLORS[hierarchy.level_of(unit) as usize % COLORS.len()];
            for triangle in hierarchy.triangles_of(unit) {
                let corners = triangle.map(|v| hierarchy.vertices.positions[v as usize]);
                panel.draw(corners.map(|corner| view.panel_from_local(corner)), color);
            }
        }
        let (left, top) = (level % COLUMNS * PANEL_PX, level / COLUMNS * PANEL_PX);
        panel.copy_to(&mut picture, left, top);
    }
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

/// The cut that refines the groups from `level` on, and those that nothing coarser replaces.
pub(crate) fn units_of_cut(hierarchy: &Hierarchy, level: u32) -> impl Iterator<Item = &Unit> {
    let mut refined: Vec<bool> = hierarchy.groups.iter().map(|g| g.level >= level).collect();
    hierarchy.close_refinement(&mut refined);
    let drawn: Vec<usize> = hierarchy.drawn_units(&refined).collect();
    drawn.into_iter().map(|unit| &hierarchy.units[unit])
}

struct View {
    view_from_local: Mat3,
    center: Vec2,
    px_per_local: f32,
}

impl View {
    /// Looks from a quarter to the right and half above, so that the whole mesh fits a panel.
    fn of(hierarchy: &Hierarchy) -> Self {
        let view_from_local = Mat3::from_rotation_x(0.5) * Mat3::from_rotation_y(-0.6);
        let positions = hierarchy.vertices.positions.iter();
        // The mesh as it is seen, and the scale at which its longer side fits.
        let seen = positions.map(|&position| (view_from_local * position).truncate());
        let ends = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        let (min, max) = seen.fold(ends, |(min, max), p| (min.min(p), max.max(p)));
        let extent = (max - min).max_element();
        let room_px = PANEL_PX as f32 - 2.0 * MARGIN_PX;
        Self {
            view_from_local,
            center: (min + max) * 0.5,
            px_per_local: if extent > 0.0 { room_px / extent } else { 1.0 },
        }
    }

    /// Pixels to the right and down, and nearness.
    fn panel_from_local(&self, position: Vec3) -> Vec3 {
        // Down is positive in pictures.
        let seen = self.view_from_local * position;
        let offset = (seen.truncate() - self.center) * self.px_per_local;
        let middle = PANEL_PX as f32 * 0.5;
        Vec3::new(
            middle + offset.x,
            middle - offset.y,
            seen.z * self.px_per_local,
        )
    }
}

/// Pixels with the nearness of what is drawn there.
struct Panel {
    colors: Vec<[f32; 3]>,
    nearness: Vec<f32>,
}

impl Panel {
    fn new() -> Self {
        let pixels = (PANEL_PX * PANEL_PX) as usize;
        Self {
            colors: vec![BACKGROUND; pixels],
            nearness: vec![f32::NEG_INFINITY; pixels],
        }
    }

    /// Draws a triangle with a flat shade. Both sides are drawn, the back one darker.
    fn draw(&mut self, corners: [Vec3; 3], color: [f32; 3]) {
        // The flat shade.
        let [a, b, c] = corners;
        let light = Vec3::new(-0.4, -0.6, 0.7).normalize();
        // Down is positive, so that the triangle winds the other way round.
        let normal = -(b - a).cross(c - a).normalize_or_zero();
        let facing = if normal.z >= 0.0 { 1.0 } else { 0.4 };
        let shade = (0.35 + 0.65 * normal.dot(light).abs()) * facing;
        let shaded = color.map(|x| x * shade);
        // Pixels within the triangle, by the shares of its corners.
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let last = PANEL_PX as f32 - 1.0;
        let min = a.min(b).min(c).truncate().max(Vec2::ZERO);
        let max = a.max(b).max(c).truncate().min(Vec2::splat(last));
        for y in min.y.floor() as u32..=max.y.ceil().max(0.0) as u32 {
            for x in min.x.floor() as u32..=max.x.ceil().max(0.0) as u32 {
                let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let share = |p: Vec3, q: Vec3| {
                    (q.truncate() - p.truncate()).perp_dot(at - p.truncate()) / area
                };
                let shares = Vec3::new(share(b, c), share(c, a), share(a, b));
                if shares.min_element() >= 0.0 && x < PANEL_PX && y < PANEL_PX {
                    self.put(x, y, shares.dot(Vec3::new(a.z, b.z, c.z)), shaded);
                }
            }
        }
    }

    fn put(&mut self, x: u32, y: u32, nearness: f32, color: [f32; 3]) {
        let pixel = (y * PANEL_PX + x) as usize;
        if nearness > self.nearness[pixel] {
            self.nearness[pixel] = nearness;
            self.colors[pixel] = color;
        }
    }

    fn copy_to(&self, picture: &mut RgbImage, left: u32, top: u32) {
        for (index, color) in (0..).zip(&self.colors) {
            let (x, y) = (index % PANEL_PX, index / PANEL_PX);
            picture.put_pixel(left + x, top + y, Rgb(color.map(to_byte)));
        }
    }
}

fn to_byte(share: f32) -> u8 {
    (share * 255.0).round() as u8
}
