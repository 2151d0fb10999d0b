//! Predicts numbers of a vertex from those of earlier vertices.

use crate::file::sections::numbers::{unzigzag, zigzag};

/// Predictor of a number from those of neighbours: `a` and `b` share an edge, and `d` is opposite to
/// it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Predict {
    /// Floating-point, a + b - d: positions and texture coordinates.
    FloatParallelogram,
    /// Floating-point, (a + b) / 2: colours.
    FloatMean,
    /// Floating-point, three columns of a unit vector: (a + b) / 2. The largest coordinate is predicted
    /// from the other two.
    FloatDirection,
    /// Like [`Self::FloatDirection`], from the normals of the triangles at the vertex.
    FloatNormal,
    /// Integer, a + b - d.
    IntParallelogram,
    /// Integer, (a + b) / 2.
    IntMean,
    /// Integer, from the normals of the triangles at the vertex.
    IntNormal,
}

/// Differences of `target` to its prediction from `a`, `b` and `d`.
pub(crate) fn residuals_of<const N: usize>(
    predict: Predict,
    [a, b, d]: [[u32; N]; 3],
    target: [u32; N],
) -> [u32; N] {
    let guesses: [u32; N] = std::array::from_fn(|k| guess(predict, a[k], b[k], d[k]));
    if !matches!(predict, Predict::FloatDirection | Predict::FloatNormal) {
        return std::array::from_fn(|k| residual(predict, target[k], guesses[k]));
    }
    // The third coordinate follows from the other two with the least rounding if it is the largest.
    let [x, y, z] = axes_by_size(guesses);
    let last = coordinate(target[x], target[y], guesses[z]);
    let mut residuals = [0; N];
    residuals[0] = residual(predict, target[x], guesses[x]);
    residuals[1] = residual(predict, target[y], guesses[y]);
    residuals[2] = residual(predict, target[z], last);
    residuals
}

/// Inverse of [`residuals_of`].
#[inline(always)]
pub(crate) fn restored<const N: usize>(
    predict: Predict,
    [a, b, d]: [[u32; N]; 3],
    residuals: [u32; N],
) -> [u32; N] {
    let guesses: [u32; N] = std::array::from_fn(|k| guess(predict, a[k], b[k], d[k]));
    if !matches!(predict, Predict::FloatDirection | Predict::FloatNormal) {
        return std::array::from_fn(|k| restore(predict, guesses[k], residuals[k]));
    }
    let [x, y, z] = axes_by_size(guesses);
    let mut target = guesses;
    target[x] = restore(predict, guesses[x], residuals[0]);
    target[y] = restore(predict, guesses[y], residuals[1]);
    let last = coordinate(target[x], target[y], guesses[z]);
    target[z] = restore(predict, last, residuals[2]);
    target
}

/// The axes of a direction. The axis with the largest coordinate comes last.
#[inline(always)]
fn axes_by_size<const N: usize>(direction: [u32; N]) -> [usize; 3] {
    let size = |axis: usize| f32::from_bits(direction[axis]).abs();
    if size(2) >= size(0) && size(2) >= size(1) {
        [0, 1, 2]
    } else if size(1) >= size(0) {
        [2, 0, 1]
    } else {
        [1, 2, 0]
    }
}

/// The third coordinate of a unit vector, with the sign of `like`.
#[inline(always)]
fn coordinate(x: u32, y: u32, like: u32) -> u32 {
    let [x, y] = [x, y].map(|bits| f64::from(f32::from_bits(bits)));
    let squared = 1.0 - x * x - y * y;
    // The sign of NaN differs between machines.
    let size = if squared > 0.0 {
        squared.sqrt() as f32
    } else {
        0.0
    };
    size.copysign(f32::from_bits(canonical(like))).to_bits()
}

#[inline(always)]
fn guess(predict: Predict, a: u32, b: u32, d: u32) -> u32 {
    let float = f32::from_bits;
    match predict {
        Predict::FloatParallelogram => (float(a) + float(b) - float(d)).to_bits(),
        Predict::FloatMean | Predict::FloatDirection | Predict::FloatNormal => {
            ((float(a) + float(b)) * 0.5).to_bits()
        }
        Predict::IntParallelogram => a.wrapping_add(b).wrapping_sub(d),
        // Sums in malformed files wrap. Writer and reader only have to agree.
        Predict::IntMean | Predict::IntNormal => a.wrapping_add(b) >> 1,
    }
}

#[inline(always)]
fn residual(predict: Predict, value: u32, guess: u32) -> u32 {
    match predict {
        Predict::IntParallelogram | Predict::IntMean | Predict::IntNormal => {
            zigzag(value.wrapping_sub(guess))
        }
        _ => zigzag(ordered(value).wrapping_sub(ordered(canonical(guess)))),
    }
}

#[inline(always)]
fn restore(predict: Predict, guess: u32, residual: u32) -> u32 {
    match predict {
        Predict::IntParallelogram | Predict::IntMean | Predict::IntNormal => {
            guess.wrapping_add(unzigzag(residual))
        }
        // `ordered` is its own inverse.
        _ => ordered(ordered(canonical(guess)).wrapping_add(unzigzag(residual))),
    }
}

/// Replaces NaN by 0, because the bits of a computed NaN differ between machines.
#[inline(always)]
fn canonical(bits: u32) -> u32 {
    if f32::from_bits(bits).is_nan() {
        0
    } else {
        bits
    }
}

/// Maps the bits of floating-point numbers to signed integers in the same order.
#[inline(always)]
fn ordered(bits: u32) -> u32 {
    bits ^ (((bits as i32) >> 31) as u32 >> 1)
}
