//! The same code computes one group or eight. It uses only operations that IEEE 754 rounds exactly, in glam's order.
//! Both results are bit-identical.
//!
//! `f32x8` uses the instructions of the target, which are those of SSE2 in a usual build. The pass over all instances is
//! instead written as loops over eight `f32`, which the compiler turns into vector instructions, and runs
//! [`with_avx2`].

pub(crate) mod bits;

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::{Level, Simd};
use glam::{Mat3, Vec3};
use wide::f32x8;

/// A number of one group, or the numbers of eight groups.
pub(crate) trait Lane:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// One `bool` for each group.
    type Mask: Copy
        + BitAnd<Output = Self::Mask>
        + BitOr<Output = Self::Mask>
        + Not<Output = Self::Mask>;

    fn splat(value: f32) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    fn is_below(self, other: Self) -> Self::Mask;
    fn is_at_most(self, other: Self) -> Self::Mask;
    /// One of two numbers for each group.
    fn choose(mask: Self::Mask, if_true: Self, if_false: Self) -> Self;

    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }

    #[inline(always)]
    fn infinity() -> Self {
        Self::splat(f32::INFINITY)
    }

    #[inline]
    fn not_a_number(self) -> Self::Mask {
        !self.is_at_most(self)
    }

    /// Returns the larger number. If either number is NaN, it returns the second.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self::choose(other.is_below(self), self, other)
    }

    /// Returns the smaller number. If either number is NaN, it returns the second.
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        Self::choose(self.is_below(other), self, other)
    }

    /// Whether the number is finite and not negative.
    #[inline]
    fn is_length(self) -> Self::Mask {
        Self::zero().is_at_most(self) & self.is_below(Self::infinity())
    }
}

impl Lane for f32 {
    type Mask = bool;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn choose(mask: bool, if_true: Self, if_false: Self) -> Self {
        if mask { if_true } else { if_false }
    }
}

impl Lane for f32x8 {
    type Mask = f32x8;

    #[inline]
    fn splat(value: f32) -> Self {
        f32x8::new([value; 8])
    }

    #[inline]
    fn sqrt(self) -> Self {
        f32x8::sqrt(self)
    }

    #[inline]
    fn abs(self) -> Self {
        f32x8::abs(self)
    }

    #[inline]
    fn is_below(self, other: Self) -> f32x8 {
        self.simd_lt(other)
    }

    #[inline]
    fn is_at_most(self, other: Self) -> f32x8 {
        self.simd_le(other)
    }

    #[inline]
    fn choose(mask: f32x8, if_true: Self, if_false: Self) -> Self {
        mask.bitselect(if_true, if_false)
    }
}

/// Runs `run`, which must be `#[inline(always)]`, with AVX2 if the processor has it. The compiler does not fuse products
/// and sums, so that the results are the same.
#[inline]
pub(crate) fn with_avx2<R>(run: impl FnOnce() -> R) -> R {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = Level::new().as_avx2() {
        return avx2.vectorize(run);
    }
    run()
}

/// Converts bits to a lane mask.
#[inline]
pub(crate) fn mask_of(bits: u32) -> f32x8 {
    let lane = |index: usize| f32::from_bits(0u32.wrapping_sub(bits >> index & 1));
    match bits {
        // Fast paths for no lane and for all lanes.
        0 => f32x8::splat(0.0),
        0xff => f32x8::splat(lane(0)),
        _ => f32x8::from(std::array::from_fn(lane)),
    }
}

/// Converts a lane mask to bits.
#[inline]
pub(crate) fn bits_of(mask: f32x8) -> u32 {
    mask.to_bitmask() & 0xff
}

/// A vector of each group.
#[derive(Clone, Copy, Debug)]
pub(crate) struct V3<L> {
    pub(crate) x: L,
    pub(crate) y: L,
    pub(crate) z: L,
}

impl<L: Lane> V3<L> {
    #[inline(always)]
    pub(crate) fn splat(v: Vec3) -> Self {
        let [x, y, z] = v.to_array().map(L::splat);
        Self { x, y, z }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> L {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        let (x, y, z) = (self.x + other.x, self.y + other.y, self.z + other.z);
        Self { x, y, z }
    }

    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        let (x, y, z) = (self.x - other.x, self.y - other.y, self.z - other.z);
        Self { x, y, z }
    }

    #[inline(always)]
    pub(crate) fn times(self, factor: L) -> Self {
        let (x, y, z) = (self.x * factor, self.y * factor, self.z * factor);
        Self { x, y, z }
    }
}

impl V3<f32x8> {
    /// The vectors of eight lanes.
    pub(crate) fn from_lanes(of_lane: impl Fn(usize) -> Vec3) -> Self {
        let lanes: [Vec3; 8] = std::array::from_fn(of_lane);
        let [x, y, z] = std::array::from_fn(|axis| f32x8::from(lanes.map(|lane| lane[axis])));
        Self { x, y, z }
    }
}

/// The same matrix for all groups.
#[derive(Clone, Copy, Debug)]
pub(crate) struct M3<L>([V3<L>; 3]);

impl<L: Lane> M3<L> {
    #[inline(always)]
    pub(crate) fn splat(m: &Mat3) -> Self {
        Self([m.x_axis, m.y_axis, m.z_axis].map(V3::splat))
    }

    #[inline(always)]
    pub(crate) fn of(&self, v: V3<L>) -> V3<L> {
        let [a, b, c] = self.0;
        a.times(v.x).plus(b.times(v.y)).plus(c.times(v.z))
    }
}
