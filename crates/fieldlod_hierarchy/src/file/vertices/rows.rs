//! Vertices as rows of numbers, and the rows that predict them.

/// The row of a vertex, and the rows that it is predicted from. Row 0 holds zeros, so vertex `i` in
/// coding order has the row `i + 1`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prediction {
    pub(crate) target: u32,
    pub(crate) a: u32,
    pub(crate) b: u32,
    pub(crate) d: u32,
}

impl Prediction {
    /// Predicts that `target` equals `a`.
    pub(crate) fn like(target: u32, a: u32) -> Self {
        let (b, d) = (a, a);
        Self { target, a, b, d }
    }
}

/// A table with a row of `width` numbers per vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    pub(crate) width: usize,
    numbers: Vec<u32>,
}

impl Rows {
    /// `count` rows of zeros.
    pub(crate) fn zeros(width: usize, count: usize) -> Self {
        let numbers = vec![0; width * count];
        Self { width, numbers }
    }

    pub(crate) fn row(&self, row: u32) -> &[u32] {
        &self.numbers[row as usize * self.width..][..self.width]
    }

    /// `N` numbers of a row, starting at column `first`.
    #[inline(always)]
    pub(crate) fn some<const N: usize>(&self, row: u32, first: usize) -> [u32; N] {
        let row = &self.numbers[row as usize * self.width + first..];
        *row.first_chunk().expect("the row has enough columns")
    }

    #[inline(always)]
    pub(crate) fn set<const N: usize>(&mut self, row: u32, first: usize, numbers: [u32; N]) {
        let row = &mut self.numbers[row as usize * self.width + first..];
        *row.first_chunk_mut().expect("the row has enough columns") = numbers;
    }

    /// `count` numbers of a row, starting at column `first`, padded with zeros.
    pub(crate) fn up_to<const N: usize>(&self, row: u32, first: usize, count: usize) -> [u32; N] {
        let mut numbers = [0; N];
        numbers[..count].copy_from_slice(&self.row(row)[first..][..count]);
        numbers
    }

    pub(crate) fn push(&mut self, row: &[u32]) {
        self.numbers.extend_from_slice(row);
    }

    /// Appends `count` rows of zeros.
    pub(crate) fn add_zeros(&mut self, count: usize) {
        let length = self.numbers.len() + count * self.width;
        self.numbers.resize(length, 0);
    }
}
