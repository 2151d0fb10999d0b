//! Limits of all instances in columns.

use wide::f32x8;

use crate::criterion::limits::Limits;
use crate::lanes::bits::{CHUNK, LANES};
use crate::lanes::{Lane, bits_of};

/// Limits of all instances in columns, eight to an element, and of 64 at once.
#[derive(Debug, Default)]
pub(crate) struct LimitColumns {
    pub(crate) instances: Vec<EightLimits>,
    /// Limits of all instances of a chunk.
    pub(crate) chunks: Vec<EightLimits>,
}

/// The limits of eight instances.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EightLimits {
    pub(crate) lowest: [f32; LANES],
    pub(crate) highest: [f32; LANES],
}

impl EightLimits {
    const EMPTY: Self = Self {
        lowest: [Limits::EMPTY.lowest; LANES],
        highest: [Limits::EMPTY.highest; LANES],
    };

    fn set(&mut self, lane: usize, limits: Limits) {
        (self.lowest[lane], self.highest[lane]) = (limits.lowest, limits.highest);
    }
}

impl LimitColumns {
    /// Resizes the columns to `count` instances.
    pub(crate) fn resize(&mut self, count: usize) {
        let elements = count.div_ceil(LANES);
        self.instances.resize(elements, EightLimits::EMPTY);
        let chunks = elements.div_ceil(CHUNK / LANES).div_ceil(LANES);
        self.chunks.resize(chunks, EightLimits::EMPTY);
    }

    pub(crate) fn set(&mut self, slot: usize, limits: Limits) {
        self.instances[slot / LANES].set(slot % LANES, limits);
        // The next pass tests the chunk instance by instance.
        let chunk = slot / CHUNK;
        self.chunks[chunk / LANES].set(chunk % LANES, Limits::UNKNOWN);
    }

    /// Recomputes the limits of a chunk; they are known only if all its instances are at their coarsest levels.
    pub(crate) fn refit(&mut self, chunk: usize) {
        let first = chunk * (CHUNK / LANES);
        let end = self.instances.len().min(first + CHUNK / LANES);
        let mut highest = f32x8::splat(f32::NEG_INFINITY);
        let mut are_coarsest = f32x8::infinity().is_at_most(f32x8::infinity());
        for eight in &self.instances[first..end] {
            // A maximum would drop NaN.
            let (lowest, other) = (f32x8::new(eight.lowest), f32x8::new(eight.highest));
            highest = f32x8::choose(other.is_at_most(highest), highest, other);
            are_coarsest &= f32x8::infinity().is_at_most(lowest) & other.is_at_most(other);
        }
        let limits = match bits_of(are_coarsest) {
            0xff => Limits {
                lowest: f32::INFINITY,
                highest: highest
                    .to_array()
                    .into_iter()
                    .fold(f32::NEG_INFINITY, f32::max),
            },
            _ => Limits::UNKNOWN,
        };
        self.chunks[chunk / LANES].set(chunk % LANES, limits);
    }
}
