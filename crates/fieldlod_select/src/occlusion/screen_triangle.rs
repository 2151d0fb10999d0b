//! Triangles in the image: clipped, set up and asked which texels they cover.

use std::ops::Range;

use glam::Vec3;

use super::image_plane::ImagePlane;
use crate::lane::{Lane, V3};

/// What rounding may move an edge by, in texels.
const ROUNDING: f32 = 0.02;

/// A front face in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenTriangle {
    /// Corners of its bounds.
    min: [f32; 2],
    max: [f32; 2],
    /// Of each edge `a`, `b` and `c`, with `a x + b y + c ≥ 0` inside.
    edges: [[f32; 3]; 3],
    /// The same of the nearness, and the greatest and the least of its corners.
    nearness: [f32; 3],
    nearest: f32,
    farthest: f32,
}

/// The parts of a triangle before the camera, from a nearest depth on, that face it: none, one, or two where it reaches behind.
pub(crate) fn front_triangles(
    plane: &ImagePlane,
    corners: [Vec3; 3],
    is_mirrored: bool,
    nearest: f32,
) -> impl Iterator<Item = ScreenTriangle> {
    let [a, b, c] = corners;
    let corners = if is_mirrored { [a, c, b] } else { corners };
    let (polygon, count) = clip_near(corners, nearest);
    let project = |index: usize| {
        let V3 { x, y, z } = plane.project(V3::splat(polygon[index]));
        Vec3::new(x, y, z)
    };
    let triangle = |last: usize| ScreenTriangle::new([0, last - 1, last].map(project));
    // A fan from the first corner.
    let mut parts = [None, None];
    for last in 2..count {
        parts[last - 2] = triangle(last);
    }
    parts.into_iter().flatten()
}

/// What of a triangle is farther than a depth: a polygon and the number of its corners.
fn clip_near(corners: [Vec3; 3], nearest: f32) -> ([Vec3; 4], usize) {
    let mut polygon = [Vec3::ZERO; 4];
    let mut count = 0;
    let mut push = |corner: Vec3| {
        polygon[count] = corner;
        count += 1;
    };
    for (index, &from) in corners.iter().enumerate() {
        let to = corners[(index + 1) % 3];
        let [is_from_in, is_to_in] = [from, to].map(|corner| corner.z >= nearest);
        if is_from_in {
            push(from);
        }
        if is_from_in != is_to_in {
            // From the inner end, so that both triangles at an edge cut it alike.
            let (inner, outer) = if is_from_in { (from, to) } else { (to, from) };
            let share = (inner.z - nearest) / (inner.z - outer.z);
            push((inner + (outer - inner) * share).with_z(nearest));
        }
    }
    (polygon, count)
}

impl ScreenTriangle {
    /// `None` for what is turned away, has no area or is not a number. Corners have texel coordinates and
    /// nearness.
    fn new([a, b, c]: [Vec3; 3]) -> Option<Self> {
        // Seen from outside the corners run counter-clockwise, which is negative with y down.
        let (ab, ac) = (b - a, c - a);
        let area = ac.x * ab.y - ac.y * ab.x;
        if !(area > 0.0 && area < f32::INFINITY) {
            return None;
        }
        let edge = |from: Vec3, to: Vec3| {
            let (x, y) = (to.y - from.y, from.x - to.x);
            [x, y, -(x * from.x + y * from.y)]
        };
        let x = (ac.z * ab.y - ab.z * ac.y) / area;
        let y = (ab.z * ac.x - ac.z * ab.x) / area;
        Some(Self {
            min: [a.x.min(b.x).min(c.x), a.y.min(b.y).min(c.y)],
            max: [a.x.max(b.x).max(c.x), a.y.max(b.y).max(c.y)],
            edges: [edge(a, b), edge(b, c), edge(c, a)],
            nearness: [x, y, a.z - x * a.x - y * a.y],
            nearest: a.z.max(b.z).max(c.z),
            farthest: a.z.min(b.z).min(c.z),
        })
    }

    /// Whether a texel with this centre is covered.
    #[inline(always)]
    pub(crate) fn covers<L: Lane>(&self, x: L, y: L) -> L::Mask {
        let within = |axis: usize, at: L| {
            L::splat(self.min[axis]).is_at_most(at) & at.is_at_most(L::splat(self.max[axis]))
        };
        let inside = |edge: usize| L::zero().is_at_most(plane_at(self.edges[edge], x, y));
        within(0, x) & within(1, y) & inside(0) & inside(1) & inside(2)
    }

    /// The nearness there; never more than that of the nearest corner, which slivers might round to.
    #[inline(always)]
    pub(crate) fn nearness<L: Lane>(&self, x: L, y: L) -> L {
        plane_at(self.nearness, x, y).smaller(L::splat(self.nearest))
    }

    /// Whether a texel with this centre may be covered in part.
    #[inline(always)]
    pub(crate) fn touches<L: Lane>(&self, x: L, y: L) -> L::Mask {
        let half = 0.5 + ROUNDING;
        let within = |axis: usize, at: L| {
            L::splat(self.min[axis] - half).is_at_most(at)
                & at.is_at_most(L::splat(self.max[axis] + half))
        };
        let inside = |edge: usize| {
            let [a, b, c] = self.edges[edge];
            L::zero().is_at_most(plane_at([a, b, c + half * (a.abs() + b.abs())], x, y))
        };
        within(0, x) & within(1, y) & inside(0) & inside(1) & inside(2)
    }

    /// A nearness that it has nowhere in that texel less than.
    #[inline(always)]
    pub(crate) fn farthest<L: Lane>(&self, x: L, y: L) -> L {
        let [a, b, c] = self.nearness;
        let half = 0.5 + ROUNDING;
        let least = plane_at([a, b, c - half * (a.abs() + b.abs())], x, y);
        least.larger(L::splat(self.farthest))
    }

    /// The columns and rows of texels that may be touched.
    pub(crate) fn touched(&self, width: usize, height: usize) -> [Range<usize>; 2] {
        [(0, width), (1, height)]
            .map(|(axis, count)| indices(self.min[axis] - 1.0, self.max[axis] + 1.0, count))
    }

    /// The rows whose centres may be covered.
    pub(crate) fn rows(&self, count: usize) -> Range<usize> {
        indices(self.min[1], self.max[1], count)
    }

    /// The columns likewise.
    pub(crate) fn columns(&self, count: usize) -> Range<usize> {
        indices(self.min[0], self.max[0], count)
    }
}

#[inline(always)]
fn plane_at<L: Lane>([a, b, c]: [f32; 3], x: L, y: L) -> L {
    L::splat(a) * x + L::splat(b) * y + L::splat(c)
}

/// Casts saturate.
fn indices(min: f32, max: f32, count: usize) -> Range<usize> {
    let first = min.max(0.0) as usize;
    let end = if max < 0.0 {
        0
    } else {
        (max as usize).saturating_add(1)
    };
    first..end.min(count)
}
