//! Limits of all instances in columns.

use crate::criterion::limits::Limits;
use crate::lanes::bits::{CHUNK, LANES};
use crate::lanes::{Eight, larger};
use crate::scene::columns::truncate;

/// Limits of all instances in columns, eight to an element, and of 64 at once.
#[derive(Debug, Default)]
pub(crate) struct LimitColumns {
    pub(crate) instances: Vec<EightLimits>,
    /// Limits of all instances of a chunk.
    pub(crate) chunks: Vec<EightLimits>,
}

/// The limits of eight instances: the lowest and the highest allowed errors.
pub(crate) type EightLimits = Eight<2>;

const EMPTY: EightLimits = Eight::splat([Limits::EMPTY.lowest, Limits::EMPTY.highest]);

fn set(limits: &mut [EightLimits], index: usize, Limits { lowest, highest }: Limits) {
    limits[index / LANES].set(index % LANES, [lowest, highest]);
}

fn resize(limits: &mut Vec<EightLimits>, count: usize) {
    let elements = count.div_ceil(LANES);
    truncate(limits, elements);
    limits.resize(elements, EMPTY);
    // Lanes beyond the last one are never near.
    for beyond in count..elements * LANES {
        set(limits, beyond, Limits::EMPTY);
    }
}

impl LimitColumns {
    /// Resizes the columns to `count` instances.
    pub(crate) fn resize(&mut self, count: usize) {
        resize(&mut self.instances, count);
        resize(&mut self.chunks, count.div_ceil(CHUNK));
    }

    pub(crate) fn set(&mut self, slot: usize, limits: Limits) {
        set(&mut self.instances, slot, limits);
        // The next pass tests the chunk instance by instance.
        set(&mut self.chunks, slot / CHUNK, Limits::UNKNOWN);
    }

    /// Recomputes the limits of a chunk; they are known only if none of its instances can become coarser.
    pub(crate) fn refit(&mut self, chunk: usize) {
        let first = chunk * (CHUNK / LANES);
        let end = self.instances.len().min(first + CHUNK / LANES);
        let mut most = [f32::NEG_INFINITY; LANES];
        let mut are_coarsest = [1u8; LANES];
        for Eight([lowest, highest]) in &self.instances[first..end] {
            for lane in 0..LANES {
                // `larger` drops a NaN in its first argument.
                let is_known = (lowest[lane] >= f32::INFINITY) & !highest[lane].is_nan();
                are_coarsest[lane] &= u8::from(is_known);
                most[lane] = larger(highest[lane], most[lane]);
            }
        }
        let limits = if are_coarsest == [1; LANES] {
            Limits {
                lowest: f32::INFINITY,
                highest: most.into_iter().fold(f32::NEG_INFINITY, larger),
            }
        } else {
            Limits::UNKNOWN
        };
        set(&mut self.chunks, chunk, limits);
    }
}
