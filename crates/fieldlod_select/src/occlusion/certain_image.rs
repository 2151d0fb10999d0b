//! What is hidden for certain: texels that something covers entirely, and how near it is at least.
//!
//! A solid covers a texel entirely if it covers its centre and no edge at which its front ends (between a
//! face that is turned to the eye and one that is not, or where there is no face) comes near: between such
//! edges the number of its fronts does not change. The surface that is drawn may stand elsewhere, by the
//! deviation of the level that stands for it here and by what a cut may displace: edges are as wide as both
//! in the image, and depths lie as much farther.

use std::ops::Range;

use glam::{Mat3, Vec2, Vec3};
use wide::f32x8;

use super::image_plane::ImagePlane;
use super::nearness_pyramid::NearnessPyramid;
use super::screen_triangle::{Corner, ScreenTriangle, parts_in_front};
use super::solid::SolidLevel;
use super::{CENTRES, smaller};
use crate::bits::{LANES, set_bits_of};
use crate::lane::{Lane, bits_of};
use crate::stretch::largest_stretch;

/// Surfaces nearer than this depth do not count.
const NEAREST: f32 = 0.05;
/// From a texel's centre to its corner, and what rounding may add.
const TEXEL_RADIUS: f32 = 0.75;
/// What a texel is to the solid that is being drawn.
const COVERED: u8 = 1;
const AT_AN_EDGE: u8 = 2;

/// The image of what hides for certain.
#[derive(Clone, Debug, Default)]
pub(crate) struct CertainImage {
    /// Nothing farther than this shows in a texel; `−∞` where that is not known.
    pub(crate) nearness: Vec<f32>,
    pub(crate) pyramid: NearnessPyramid,
    /// Of the solid that is being drawn: the farthest that its fronts are, and the flags of texels.
    farthest: Vec<f32>,
    flags: Vec<u8>,
    /// The columns and rows where its fronts may be.
    touched: [Range<usize>; 2],
    corners: Vec<Vec3>,
    is_front: Vec<bool>,
    pub(crate) triangle_count: u32,
}

/// By how much what is drawn may differ from a level.
#[derive(Clone, Copy, Debug)]
struct Tolerance {
    /// In world units.
    deviation: f32,
    /// In texels.
    displacement: f32,
}

impl CertainImage {
    pub(crate) fn clear(&mut self, plane: &ImagePlane) {
        let texels = plane.width * plane.height;
        self.nearness.clear();
        self.nearness.resize(texels, f32::NEG_INFINITY);
        self.farthest.resize(texels, f32::INFINITY);
        self.flags.resize(texels, 0);
        self.triangle_count = 0;
    }

    /// Ends the drawing.
    pub(crate) fn finish(&mut self, plane: &ImagePlane) {
        self.pyramid
            .build(&self.nearness, plane.width, plane.height);
    }

