//! Finds the groups of an instance that exceed the threshold, eight at a time. Bounds of 64 and of eight groups are
//! tested first, then the criterion.

use std::cell::OnceCell;

use super::bounds_test::BoundsTest;
use crate::criterion::Criterion;
use crate::criterion::error_bounds::EightBounds;
use crate::lanes::bits::{LANES, block_bits, lane_bits, set_bits_of};
use crate::lanes::with_avx2;
use crate::scene::table::GroupTable;
use crate::settings::{LodSettings, Thresholds};
use crate::view::InstanceView;

/// Sets the bits of groups whose own error exceeds the threshold, and of terminal groups, 64 to a word. `was_refined`
/// has the bits of the previous cut. The new cut refines the groups of the set bits, and all groups that must be
/// refined with them.
///
/// The bits equal the decisions by [`group_error_px`](crate::group_error_px) of every group.
#[cfg(any(test, feature = "test-support"))]
pub fn refine(
    table: &GroupTable,
    instance: &InstanceView,
    settings: &LodSettings,
    was_refined: &[u64],
    refined: &mut Vec<u64>,
) {
    let decision = Decision::new(instance, settings, 1.0, 1.0);
    decision.decide(table, was_refined, refined);
}

/// The decisions on one instance in one view.
pub(crate) struct Decision<'a> {
    criterion: Criterion,
    instance: &'a InstanceView,
    settings: &'a LodSettings,
    thresholds: Thresholds,
    /// The test of groups that were not refined, made on first use.
    entering: OnceCell<BoundsTest>,
    /// The test of groups that were refined, made on first use.
    leaving: OnceCell<BoundsTest>,
}

impl<'a> Decision<'a> {
    /// The errors and deviations of the instance count `bias` times, its errors also `weight` times.
    pub(crate) fn new(
        instance: &'a InstanceView,
        settings: &'a LodSettings,
        bias: f32,
        weight: f32,
    ) -> Self {
        Self {
            criterion: Criterion::new(instance, settings, weight),
            instance,
            settings,
            thresholds: settings.thresholds(bias),
            entering: OnceCell::new(),
            leaving: OnceCell::new(),
        }
    }

    /// Decides all groups of a table.
    pub(crate) fn decide(&self, table: &GroupTable, was_refined: &[u64], refined: &mut Vec<u64>) {
        refined.clone_from(&table.terminal);
        with_avx2(
            #[inline(always)]
            || self.add_exceeding(table, was_refined, refined),
        );
    }

    /// Adds the groups that exceed the threshold to the bits of terminal groups.
    #[inline(always)]
    fn add_exceeding(&self, table: &GroupTable, was_refined: &[u64], refined: &mut [u64]) {
        // The bounds only show that errors are below a threshold; a negative one refines groups without errors too.
        let has_bounds = self.thresholds.coarsen_below_px >= 0.0;
        for (element, words) in refined.chunks_mut(LANES).enumerate() {
            let first = element * LANES;
            let was = |word: usize| was_refined.get(first + word).copied().unwrap_or(0);
            // The lower threshold counts only for refined groups that are not terminal.
            let may_leave = |word: usize| was(word) & !table.terminal[first + word] != 0;
            let any_may_leave = (0..words.len()).any(may_leave);
            // The bits of bounds that may hold a group above the threshold.
            let live = |test: &BoundsTest, bounds: &EightBounds| {
                if has_bounds {
                    !test.passes(bounds) & 0xff
                } else {
                    0xff
                }
            };
            // 64 groups at once, then eight, then each.
            let test = self.bounds_test(table, any_may_leave);
            let chunks = live(test, &table.chunks[element]);
            for word in set_bits_of(chunks & ((1 << words.len()) - 1)) {
                let test = self.bounds_test(table, may_leave(word));
                let mut bits = 0;
                for index in set_bits_of(live(test, &table.blocks[first + word])) {
                    let block = (first + word) * LANES + index;
                    let was_refined = block_bits(was(word), index);
                    bits |=
                        u64::from(self.decide_block(table, block, was_refined)) << (index * LANES);
                }
                // Lanes beyond the last group are zeros, whose errors are 0: a negative threshold refines them.
                words[word] |= bits & table.present_in(first + word);
            }
        }
    }

    /// The level of a [chain](GroupTable::is_chain) that was drawn at the level `was`: its finest refined group, since
    /// all coarser groups are refined with it.
    pub(crate) fn level(&self, table: &GroupTable, was: usize) -> usize {
        let (refined, terminal) = (table.refined_at_level(was), table.terminal[0]);
        let coarsest = table.group_count - 1;
        with_avx2(
            #[inline(always)]
            || {
                // Adaptors such as `find_map` would be functions of their own, without AVX2.
                for block in 0..table.group_count.div_ceil(LANES) {
                    let own = self.decide_block(table, block, block_bits(refined, block));
                    let own = own | block_bits(terminal, block);
                    if own != 0 {
                        return block * LANES + own.trailing_zeros() as usize;
                    }
                }
                coarsest
            },
        )
    }

    fn bounds_test(&self, table: &GroupTable, may_leave: bool) -> &BoundsTest {
        let (instance, settings) = (self.instance, self.settings);
        let (test, camera, threshold_px) = if may_leave {
            let threshold_px = self.thresholds.coarsen_below_px;
            (&self.leaving, &instance.kept_camera, threshold_px)
        } else {
            let threshold_px = self.thresholds.refine_above_px;
            (&self.entering, &instance.camera, threshold_px)
        };
        let sphere = &table.bounds.sphere;
        let size = sphere.center.length() + sphere.radius;
        // Most instances need one of the two tests only.
        test.get_or_init(|| BoundsTest::new(instance, settings, size, camera, threshold_px))
    }

    /// The bits of one block by the criterion.
    #[inline(always)]
    fn decide_block(&self, table: &GroupTable, block: usize, was_refined: u32) -> u32 {
        let groups = &table.groups[block];
        let thresholds = self.thresholds;
        self.criterion.with_known_branches(
            #[inline(always)]
            |criterion| {
                let mut exceeds = [0; LANES];
                for (lane, exceeds) in exceeds.iter_mut().enumerate() {
                    let was_refined = was_refined & 1 << lane != 0;
                    let error_px = criterion.error_px(groups.at(lane), was_refined);
                    *exceeds = u8::from(thresholds.exceeded_by(error_px, was_refined));
                }
                lane_bits(&exceeds)
            },
        )
    }
}
