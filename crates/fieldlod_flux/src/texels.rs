//! The texels of a depth image.

use fieldlod_select::lanes::LANES;
use glam::Vec3;

use crate::screen_triangle::{ScreenTriangle, is_between_centres};

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
    /// Empties the image and sets its size. The width must be a multiple of [`LANES`].
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
    #[inline(always)]
    pub(crate) fn draw(&mut self, corners: [Vec3; 3], owner: u32) {
        if !is_between_centres(corners, self.width, self.height)
            && let Some(triangle) = ScreenTriangle::new(corners)
        {
            self.fill(&triangle, owner);
        }
    }

    #[inline(always)]
    fn fill(&mut self, triangle: &ScreenTriangle, owner: u32) {
        // Eight spans at once, because vector instructions compute them.
        let mut rows = triangle.rows(self.height);
        while !rows.is_empty() {
            let [mut left, mut right] = [[0.0; LANES]; 2];
            for lane in 0..LANES {
                [left[lane], right[lane]] = triangle.span(centre(rows.start, lane));
            }
            for (lane, row) in rows.clone().take(LANES).enumerate() {
                self.fill_row(triangle, row, [left[lane], right[lane]], owner);
            }
            rows.start += LANES;
        }
    }

    #[inline(always)]
    fn fill_row(&mut self, triangle: &ScreenTriangle, row: usize, span: [f32; 2], owner: u32) {
        let [left, right] = span;
        // The row does not meet the triangle.
        if left > right {
            return;
        }
        let texels = row * self.width..(row + 1) * self.width;
        let (nearness, _) = self.nearness[texels.clone()].as_chunks_mut::<LANES>();
        let (owners, _) = self.owners[texels].as_chunks_mut::<LANES>();
        // Casts saturate, so positions outside the row are safe.
        let end = (right as usize / LANES + 1).min(nearness.len());
        let y = row as f32 + 0.5;
        for chunk in left as usize / LANES..end {
            let (nearness, owners) = (&mut nearness[chunk], &mut owners[chunk]);
            for lane in 0..LANES {
                let x = centre(chunk * LANES, lane);
                let (before, now) = (nearness[lane], triangle.nearness(x, y));
                let is_nearer = (left <= x) & (x <= right) & (before < now);
                nearness[lane] = if is_nearer { now } else { before };
                owners[lane] = if is_nearer { owner } else { owners[lane] };
            }
        }
    }
}

/// The centre of a texel, `lane` texels after the `first`.
#[inline(always)]
fn centre(first: usize, lane: usize) -> f32 {
    first as f32 + (lane as f32 + 0.5)
}
