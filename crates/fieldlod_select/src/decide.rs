//! Which groups ask for refinement: tests that are cheap first, the criterion where they cannot tell.
//!
//! Each test answers only where it is certain that the criterion would answer the same. The tests of
//! [`bounds_test`] are asked of 64 groups at once, eight such spheres to a register; of eight groups at
//! once where that could not tell; then of each group, eight to a register again. What remains takes
//! the test of [`interval`], which tells both ways, and what still remains the criterion. What each of
//! them is worth is in the record of `benches/selection`.

mod bounds_test;
mod facing;
mod interval;
mod level;
mod local_view;

use std::cell::OnceCell;

use wide::f32x8;

use crate::bits::{LANES, block_bits, set_bits_of};
use crate::criterion::Criterion;
use crate::lane::{Lane, bits_of, mask_of};
use crate::settings::{LodSettings, Thresholds};
use crate::shares::Shares;
use crate::table::GroupTable;
use crate::validity::Tolerance;
use crate::view::InstanceView;
use crate::view_parts::ViewParts;
use bounds_test::BoundsTest;
use interval::IntervalTest;
pub(crate) use level::LevelAnswer;
use local_view::LocalView;

/// Marks the groups whose own error exceeds its threshold, and the terminal ones: a bit for each,
/// 64 to a word. `was_refined` has the last cut's bits. The cut needs the closure on top.
///
/// Same bits as [`group_error_px`](crate::group_error_px) of every group against its threshold.
pub fn refine(
    table: &GroupTable,
    instance: &InstanceView,
    settings: &LodSettings,
    was_refined: &[u64],
    refined: &mut Vec<u64>,
) {
    let parts = ViewParts::new(&instance.camera, &instance.kept_camera, settings);
    let decision = Decision::new(
        table,
        instance,
        &parts,
        1.0,
        &Tolerance::default(),
        Shares::FULL,
    );
    decision.decide(table, was_refined, refined);
}

/// The tests of one instance in one view.
pub(crate) struct Decision<'a> {
    local: LocalView<'a>,
    thresholds: Thresholds,
    shares: Shares<'a>,
    /// Made when first asked, as are the tests.
    criterion: OnceCell<Criterion<'a, f32x8>>,
    entering: OnceCell<BoundsTest>,
    /// For where something was refined.
    leaving: OnceCell<BoundsTest>,
    interval: Option<IntervalTest<'a>>,
    /// Whether no error, as of what is outside, is below the thresholds.
    zero_is_below: bool,
}

/// Bits, and whether they stay valid under the moves that were asked for.
#[derive(Clone, Copy)]
struct Answer {
    bits: u32,
    stays_valid: bool,
}

impl<'a> Decision<'a> {
    /// The errors of the instance count `bias` times. Answers tell whether they stay valid for all poses
    /// within `tolerance`, whose move is that of points in camera space, by turns too.
    #[inline]
    pub(crate) fn new(
        table: &GroupTable,
        instance: &'a InstanceView,
        parts: &'a ViewParts<'a>,
        bias: f32,
        tolerance: &Tolerance,
        shares: Shares<'a>,
    ) -> Self {
        let thresholds = parts.settings.thresholds(bias);
        let local = LocalView::new(instance, parts, &table.bounds.sphere, tolerance);
        Self {
            interval: IntervalTest::new(&local, &table.bounds, thresholds),
            local,
            thresholds,
            shares,
            criterion: OnceCell::new(),
            entering: OnceCell::new(),
            leaving: OnceCell::new(),
            zero_is_below: thresholds.coarsen_below_px >= 0.0,
        }
    }

    /// Decides all groups of a table.
    pub(crate) fn decide(&self, table: &GroupTable, was_refined: &[u64], refined: &mut Vec<u64>) {
        refined.clone_from(&table.terminal);
        for (element, words) in refined.chunks_mut(LANES).enumerate() {
            self.decide_words(table, element, was_refined, words, 0xff);
        }
    }

