//! The texels of a depth image.

use glam::Vec3;
use wide::f32x8;

use super::CENTRES;
use super::screen_triangle::{ScreenTriangle, is_between_centres};
use crate::lanes::Lane;
use crate::lanes::bits::LANES;

/// Owner of an empty texel.
pub(crate) const NOBODY: u32 = u32::MAX;

/// Texels by row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Texels {
    width: usize,
    height: usize,
    /// Nearness of the nearest surface.
    pub(crate) nearness: Vec<f32>,
    /// Instance of the nearest surface.
    pub(crate) owners: Vec<u32>,
}

impl Texels {
    /// Empties the image and sets its size; rows are whole elements.
    pub(crate) fn clear(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.nearness.clear();
        self.nearness.resize(width * height, f32::NEG_INFINITY);
        self.owners.clear();
        self.owners.resize(width * height, NOBODY);
    }

    /// Nearness of one row.
    pub(crate) fn row(&self, row: usize) -> &[f32] {
        &self.nearness[row * self.width..][..self.width]
    }

    /// Keeps the nearer surface. Returns `true` if the new surface is nearer.
    #[inline(always)]
    pub(crate) fn keep_nearer(&mut self, texel: usize, nearness: f32, owner: u32) -> bool {
        let is_nearer = self.nearness[texel] < nearness;
        if is_nearer {
            (self.nearness[texel], self.owners[texel]) = (nearness, owner);
        }
        is_nearer
    }

    /// Draws a triangle. Its corners have texel coordinates and nearness, as in [`ScreenTriangle::new`].
    #[inline]
    pub(crate) fn draw(&mut self, corners: [Vec3; 3], owner: u32) {
        if !is_between_centres(corners, self.width, self.height)
            && let Some(triangle) = ScreenTriangle::new(corners)
        {
            self.fill(&triangle, owner);
        }
    }

    fn fill(&mut self, triangle: &ScreenTriangle, owner: u32) {
        // Eight rows at once.
        let mut rows = triangle.rows(self.height);
        while !rows.is_empty() {
            let [left, right] = triangle.span(f32x8::splat(rows.start as f32) + CENTRES);
            let [left, right] = [left.to_array(), right.to_array()];
            for (lane, row) in rows.clone().take(LANES).enumerate() {
                self.fill_row(triangle, row, [left[lane], right[lane]], owner);
            }
            rows.start += LANES;
        }
    }

    #[inline(always)]
    fn fill_row(&mut self, triangle: &ScreenTriangle, row: usize, span: [f32; 2], owner: u32) {
        let [left, right] = span;
        if left > right {
            return;
        }
        let texels = row * self.width..(row + 1) * self.width;
        let (nearness, _) = self.nearness[texels.clone()].as_chunks_mut::<LANES>();
        let (owners, _) = self.owners[texels].as_chunks_mut::<LANES>();
        // Casts saturate.
        let end = (right as usize / LANES + 1).min(nearness.len());
        let y = f32x8::splat(row as f32 + 0.5);
        for chunk in left as usize / LANES..end {
            let x = f32x8::splat((chunk * LANES) as f32) + CENTRES;
            let covered = f32x8::splat(left).is_at_most(x) & x.is_at_most(f32x8::splat(right));
            let (before, now) = (f32x8::new(nearness[chunk]), triangle.nearness(x, y));
            let is_nearer = covered & before.is_below(now);
            nearness[chunk] = f32x8::choose(is_nearer, now, before).to_array();
            // A lane of the mask has all bits set or none.
            let masks = is_nearer.to_array().map(f32::to_bits);
            for (shown, mask) in owners[chunk].iter_mut().zip(masks) {
                *shown = *shown & !mask | owner & mask;
            }
        }
    }
}
