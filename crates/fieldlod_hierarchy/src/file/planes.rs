//! One number of every vertex, predicted from the vertices that came before.

use super::FileError;
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

/// The numbers of all vertices, in the order in which they are coded, after one that is 0.
pub(super) type Plane = Vec<u32>;

/// Codes the targets of `predictions` of a plane that holds them.
pub(super) fn write(
    bytes: &mut Vec<u8>,
    plane: &[u32],
    predict: Predict,
    predictions: &[Prediction],
) {
    let remainders = predictions.iter().map(|p| {
        let [a, b, d] = [p.a, p.b, p.d].map(|place| plane[place as usize]);
        remainder(predict, plane[p.target as usize], guess(predict, a, b, d))
    });
    let remainders: Vec<u32> = remainders.collect();
    numbers::write(bytes, &remainders, Kind::Remainders);
}

/// Reads the targets of `predictions` into a plane that has room for them.
pub(super) fn read(
    reader: &mut Reader<'_>,
    plane: &mut [u32],
    predict: Predict,
    predictions: &[Prediction],
) -> Result<(), FileError> {
    let remainders = numbers::read(reader, predictions.len(), "the vertices")?;
    // A loop for each, so that nothing is decided within.
    match predict {
        Predict::FloatParallelogram => fill(plane, predictions, &remainders, |a, b, d, r| {
            restore(Predict::FloatParallelogram, a, b, d, r)
        }),
        Predict::FloatMean => fill(plane, predictions, &remainders, |a, b, d, r| {
            restore(Predict::FloatMean, a, b, d, r)
        }),
        Predict::IntParallelogram => fill(plane, predictions, &remainders, |a, b, d, r| {
            restore(Predict::IntParallelogram, a, b, d, r)
        }),
        Predict::IntMean => fill(plane, predictions, &remainders, |a, b, d, r| {
            restore(Predict::IntMean, a, b, d, r)
        }),
    }
    Ok(())
}

#[inline(always)]
fn fill(
    plane: &mut [u32],
    predictions: &[Prediction],
    remainders: &[u32],
    restore: impl Fn(u32, u32, u32, u32) -> u32,
) {
    for (p, &remainder) in predictions.iter().zip(remainders) {
        let [a, b, d] = [p.a, p.b, p.d].map(|place| plane[place as usize]);
        plane[p.target as usize] = restore(a, b, d, remainder);
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