    /// Adds the bits to those words of an element of eight that `asked` has bits of: they have the
    /// terminal groups' so far. Returns bits of those whose answers stay valid.
    pub(crate) fn decide_words(
        &self,
        table: &GroupTable,
        element: usize,
        was_refined: &[u64],
        words: &mut [u64],
        asked: u32,
    ) -> u32 {
        let first = element * LANES;
        let asked = asked & ((1 << words.len()) - 1);
        let was = |word: usize| was_refined.get(first + word).copied().unwrap_or(0);
        // Only where a group was refined that need not be, the lower threshold is asked for.
        let may_leave = |word: usize| was(word) & !table.terminal[first + word] != 0;
        let any_may_leave = !was_refined.is_empty() && set_bits_of(asked).any(may_leave);
        // All words at once, then each that this could not answer for.
        let test = self.bounds_test(any_may_leave);
        let live = asked & self.live(|| test.passes_chunks(table, element));
        let mut valid = asked & !live;
        for word in set_bits_of(live) {
            let test = self.bounds_test(may_leave(word));
            let (bits, stays_valid) = self.decide_blocks(table, first + word, was(word), test);
            words[word] |= bits;
            valid |= u32::from(stays_valid) << word;
        }
        valid
    }

    /// The bits of eight bounds that the bounds tests cannot answer for.
    #[inline]
    fn live(&self, passed: impl Fn() -> f32x8) -> u32 {
        if self.zero_is_below {
            !bits_of(passed()) & 0xff
        } else {
            0xff
        }
    }

    fn bounds_test(&self, may_leave: bool) -> &BoundsTest {
        let (parts, thresholds) = (self.local.parts, self.thresholds);
        let (test, camera, threshold_px) = if may_leave {
            (&self.leaving, parts.leaving(), thresholds.coarsen_below_px)
        } else {
            (&self.entering, &parts.entering, thresholds.refine_above_px)
        };
        test.get_or_init(|| BoundsTest::new(&self.local, camera, threshold_px))
    }

    /// The bits of one word, and whether they stay valid.
    fn decide_blocks(
        &self,
        table: &GroupTable,
        word: usize,
        was_refined: u64,
        test: &BoundsTest,
    ) -> (u64, bool) {
        // Eight blocks at once, then each that this could not answer for.
        let (mut bits, mut stays_valid) = (0, true);
        for index in set_bits_of(self.live(|| test.passes_blocks(table, word))) {
            let was = block_bits(was_refined, index);
            let answer = self.decide_block(table, word * LANES + index, was, test);
            bits |= u64::from(answer.bits) << (index * LANES);
            stays_valid &= answer.stays_valid;
        }
        (bits & table.present_in(word), stays_valid)
    }

    /// The bits of one block.
    #[inline]
    fn decide_block(
        &self,
        table: &GroupTable,
        block: usize,
        was_refined: u32,
        test: &BoundsTest,
    ) -> Answer {
        // The other tests tell only that errors are small.
        if !self.zero_is_below {
            return self.decide_exactly(table, block, was_refined);
        }
        // Each group by its bounds.
        let below = test.passes_groups(table, block);
        if below.all() {
            return Answer {
                bits: 0,
                stays_valid: true,
            };
        }
        // Both ways, by an interval of the criterion.
        if let Some(interval) = &self.interval {
            let certain = interval.certain(table, block, was_refined, self.shares.of_block(block));
            let told = bits_of(certain.below | certain.above | below);
            if told | table.terminal_or_missing_in(block) == 0xff {
                return Answer {
                    bits: bits_of(certain.above),
                    stays_valid: true,
                };
            }
        }
        self.decide_exactly(table, block, was_refined)
    }

    /// The bits of one block by the criterion, which is valid for this pose alone.
    #[inline]
    fn decide_exactly(&self, table: &GroupTable, block: usize, was_refined: u32) -> Answer {
        let criterion = self
            .criterion
            .get_or_init(|| Criterion::new(self.local.instance, self.local.parts.settings));
        let was = mask_of(was_refined);
        let error_px = criterion.error_px(&table.criterion_input(block, self.shares), was);
        let exceeds = |threshold_px: f32| {
            bits_of(f32x8::splat(threshold_px).is_below(error_px) | error_px.not_a_number())
        };
        // Each group against the threshold of its last answer; NaN asks for refinement.
        let entering = exceeds(self.thresholds.refine_above_px) & !was_refined;
        let staying = exceeds(self.thresholds.coarsen_below_px) & was_refined;
        Answer {
            bits: entering | staying,
            stays_valid: false,
        }
    }
}
