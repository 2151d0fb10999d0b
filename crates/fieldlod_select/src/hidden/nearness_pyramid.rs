//! The least nearness of rectangles of a depth image, told from its halves, quarters and so on.

use std::ops::RangeInclusive;

/// Texels along a side of a rectangle that are looked at one by one, at most.
const FEW: usize = 4;

/// Levels of a depth image, each half as large as the one before and of the least of four texels.
#[derive(Clone, Debug, Default)]
pub(crate) struct NearnessPyramid {
    levels: Vec<Level>,
}

#[derive(Clone, Debug, Default)]
struct Level {
    width: usize,
    height: usize,
    least: Vec<f32>,
}

impl NearnessPyramid {
    /// Builds the levels of another image, whose sides are even.
    pub(crate) fn build(&mut self, image: &[f32], width: usize, height: usize) {
        let (mut size, mut count) = ([width, height], 0);
        while size != [1, 1] {
            let half = size.map(|side| side.div_ceil(2));
            if count == self.levels.len() {
                self.levels.push(Level::default());
            }
            let (done, rest) = self.levels.split_at_mut(count);
            let from = done.last().map_or(image, |level| level.least.as_slice());
            rest[0].fill(from, size, half);
            (size, count) = (half, count + 1);
        }
        self.levels.truncate(count);
    }

    /// A lower bound of the least of an image in a rectangle that lies in it: exact where that is small.
    pub(crate) fn least(
        &self,
        image: &[f32],
        width: usize,
        columns: RangeInclusive<usize>,
        rows: RangeInclusive<usize>,
    ) -> f32 {
        let [mut x, mut y] = [columns, rows].map(RangeInclusive::into_inner);
        let mut level = 0;
        while (x.1 - x.0).max(y.1 - y.0) >= FEW && level < self.levels.len() {
            (x, y) = ((x.0 / 2, x.1 / 2), (y.0 / 2, y.1 / 2));
            level += 1;
        }
        let (from, width) = match level.checked_sub(1) {
            Some(level) => (
                self.levels[level].least.as_slice(),
                self.levels[level].width,
            ),
            None => (image, width),
        };
        let rows = (y.0..=y.1).flat_map(|row| &from[row * width + x.0..=row * width + x.1]);
        rows.copied().fold(f32::INFINITY, super::smaller)
    }
}

impl Level {
    fn fill(&mut self, from: &[f32], [width, height]: [usize; 2], half: [usize; 2]) {
        [self.width, self.height] = half;
        self.least.clear();
        for row in 0..self.height {
            let rows =
                [row * 2, (row * 2 + 1).min(height - 1)].map(|row| &from[row * width..][..width]);
            let least = |column: usize| {
                let columns = [column * 2, (column * 2 + 1).min(width - 1)];
                let [above, below] =
                    rows.map(|row| super::smaller(row[columns[0]], row[columns[1]]));
                super::smaller(above, below)
            };
            self.least.extend((0..self.width).map(least));
        }
    }
}
