//! The numbers of vertices, and from which others each is predicted.

/// Which vertices a vertex is predicted from. Vertices are counted from 1 in the order in which
/// they are coded; 0 stands for a number that is 0.
#[derive(Clone, Copy, Debug)]
pub(in crate::file) struct Prediction {
    pub(in crate::file) target: u32,
    pub(in crate::file) a: u32,
    pub(in crate::file) b: u32,
    pub(in crate::file) d: u32,
}

impl Prediction {
    /// That the vertex is like another.
    pub(in crate::file) fn like(target: u32, a: u32) -> Self {
        let (b, d) = (a, a);
        Self { target, a, b, d }
    }
}

/// The numbers of vertices: a row of so many for each. A plane is a column.
#[derive(Clone, Debug, Default)]
pub(in crate::file) struct Rows {
    pub(in crate::file) width: usize,
    numbers: Vec<u32>,
}

impl Rows {
    /// `count` rows of zeros.
    pub(in crate::file) fn zeros(width: usize, count: usize) -> Self {
        let numbers = vec![0; width * count];
        Self { width, numbers }
    }

    pub(in crate::file) fn row(&self, place: u32) -> &[u32] {
        &self.numbers[place as usize * self.width..][..self.width]
    }

    /// Some of the numbers of a row, from column `first` on.
    #[inline(always)]
    pub(in crate::file) fn some<const N: usize>(&self, place: u32, first: usize) -> [u32; N] {
        let row = &self.numbers[place as usize * self.width + first..];
        *row.first_chunk().expect("there are so many columns")
    }

    #[inline(always)]
    pub(in crate::file) fn set<const N: usize>(
        &mut self,
        place: u32,
        first: usize,
        numbers: [u32; N],
    ) {
        let row = &mut self.numbers[place as usize * self.width + first..];
        *row.first_chunk_mut().expect("there are so many columns") = numbers;
    }

    /// `count` numbers of a row, from column `first` on, and zeros after them.
    pub(in crate::file) fn up_to<const N: usize>(
        &self,
        place: u32,
        first: usize,
        count: usize,
    ) -> [u32; N] {
        let mut numbers = [0; N];
        numbers[..count].copy_from_slice(&self.row(place)[first..][..count]);
        numbers
    }

    /// Replaces as many numbers of a row, from column `first` on.
    pub(in crate::file) fn replace(&mut self, place: u32, first: usize, numbers: &[u32]) {
        let row = &mut self.numbers[place as usize * self.width + first..];
        row[..numbers.len()].copy_from_slice(numbers);
    }

    pub(in crate::file) fn push(&mut self, row: &[u32]) {
        self.numbers.extend_from_slice(row);
    }

    /// Makes room for rows to be read.
    pub(in crate::file) fn add_zeros(&mut self, count: usize) {
        let length = self.numbers.len() + count * self.width;
        self.numbers.resize(length, 0);
    }
}
