//! The level of a mesh that is drawn as a whole, and how far the camera may move until it is another.
//!
//! Of a chain of levels, each simplified from the one before, the finest group that is refined tells what is
//! drawn: coarser ones are refined whatever their errors. The answer holds while that group stays so and none
//! finer becomes so, which [`interval`](super::interval) tells for all poses within a distance. The largest such
//! distance is sought by halves and doubles.

use super::Decision;
use crate::bits::{CHUNK, LANES, block_bits};
use crate::lane::bits_of;
use crate::table::GroupTable;
use crate::validity::Tolerance;

/// The share of the largest tolerance that is asked for first, and how often that doubles to all of it.
const FIRST_SHARE: f32 = 0.125;
const DOUBLINGS: u32 = 3;

/// What is drawn of a mesh as a whole.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LevelAnswer {
    pub(crate) level: usize,
    /// How far the camera may move and turn with the same answer; `None` if that is not known.
    pub(crate) tolerance: Option<Tolerance>,
}

impl LevelAnswer {
    fn here(level: usize) -> Self {
        Self {
            level,
            tolerance: None,
        }
    }
}

impl Decision<'_> {
    /// The level of a [chain](GroupTable::is_chain) that was drawn at the level `was`, tolerating as much
    /// as it can from the least to the largest of `tolerances`, if there are any.
    pub(crate) fn level(
        &mut self,
        table: &GroupTable,
        was: usize,
        tolerances: Option<[Tolerance; 2]>,
    ) -> LevelAnswer {
        let tolerating = tolerances
            .and_then(|[least, largest]| self.level_tolerating(table, was, &least, largest));
        let mut level_here = || self.certain_level(table, was, &Tolerance::default());
        tolerating
            .or_else(|| level_here().map(LevelAnswer::here))
            .unwrap_or_else(|| LevelAnswer::here(self.exact_level(table, was)))
    }

    /// The level with the largest tolerance that can be told; `None` if that is too little.
    fn level_tolerating(
        &mut self,
        table: &GroupTable,
        was: usize,
        least: &Tolerance,
        largest: Tolerance,
    ) -> Option<LevelAnswer> {
        // From where most answers end, up by twice as much or down by half.
        let mut tolerance = largest.times(FIRST_SHARE);
        let mut level = self.certain_level(table, was, &tolerance);
        if level.is_some() {
            for _ in 0..DOUBLINGS {
                let more = tolerance.times(2.0);
                if self.certain_level(table, was, &more).is_none() {
                    break;
                }
                tolerance = more;
            }
        }
        while level.is_none() && tolerance.holds(least) {
            tolerance = tolerance.times(0.5);
            level = self.certain_level(table, was, &tolerance);
        }
        level.map(|level| LevelAnswer {
            level,
            tolerance: Some(tolerance),
        })
    }

    /// The level by the criterion.
    fn exact_level(&self, table: &GroupTable, was: usize) -> usize {
        let refined = [table.refined_at_level(was)];
        let mut own = [table.terminal[0]];
        self.decide_words(table, 0, &refined, &mut own, 1);
        own[0].trailing_zeros() as usize
    }

    /// The level for all poses within `tolerance`, if it is the same one and that can be told.
    pub(crate) fn certain_level(
        &mut self,
        table: &GroupTable,
        was: usize,
        tolerance: &Tolerance,
    ) -> Option<usize> {
        let interval = self.interval.as_mut().filter(|_| self.zero_is_below)?;
        interval.tolerate(&self.local, tolerance);
        let (refined, terminal) = (table.refined_at_level(was), table.terminal[0]);
        for block in 0..table.group_count().div_ceil(LANES) {
            let was_refined = block_bits(refined, block);
            let certain = interval.certain(table, block, was_refined, self.shares.of_block(block));
            let above = bits_of(certain.above) | block_bits(terminal, block);
            let below = bits_of(certain.below) & !above;
            // Those before the first that is not below.
            let first = (!below).trailing_zeros() as usize;
            if first < LANES {
                return (above >> first & 1 == 1).then_some(block * LANES + first);
            }
        }
        debug_assert!(table.group_count() <= CHUNK, "the last group is terminal");
        None
    }
}
