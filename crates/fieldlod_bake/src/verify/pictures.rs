//! Pictures of each level from six sides, at the size at which its error is one pixel.
//!
//! Distances at samples do not show missing surfaces: near every point there is another leaf, or the other side of a
//! sheet. Pictures show these. Back faces are distinguished, as in a renderer with culling.

use fieldlod_hierarchy::{Aabb, Group};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::report::{Verified, VerifyError};
use super::subject::Subject;
use crate::plants::picture::Raster;

/// Sides of pictures in pixels. Smaller pictures show only silhouettes, which may be off by a pixel or two. Larger
/// pictures cost more, and show no more missing surfaces.
const LEAST_SIDE: usize = 8;
const MOST_SIDE: usize = 256;
/// Empty pixels at each edge of a picture. At least [`AROUND`], so that neighbours exist.
pub(super) const MARGIN: usize = 2;
/// A pixel counts only if the source shows the same at all pixels within this distance, because a silhouette may move
/// by a pixel or two.
pub(super) const AROUND: usize = 2;
/// With fewer pixels in all six pictures, the share of wrong pixels is random.
pub(super) const FEWEST_PIXELS: usize = 48;
/// Largest share of the pixels of a level that may be missing or show a back face.
const MOST_WRONG: f32 = 0.15;

/// Content of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Nothing,
    Front,
    Back,
}

pub(super) fn check(subject: &Subject<'_>, verified: &mut Verified) -> Result<(), VerifyError> {
    let Some(frame) = Frame::of(subject) else {
        return Ok(());
    };
    let source = subject.source_triangles();
    // Levels with pictures of the same size share the pictures of the source.
    let mut sides: Vec<(u32, usize)> = (1..subject.hierarchy.level_count())
        .filter_map(|level| Some((level, frame.side(error_of(subject, level))?)))
        .collect();
    sides.sort_by_key(|&(level, side)| (side, level));
    // Only the pictures of one size are in memory at a time.
    for levels in sides.chunk_by(|a, b| a.1 == b.1) {
        let side = levels[0].1;
        let of_source = frame.pictures(subject, source, side);
        let shares = levels.par_iter().map(|&(level, _)| {
            let drawn = subject.triangles_of(&subject.hierarchy.units_at_level(level));
            let drawn: Vec<[u32; 3]> = drawn.iter().map(|triangle| triangle.corners).collect();
            let of_level = frame.pictures(subject, &drawn, side);
            (level, wrong_share(&of_source, &of_level, side))
        });
        for (level, share) in shares.collect::<Vec<_>>() {
            verified.wrong_pixels = verified.wrong_pixels.max(share);
            if share > MOST_WRONG {
                return Err(VerifyError::Pictures { level, share });
            }
        }
    }
    Ok(())
}

/// The error of a level, in scaled units.
fn error_of(subject: &Subject<'_>, level: u32) -> f32 {
    let error_in_local = subject.hierarchy.largest_below(level, Group::error_of_step);
    error_in_local * subject.scaled_from_local
}

/// The region that pictures show.
pub(super) struct Frame {
    center: Vec3,
    pub(super) extent: f32,
}

impl Frame {
    fn of(subject: &Subject<'_>) -> Option<Self> {
        let source = subject.source_triangles().as_flattened().iter();
        Self::around(source.map(|&vertex| subject.positions[vertex as usize]))
    }

    /// The region around points. `None` if it has no extent.
    pub(super) fn around(points: impl Iterator<Item = Vec3>) -> Option<Self> {
        let aabb = Aabb::around(points)?;
        let extent = (aabb.max - aabb.min).max_element();
        (extent > 0.0).then(|| Self {
            center: (aabb.min + aabb.max) * 0.5,
            extent,
        })
    }

    /// The side of a picture with pixels of at least `error`: a power of two.
    fn side(&self, error: f32) -> Option<usize> {
        let pixels = (self.extent / error.max(f32::MIN_POSITIVE)) as usize;
        (pixels >= LEAST_SIDE).then(|| 1 << pixels.min(MOST_SIDE).ilog2())
    }

