//! The numbers of every vertex, each predicted from those of the vertices that came before.

use super::error::FileError;
use super::numbers::{self, Kind, unzigzag, zigzag};
use super::reader::Reader;

/// How a number is predicted from those of its neighbours `a`, `b` (on one edge) and `d` (beyond
/// that edge).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Predict {
    /// Floating-point, a + b - d: positions and texture coordinates, which vary linearly.
    FloatParallelogram,
    /// Floating-point, (a + b) / 2: directions and colours.
    FloatMean,
    /// Integer, a + b - d.
    IntParallelogram,
    /// Integer, (a + b) / 2.
    IntMean,
}

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
    fn set<const N: usize>(&mut self, place: u32, first: usize, numbers: [u32; N]) {
        let row = &mut self.numbers[place as usize * self.width + first..];
        *row.first_chunk_mut().expect("there are so many columns") = numbers;
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

/// Codes a column of the targets of `predictions`. Those that are not stored get the numbers that
/// the reader will take for theirs.
pub(super) fn write(
    bytes: &mut Vec<u8>,
    rows: &mut Rows,
    column: usize,
    predict: Predict,
    predictions: &[Prediction],
    are_stored: &[bool],
) {
    let mut remainders = Vec::with_capacity(predictions.len());
    for (p, &is_stored) in predictions.iter().zip(are_stored) {
        let [a, b, d, target] = [p.a, p.b, p.d, p.target].map(|place| rows.row(place)[column]);
        let guess = guess(predict, a, b, d);
        match is_stored {
            true => remainders.push(remainder(predict, target, guess)),
            false => rows.set(p.target, column, [restore(predict, a, b, d, 0)]),
        }
    }
    numbers::write(bytes, &remainders, Kind::Remainders);
}

/// Columns that are restored together.
const TOGETHER: usize = 4;

/// Reads the targets of `predictions` into rows that have room for them. Those that are not stored
/// are as predicted.
pub(super) fn read(
    reader: &mut Reader<'_>,
    rows: &mut Rows,
    predictors: &[Predict],
    predictions: &[Prediction],
    are_stored: &[bool],
) -> Result<(), FileError> {
    let stored = are_stored.iter().filter(|&&is_stored| is_stored).count();
    let mut remainders: [Vec<u32>; TOGETHER] = Default::default();
    let mut first = 0;
    let alike = predictors.chunk_by(|a, b| a == b);
    for columns in alike.flat_map(|alike| alike.chunks(TOGETHER)) {
        // The remainders of these columns.
        for remainders in &mut remainders[..columns.len()] {
            numbers::read_into(reader, stored, "the vertices", remainders)?;
            spread(remainders, are_stored);
        }
        // Together: each column waits for its own numbers only.
        let [x, y, z, w] = &remainders;
        match columns.len() {
            1 => fill(rows, first, columns[0], predictions, [x]),
            2 => fill(rows, first, columns[0], predictions, [x, y]),
            3 => fill(rows, first, columns[0], predictions, [x, y, z]),
            _ => fill(rows, first, columns[0], predictions, [x, y, z, w]),
        }
        first += columns.len();
    }
    Ok(())
}

/// Puts zeros between numbers, for those that are not stored.
fn spread(numbers: &mut Vec<u32>, are_stored: &[bool]) {
    let mut left = numbers.len();
    numbers.resize(are_stored.len(), 0);
    // From the end, and no further than where nothing is missing.
    for place in (0..are_stored.len()).rev() {
        if left == place + 1 {
            break;
        }
        numbers[place] = match are_stored[place] {
            true => {
                left -= 1;
                numbers[left]
            }
            false => 0,
        };
    }
}

/// Restores the columns from `first` on.
fn fill<const N: usize>(
    rows: &mut Rows,
    first: usize,
    predict: Predict,
    predictions: &[Prediction],
    remainders: [&Vec<u32>; N],
) {
    use Predict::{FloatMean, FloatParallelogram, IntMean, IntParallelogram};
    // As long as the predictions, which spares a check for each.
    let remainders = remainders.map(|remainders| &remainders[..predictions.len()]);
    // A loop for each kind, so that nothing is decided within.
    match predict {
        FloatParallelogram => fill_with(rows, first, predictions, remainders, |a, b, d, r| {
            restore(FloatParallelogram, a, b, d, r)
        }),
        FloatMean => fill_with(rows, first, predictions, remainders, |a, b, d, r| {
            restore(FloatMean, a, b, d, r)
        }),
        IntParallelogram => fill_with(rows, first, predictions, remainders, |a, b, d, r| {
            restore(IntParallelogram, a, b, d, r)
        }),
        IntMean => fill_with(rows, first, predictions, remainders, |a, b, d, r| {
            restore(IntMean, a, b, d, r)
        }),
    }
}

#[inline(always)]
fn fill_with<const N: usize>(
    rows: &mut Rows,
    first: usize,
    predictions: &[Prediction],
    remainders: [&[u32]; N],
    restore: impl Fn(u32, u32, u32, u32) -> u32,
) {
    for (index, p) in predictions.iter().enumerate() {
        let (a, b, d) = (
            rows.some::<N>(p.a, first),
            rows.some::<N>(p.b, first),
            rows.some::<N>(p.d, first),
        );
        let number = |k: usize| restore(a[k], b[k], d[k], remainders[k][index]);
        rows.set::<N>(p.target, first, std::array::from_fn(number));
    }
}

#[inline(always)]
fn guess(predict: Predict, a: u32, b: u32, d: u32) -> u32 {
    let float = f32::from_bits;
    match predict {
        Predict::FloatParallelogram => (float(a) + float(b) - float(d)).to_bits(),
        Predict::FloatMean => ((float(a) + float(b)) * 0.5).to_bits(),
        Predict::IntParallelogram => a.wrapping_add(b).wrapping_sub(d),
        Predict::IntMean => (a.wrapping_add(b)) >> 1,
    }
}

#[inline(always)]
fn remainder(predict: Predict, value: u32, guess: u32) -> u32 {
    match predict {
        Predict::FloatParallelogram | Predict::FloatMean => {
            zigzag(ordered(value).wrapping_sub(ordered(canonical(guess))))
        }
        Predict::IntParallelogram | Predict::IntMean => zigzag(value.wrapping_sub(guess)),
    }
}

#[inline(always)]
fn restore(predict: Predict, a: u32, b: u32, d: u32, remainder: u32) -> u32 {
    let guess = guess(predict, a, b, d);
    match predict {
        Predict::FloatParallelogram | Predict::FloatMean => {
            unordered(ordered(canonical(guess)).wrapping_add(unzigzag(remainder)))
        }
        Predict::IntParallelogram | Predict::IntMean => guess.wrapping_add(unzigzag(remainder)),
    }
}

/// Machines differ in the bits of a NaN that they compute.
#[inline(always)]
fn canonical(bits: u32) -> u32 {
    if f32::from_bits(bits).is_nan() {
        0
    } else {
        bits
    }
}

/// Numbers in the order of the floating-point numbers that the bits stand for.
#[inline(always)]
fn ordered(bits: u32) -> u32 {
    bits ^ (((bits as i32) >> 31) as u32 >> 1)
}

/// Undoes [`ordered`]: it is its own inverse.
#[inline(always)]
fn unordered(number: u32) -> u32 {
    ordered(number)
}
