//! Eight lanes. Code is written for one number, and runs in loops over eight lanes, which the compiler turns into vector
//! instructions. It uses only operations that IEEE 754 rounds exactly, so that the results are bit-identical.
//!
//! A loop is fast if its body has no branches and no function that is not inlined. The module is public for
//! `fieldlod_flux` only.

pub(crate) mod bits;

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::{Level, Simd};

pub use bits::{LANES, lane_bits};

/// Eight items of `N` numbers, in columns.
#[derive(Clone, Copy, Debug)]
pub struct Eight<const N: usize>(pub(crate) [[f32; LANES]; N]);

impl<const N: usize> Eight<N> {
    /// The same item in all lanes.
    pub const fn splat(item: [f32; N]) -> Self {
        let mut columns = [[0.0; LANES]; N];
        let mut column = 0;
        while column < N {
            columns[column] = [item[column]; LANES];
            column += 1;
        }
        Self(columns)
    }

    /// Puts items into the lanes of `count` elements; the rest is zero.
    pub fn list(items: impl Iterator<Item = [f32; N]>, count: usize) -> Vec<Self> {
        let mut elements = vec![Self::splat([0.0; N]); count];
        for (index, item) in items.enumerate() {
            elements[index / LANES].set(index % LANES, item);
        }
        elements
    }

    /// Sets the item of one lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, item: [f32; N]) {
        for (column, number) in self.0.iter_mut().zip(item) {
            column[lane] = number;
        }
    }

    /// The item of one lane.
    #[inline(always)]
    #[expect(
        clippy::needless_range_loop,
        reason = "iterators keep the compiler from vector instructions"
    )]
    pub fn at(&self, lane: usize) -> [f32; N] {
        let mut item = [0.0; N];
        for column in 0..N {
            item[column] = self.0[column][lane];
        }
        item
    }
}

/// Runs `run`, which must be `#[inline(always)]`, with AVX2 if the processor has it. The compiler does not fuse products
/// and sums, so that the results are the same.
#[inline]
pub fn with_avx2<R>(run: impl FnOnce() -> R) -> R {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = Level::new().as_avx2() {
        return avx2.vectorize(run);
    }
    run()
}

/// Returns the larger number. If either number is NaN, it returns the second.
#[inline(always)]
pub fn larger(a: f32, b: f32) -> f32 {
    if b < a { a } else { b }
}

/// Returns the smaller number. If either number is NaN, it returns the second.
#[inline(always)]
pub fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
