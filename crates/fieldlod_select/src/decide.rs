//! Which groups ask for refinement: conservative tests first, the criterion where they cannot tell.
//!
//! The tests of [`conservative`] are asked of 64 groups at once, eight such spheres to a register; of
//! eight groups at once where that could not tell; then of each group, eight to a register again. What
//! remains takes that of [`facing`], and what still remains the criterion.

pub(crate) mod conservative;
mod facing;

use std::cell::OnceCell;

use wide::f32x8;

use crate::kernel::Kernel;
use crate::settings::Thresholds;
use crate::table::{CHUNK, GroupTable, LANES, set_bits_of};
use crate::{InstanceView, LodSettings};
use conservative::{InLocal, Tests};

/// Marks the groups whose own error exceeds its threshold, and the terminal ones: a bit for each,
/// 64 to a word. `was_refined` has the last cut's bits. The cut needs the closure on top.
///
/// Same bits as [`promised_error_px`](crate::promised_error_px) of every group against the
/// thresholds, with [`kept_error_px`](crate::kept_error_px) for those that were refined.
pub fn refine(
    table: &GroupTable,
    instance: &InstanceView,
    settings: &LodSettings,
    was_refined: &[u64],
    refined: &mut Vec<u64>,
) {
    let thresholds = settings.thresholds(1.0);
    Decision::new(table, instance, settings, thresholds).decide(table, was_refined, refined);
}

/// The tests of one instance in one view.
pub(crate) struct Decision<'a> {
    kernel: Kernel<'a>,
    instance: &'a InstanceView,
    settings: &'a LodSettings,
    thresholds: Thresholds,
    in_local: InLocal,
    /// Made when first asked.
    entering: OnceCell<Tests>,
    /// For where something was refined.
    leaving: OnceCell<Tests>,
    /// Whether no error, as of what is outside, is below the thresholds.
    zero_is_below: bool,
}

impl<'a> Decision<'a> {
    pub(crate) fn new(
        table: &GroupTable,
        instance: &'a InstanceView,
        settings: &'a LodSettings,
        thresholds: Thresholds,
    ) -> Self {
        Self {
            kernel: Kernel::new(instance, settings),
            instance,
            settings,
            thresholds,
            in_local: InLocal::new(instance, &table.whole.bounds),
            entering: OnceCell::new(),
            leaving: OnceCell::new(),
            zero_is_below: thresholds.coarsen_below_px >= 0.0,
        }
    }

    pub(crate) fn decide(&self, table: &GroupTable, was_refined: &[u64], refined: &mut Vec<u64>) {
        refined.clone_from(&table.terminal);
        for (element, words) in refined.chunks_mut(LANES).enumerate() {
            let first = element * LANES;
            let was = |word: usize| was_refined.get(first + word).copied().unwrap_or(0);
            let may_be_lower = |word: usize| was(word) & !table.terminal[first + word] != 0;
            let any_may = !was_refined.is_empty() && (0..words.len()).any(may_be_lower);
            let live = self.live(|| self.tests(any_may).idle(&table.chunks, element));
            for word in set_bits_of(live & ((1 << words.len()) - 1)) {
                let tests = self.tests(may_be_lower(word));
                words[word] |= self.exceeding(table, first + word, was(word), tests);
            }
        }
    }

    /// The bits of eight bounds that the conservative tests cannot answer for.
    #[inline]
    fn live(&self, idle: impl Fn() -> f32x8) -> u32 {
        if self.zero_is_below {
            !idle().to_bitmask() & 0xff
        } else {
            0xff
        }
    }

    fn tests(&self, may_be_lower: bool) -> &Tests {
        let (tests, camera, threshold_px) = if may_be_lower {
            let kept = &self.instance.kept_camera;
            (&self.leaving, kept, self.thresholds.coarsen_below_px)
        } else {
            let camera = &self.instance.camera;
            (&self.entering, camera, self.thresholds.refine_above_px)
        };
        tests.get_or_init(|| {
            Tests::new(
                self.instance,
                self.in_local,
                camera,
                self.settings,
                threshold_px,
            )
        })
    }

    /// The bits of one word.
    fn exceeding(&self, table: &GroupTable, word: usize, was_refined: u64, tests: &Tests) -> u64 {
        let mut bits = 0;
        for index in set_bits_of(self.live(|| tests.idle_blocks(table, word))) {
            let was = (was_refined >> (index * LANES)) as u32 & 0xff;
            let above = self.exceeding_in(table, word * LANES + index, was, tests);
            bits |= u64::from(above) << (index * LANES);
        }
        bits & valid_bits(table, word)
    }

    /// The bits of one block.
    #[inline]
    fn exceeding_in(
        &self,
        table: &GroupTable,
        block: usize,
        was_refined: u32,
        tests: &Tests,
    ) -> u32 {
        let error_px = if self.zero_is_below {
            let below = tests.idle_groups(table, block);
            if below.all() {
                return 0;
            }
            let unless = self
                .kernel
                .error_px_unless(below, tests, table, block, was_refined);
            let Some(error_px) = unless else {
                return 0;
            };
            error_px
        } else {
            self.kernel.error_px(table, block, was_refined)
        };
        let nan = error_px.simd_ne(error_px);
        let above = |threshold_px: f32| {
            (error_px.simd_gt(f32x8::splat(threshold_px)) | nan).to_bitmask() & 0xff
        };
        let refine = above(self.thresholds.refine_above_px) & !was_refined;
        refine | above(self.thresholds.coarsen_below_px) & was_refined
    }
}

/// The bits of a word that stand for groups.
fn valid_bits(table: &GroupTable, word: usize) -> u64 {
    let rest = table.group_count() - word * CHUNK;
    if rest >= CHUNK {
        u64::MAX
    } else {
        (1 << rest) - 1
    }
}
