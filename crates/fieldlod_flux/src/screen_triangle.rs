//! Triangles in the image: set up, and tested for the texels that they cover.

use std::ops::Range;

use fieldlod_select::lanes::{larger, smaller};
use glam::Vec3;

/// A front face in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenTriangle {
    /// Corners of the triangle's bounds.
    min: [f32; 2],
    max: [f32; 2],
    /// Bounds of the triangle's start and end in a row, by each edge.
    ends: [RowEnd; 3],
    /// The nearness `a x + b y + c` of the triangle, and the greatest nearness of its corners.
    nearness: [f32; 3],
    nearest: f32,
}

/// Position of an edge in the row with centres at `y`: `slope y + offset`, to the left or the right of a triangle.
#[derive(Clone, Copy, Debug)]
struct RowEnd {
    slope: f32,
    /// `−∞` if the edge is not a left end.
    left_offset: f32,
    /// `∞` if the edge is not a right end.
    right_offset: f32,
}

impl RowEnd {
    /// The end of an edge of a front face; an edge that runs down is a left end. The triangles on both sides of an edge
    /// get the same position.
    fn new(from: Vec3, to: Vec3) -> Self {
        let is_left = from.y < to.y;
        let (low, high) = if is_left { (from, to) } else { (to, from) };
        let slope = (high.x - low.x) / (high.y - low.y);
        let offset = low.x - slope * low.y;
        // A horizontal edge does not bound any row.
        let (slope, is_left, is_right) = if offset.is_finite() {
            (slope, is_left, !is_left)
        } else {
            (0.0, false, false)
        };
        Self {
            slope,
            left_offset: if is_left { offset } else { f32::NEG_INFINITY },
            right_offset: if is_right { offset } else { f32::INFINITY },
        }
    }
}

impl ScreenTriangle {
    /// `None` for back faces and triangles without area or with NaN. Corners have texel coordinates and nearness.
    #[inline(always)]
    pub(crate) fn new([a, b, c]: [Vec3; 3]) -> Option<Self> {
        // Seen from outside the corners run counter-clockwise, which is negative with y down.
        let (ab, ac) = (b - a, c - a);
        let area = ac.x * ab.y - ac.y * ab.x;
        // Also false for NaN.
        if !(area > 0.0 && area < f32::INFINITY) {
            return None;
        }
        let x = (ac.z * ab.y - ab.z * ac.y) / area;
        let y = (ab.z * ac.x - ac.z * ab.x) / area;
        Some(Self {
            min: [a.x.min(b.x).min(c.x), a.y.min(b.y).min(c.y)],
            max: [a.x.max(b.x).max(c.x), a.y.max(b.y).max(c.y)],
            ends: [RowEnd::new(a, b), RowEnd::new(b, c), RowEnd::new(c, a)],
            nearness: [x, y, a.z - x * a.x - y * a.y],
            nearest: a.z.max(b.z).max(c.z),
        })
    }

    /// Whether the triangle covers a point.
    #[cfg(test)]
    pub(crate) fn covers(&self, x: f32, y: f32) -> bool {
        let [left, right] = self.span(y);
        left <= x && x <= right
    }

    /// The triangle's range in the row with centres at `y`; empty if they do not meet.
    #[inline(always)]
    pub(crate) fn span(&self, y: f32) -> [f32; 2] {
        let (mut left, mut right) = (self.min[0], self.max[0]);
        for end in &self.ends {
            let along = end.slope * y;
            left = larger(left, along + end.left_offset);
            right = smaller(right, along + end.right_offset);
        }
        let is_met = (self.min[1] <= y) & (y <= self.max[1]);
        [left, if is_met { right } else { f32::NEG_INFINITY }]
    }

    /// The nearness at a point, at most that of the nearest corner: the plane of a sliver may round to more.
    #[inline(always)]
    pub(crate) fn nearness(&self, x: f32, y: f32) -> f32 {
        let [a, b, c] = self.nearness;
        smaller(a * x + b * y + c, self.nearest)
    }

    /// The rows with centres in the triangle's bounds.
    #[inline(always)]
    pub(crate) fn rows(&self, count: usize) -> Range<usize> {
        centres(self.min[1], self.max[1], count)
    }
}

/// Whether no texel's centre is within the bounds of a triangle.
#[inline(always)]
pub(crate) fn is_between_centres([a, b, c]: [Vec3; 3], width: usize, height: usize) -> bool {
    centres(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), width).is_empty()
        || centres(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), height).is_empty()
}

/// The texels of a row or column whose centres are from `min` to `max`, and at most one more.
#[inline(always)]
fn centres(min: f32, max: f32, count: usize) -> Range<usize> {
    // Casts saturate, and take NaN to 0.
    let end = (max.min(count as f32) + 0.5) as usize;
    let first = min.max(0.0) as usize;
    let first = first + usize::from((first as f32 + 0.5) < min);
    first..end.min(count)
}
