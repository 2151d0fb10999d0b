//! The numbers of vertices, and from which others each is predicted.

/// Which vertices a vertex is predicted from. Vertices are counted from 1 in the order in which
/// they are coded; 0 stands for a number that is 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prediction {
    pub(super) target: u32,
    pub(super) a: u32,
    pub(super) b: u32,
    pub(super) d: u32,
}

impl Prediction {
    /// That the vertex is like another.
    pub(super) fn like(target: u32, a: u32) -> Self {
        let (b, d) = (a, a);
        Self { target, a, b, d }
    }
}

/// The numbers of vertices: a row of so many for each. A plane is a column.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    pub(super) width: usize,
    numbers: Vec<u32>,
}

impl Rows {
    /// `count` rows of zeros.
    pub(super) fn zeros(width: usize, count: usize) -> Self {
        let numbers = vec![0; width * count];
        Self { width, numbers }
    }

    pub(super) fn row(&self, place: u32) -> &[u32] {
        &self.numbers[place as usize * self.width..][..self.width]
    }

    /// Some of the numbers of a row, from column `first` on.
    #[inline(always)]
    pub(super) fn some<const N: usize>(&self, place: u32, first: usize) -> [u32; N] {
        let row = &self.numbers[place as usize * self.width + first..];
        *row.first_chunk().expect("there are so many columns")
    }

    #[inline(always)]
    pub(super) fn set<const N: usize>(&mut self, place: u32, first: usize, numbers: [u32; N]) {
        let row = &mut self.numbers[place as usize * self.width + first..];
        *row.first_chunk_mut().expect("there are so many columns") = numbers;
    }

    /// `count` numbers of a row, from column `first` on, and zeros after them.
    pub(super) fn up_to<const N: usize>(&self, place: u32, first: usize, count: usize) -> [u32; N] {
        let mut numbers = [0; N];
        numbers[..count].copy_from_slice(&self.row(place)[first..][..count]);
        numbers
    }

    /// Replaces as many numbers of a row, from column `first` on.
    pub(super) fn replace(&mut self, place: u32, first: usize, numbers: &[u32]) {
        let row = &mut self.numbers[place as usize * self.width + first..];
        row[..numbers.len()].copy_from_slice(numbers);
    }

    pub(super) fn push(&mut self, row: &[u32]) {
        self.numbers.extend_from_slice(row);
    }

    /// Makes room for rows to be read.
    pub(super) fn add_zeros(&mut self, count: usize) {
        let length = self.numbers.len() + count * self.width;
        self.numbers.resize(length, 0);
    }
}