    /// Draws a solid, of which a cut may displace what is drawn by so many texels.
    pub(crate) fn draw(
        &mut self,
        plane: &ImagePlane,
        solid: &SolidLevel,
        (linear, origin): (&Mat3, Vec3),
        displacement: f32,
    ) {
        let tolerance = Tolerance {
            deviation: solid.deviation_in_local * largest_stretch(linear),
            displacement,
        };
        // Vertices in camera space, and which triangles face the eye.
        self.corners.clear();
        let corners = solid.vertices.iter().map(|&at| *linear * at + origin);
        self.corners.extend(corners);
        let is_mirrored = linear.determinant() < 0.0;
        let corners = std::mem::take(&mut self.corners);
        let corner = |vertex: u32| corners[vertex as usize];
        let mut is_front = std::mem::take(&mut self.is_front);
        is_front.clear();
        is_front.extend(solid.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(corner);
            let towards_eye = -plane.sight(a).dot((b - a).cross(c - a));
            (towards_eye > 0.0) != is_mirrored
        }));
        // What fronts cover, and where they end.
        let fronts = solid.triangles.iter().zip(&is_front);
        let fronts = fronts.filter(|(_, is_front)| **is_front);
        let fronts = fronts.map(|(triangle, _)| triangle.map(corner));
        for triangle in fronts.clone() {
            let placed = triangle.map(|corner| Corner::new(plane, corner));
            parts_in_front(plane, placed, is_mirrored, NEAREST, |part| {
                if let Some(part) = ScreenTriangle::new(part) {
                    self.fill(plane, &part);
                }
            });
        }
        for cut in fronts.filter_map(near_cut) {
            self.mark(plane, cut, &tolerance);
        }
        for edge in &solid.edges {
            let ends = |[a, b]: [u32; 2]| is_front[a as usize] != is_front[b as usize];
            if edge.sides.is_none_or(ends) {
                self.mark(plane, edge.ends.map(corner), &tolerance);
            }
        }
        self.triangle_count += solid.triangles.len() as u32;
        (self.corners, self.is_front) = (corners, is_front);
        self.keep(plane, &tolerance);
    }

    /// Notes the texels whose centres a triangle covers, and the farthest that it is in any that it touches.
    fn fill(&mut self, plane: &ImagePlane, triangle: &ScreenTriangle) {
        let [columns, rows] = triangle.touched(plane.width, plane.height);
        self.touched = [
            around(&self.touched[0], &columns),
            around(&self.touched[1], &rows),
        ];
        for row in rows {
            let y = f32x8::splat(row as f32 + 0.5);
            for chunk in columns.start / LANES..columns.end.div_ceil(LANES) {
                let x = f32x8::splat((chunk * LANES) as f32) + CENTRES;
                let touched = bits_of(triangle.touches(x, y));
                if touched == 0 {
                    continue;
                }
                let first = row * plane.width + chunk * LANES;
                let covered = bits_of(triangle.covers(x, y));
                let farthest = triangle.farthest(x, y).to_array();
                for lane in set_bits_of(touched) {
                    let texel = first + lane;
                    self.farthest[texel] = smaller(farthest[lane], self.farthest[texel]);
                    self.flags[texel] |= (covered >> lane & 1) as u8 * COVERED;
                }
            }
        }
    }

    /// Marks the texels near an edge.
    fn mark(&mut self, plane: &ImagePlane, edge: [Vec3; 2], tolerance: &Tolerance) {
        let Some([a, b]) = clip_near(edge) else {
            return;
        };
        let reach = tolerance.in_texels(plane, a.z.min(b.z)) + TEXEL_RADIUS;
        let [a, b] = [a, b].map(|end| plane.at(end));
        let along = b - a;
        let (across, length) = (Vec2::new(-along.y, along.x), along.length());
        let reach_across = f32x8::splat(reach * length);
        let [nx, ny] = across.to_array().map(f32x8::splat);
        let offset = f32x8::splat(across.dot(a));
        // Where nothing is covered there is nothing to mark.
        let texels = |from: f32, to: f32, touched: &Range<usize>| {
            let (least, most) = (from.min(to) - reach - 1.0, from.max(to) + reach + 1.0);
            // Casts saturate, and take NaN to 0.
            let end = (most.max(0.0) as usize).saturating_add(1).min(touched.end);
            (least.max(0.0) as usize).max(touched.start)..end
        };
        let columns = texels(a.x, b.x, &self.touched[0]);
        for row in texels(a.y, b.y, &self.touched[1]) {
            let y = f32x8::splat(row as f32 + 0.5);
            for chunk in columns.start / LANES..columns.end.div_ceil(LANES) {
                let x = f32x8::splat((chunk * LANES) as f32) + CENTRES;
                let distance = (nx * x + ny * y - offset).abs();
                // What is not a number is near.
                let is_far = bits_of(reach_across.is_below(distance));
                for lane in set_bits_of(!is_far & 0xff) {
                    self.flags[row * plane.width + chunk * LANES + lane] |= AT_AN_EDGE;
                }
            }
        }
    }

    /// Keeps the nearer of what the solid hides for certain and what was drawn before.
    fn keep(&mut self, plane: &ImagePlane, tolerance: &Tolerance) {
        let [columns, rows] = std::mem::replace(&mut self.touched, [0..0, 0..0]);
        for row in rows {
            // Whole elements: edges may have been marked a little farther.
            let first = row * plane.width + columns.start / LANES * LANES;
            let end = row * plane.width + columns.end.next_multiple_of(LANES);
            for texel in first..end {
                if self.flags[texel] == COVERED {
                    let pushed = tolerance.pushed_back(plane, self.farthest[texel]);
                    if self.nearness[texel] < pushed {
                        self.nearness[texel] = pushed;
                    }
                }
                (self.flags[texel], self.farthest[texel]) = (0, f32::INFINITY);
            }
        }
    }
}

impl Tolerance {
    /// How far something at a depth may be from where it is drawn, in texels.
    fn in_texels(&self, plane: &ImagePlane, depth: f32) -> f32 {
        let deviation = plane.texels(self.deviation, depth - self.deviation);
        self.displacement + deviation * plane.widest_secant()
    }

    /// The nearness that is certain of what is drawn at a nearness.
    fn pushed_back(&self, plane: &ImagePlane, nearness: f32) -> f32 {
        let depth = plane.depth(nearness);
        let moved = plane.length(self.displacement, depth) * plane.widest_secant();
        plane.nearness(depth + self.deviation + moved)
    }
}

/// Around two ranges, of which the first may be empty.
fn around(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    if a.is_empty() {
        return b.clone();
    }
    a.start.min(b.start)..a.end.max(b.end)
}

/// The part of an edge that is not too near.
fn clip_near([a, b]: [Vec3; 2]) -> Option<[Vec3; 2]> {
    let at_near = |inner: Vec3, outer: Vec3| {
        let share = (inner.z - NEAREST) / (inner.z - outer.z);
        (inner + (outer - inner) * share).with_z(NEAREST)
    };
    match [a.z >= NEAREST, b.z >= NEAREST] {
        [true, true] => Some([a, b]),
        [true, false] => Some([a, at_near(a, b)]),
        [false, true] => Some([at_near(b, a), b]),
        [false, false] => None,
    }
}

/// Where a triangle is cut off for being too near.
fn near_cut([a, b, c]: [Vec3; 3]) -> Option<[Vec3; 2]> {
    let mut ends = [[a, b], [b, c], [c, a]].into_iter().filter_map(|edge| {
        let [from, to] = clip_near(edge)?;
        let is_cut = edge.iter().any(|end| end.z < NEAREST);
        is_cut.then_some(if from.z == NEAREST { from } else { to })
    });
    Some([ends.next()?, ends.next()?])
}