    /// Pictures of triangles along each axis, from both ends.
    fn pictures(
        &self,
        subject: &Subject<'_>,
        triangles: &[[u32; 3]],
        side: usize,
    ) -> [[Vec<Shown>; 2]; 3] {
        [0, 1, 2].map(|axis| self.pictures_along(axis, subject, triangles, side))
    }

    /// Column, row and height in pixels of a point in the picture along an axis, with margins.
    pub(super) fn place(&self, point: Vec3, axis: usize, side: usize) -> Vec3 {
        let p = (point - self.center) * (side as f32 / self.extent);
        // The next two axes, so that triangles keep their winding.
        let [u, v] = [p[(axis + 1) % 3], p[(axis + 2) % 3]];
        (Vec2::new(u, v) + (side + 2 * MARGIN) as f32 * 0.5).extend(p[axis])
    }

    fn pictures_along(
        &self,
        axis: usize,
        subject: &Subject<'_>,
        triangles: &[[u32; 3]],
        side: usize,
    ) -> [Vec<Shown>; 2] {
        let side_with_margin = side + 2 * MARGIN;
        // The nearest front and back faces from both ends of the axis.
        let far = [f32::NEG_INFINITY; 2];
        let mut nearest = vec![[far; 2]; side_with_margin * side_with_margin];
        for triangle in triangles {
            let corners = subject.corners(*triangle);
            let corners = corners.map(|corner| self.place(corner, axis, side));
            let [a, b, c] = corners.map(Vec3::truncate);
            let faces_up = (b - a).perp_dot(c - a) > 0.0;
            let Some(raster) = Raster::of(corners, side_with_margin) else {
                continue;
            };
            let is_opaque = subject.opacity_test(triangle);
            raster.each_pixel(|pixel, shares, height| {
                if !is_opaque(shares) {
                    return;
                }
                let [from_above, from_below] = &mut nearest[pixel];
                let above = &mut from_above[usize::from(!faces_up)];
                *above = above.max(height);
                let below = &mut from_below[usize::from(faces_up)];
                *below = below.max(-height);
            });
        }
        [0, 1].map(|end| nearest.iter().map(|ends| shown(ends[end])).collect())
    }
}

/// A front face hides a back face at the same depth, with a tolerance of a pixel.
fn shown([front, back]: [f32; 2]) -> Shown {
    match (front > f32::NEG_INFINITY, back > f32::NEG_INFINITY) {
        (false, false) => Shown::Nothing,
        (true, _) if front >= back - 1.0 => Shown::Front,
        _ => Shown::Back,
    }
}

/// The share of wrong pixels of a level, among those with equal pixels around them in the source. In place of a front
/// face there must be a front face, and in place of a back face any face.
fn wrong_share(source: &[[Vec<Shown>; 2]; 3], level: &[[Vec<Shown>; 2]; 3], side: usize) -> f32 {
    let (mut whole, mut wrong) = (0usize, 0usize);
    let pictures = source.as_flattened().iter().zip(level.as_flattened());
    for (source, level) in pictures {
        let shown = |at: usize| Some(source[at]).filter(|own| *own != Shown::Nothing);
        for at in steady_pixels(side, AROUND, shown) {
            whole += 1;
            let is_right = match source[at] {
                Shown::Front => level[at] == Shown::Front,
                _ => level[at] != Shown::Nothing,
            };
            wrong += usize::from(!is_right);
        }
    }
    if whole < FEWEST_PIXELS {
        return 0.0;
    }
    wrong as f32 / whole as f32
}

/// The pixels that show something, and the same within `around` pixels. `around` is at most [`AROUND`].
pub(super) fn steady_pixels<T: PartialEq>(
    side: usize,
    around: usize,
    shown: impl Fn(usize) -> Option<T>,
) -> impl Iterator<Item = usize> {
    let width = side + 2 * MARGIN;
    let inner = AROUND..width - AROUND;
    let pixels = inner
        .clone()
        .flat_map(move |row| inner.clone().map(move |at| row * width + at));
    pixels.filter(move |&at| {
        let own = shown(at);
        let first = at - around * (width + 1);
        let mut rows = (0..=2 * around).map(|row| first + row * width);
        own.is_some() && rows.all(|row| (row..=row + 2 * around).all(|near| shown(near) == own))
    })
}
