//! Which groups ask for refinement: conservative tests first, the criterion where they cannot tell.
//!
//! The tests of [`conservative`] are asked of 64 groups at once, eight such spheres to a register; of
//! eight groups at once where that could not tell, with [`facing`]; then of each group, eight to a
//! register again. What remains takes the test of [`interval`], which tells both ways, and what still
//! remains the criterion.

pub(crate) mod conservative;
mod facing;
mod interval;

use std::cell::OnceCell;

use camera_field::Camera;
use wide::f32x8;

use crate::kernel::Kernel;
use crate::settings::Thresholds;
use crate::table::{CHUNK, GroupTable, LANES, set_bits_of};
use crate::{InstanceView, LodSettings};
use conservative::{CameraParts, InLocal, Tests};
use interval::{IntervalTest, IntervalView};

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
    let thresholds = settings.thresholds(1.0);
    let parts = ViewParts::new(&instance.camera, &instance.kept_camera, settings);
    let decision = Decision::new(table, instance, &parts, settings, thresholds, 0.0);
    decision.decide(table, was_refined, refined);
}

/// What the tests of all instances need of a view under one set of settings.
pub(crate) struct ViewParts {
    entering: CameraParts,
    leaving: CameraParts,
    interval: IntervalView,
}

impl ViewParts {
    pub(crate) fn new(camera: &Camera, kept: &Camera, settings: &LodSettings) -> Self {
        let entering = CameraParts::new(camera, settings);
        let leaving = CameraParts::new(kept, settings);
        Self {
            entering,
            leaving,
            interval: IntervalView::new(&entering, &leaving),
        }
    }
}

/// The tests of one instance in one view.
pub(crate) struct Decision<'a> {
    instance: &'a InstanceView,
    parts: &'a ViewParts,
    settings: &'a LodSettings,
    thresholds: Thresholds,
    in_local: InLocal,
    /// Made when first asked.
    kernel: OnceCell<Kernel<'a>>,
    entering: OnceCell<Tests>,
    /// For where something was refined.
    leaving: OnceCell<Tests>,
    interval: Option<IntervalTest<'a>>,
    /// Whether no error, as of what is outside, is below the thresholds.
    zero_is_below: bool,
}

/// Bits, and whether they hold on the way that was asked for.
#[derive(Clone, Copy)]
struct Answer {
    bits: u32,
    holds: bool,
}

impl Answer {
    const NONE_REFINED: Self = Self {
        bits: 0,
        holds: true,
    };
}

impl<'a> Decision<'a> {
    /// Answers tell whether they hold for all poses that move no point farther than `way` in camera
    /// space.
    pub(crate) fn new(
        table: &GroupTable,
        instance: &'a InstanceView,
        parts: &'a ViewParts,
        settings: &'a LodSettings,
        thresholds: Thresholds,
        way: f32,
    ) -> Self {
        let in_local = InLocal::new(instance, &table.whole.bounds, way);
        let interval = &parts.interval;
        Self {
            instance,
            parts,
            settings,
            thresholds,
            in_local,
            kernel: OnceCell::new(),
            entering: OnceCell::new(),
            leaving: OnceCell::new(),
            interval: IntervalTest::new(interval, table, instance, &in_local, settings, thresholds),
            zero_is_below: thresholds.coarsen_below_px >= 0.0,
        }
    }

    pub(crate) fn decide(&self, table: &GroupTable, was_refined: &[u64], refined: &mut Vec<u64>) {
        refined.clone_from(&table.terminal);
        for (element, words) in refined.chunks_mut(LANES).enumerate() {
            self.decide_words(table, element, was_refined, words, 0xff);
        }
    }

    /// Adds the bits to those words of an element of eight that `asked` has bits of: they have the
    /// terminal groups' so far. Returns bits of those whose answers hold on the way.
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
        let may_be_lower = |word: usize| was(word) & !table.terminal[first + word] != 0;
        let any_may = !was_refined.is_empty() && set_bits_of(asked).any(may_be_lower);
        let live = asked & self.live(|| self.tests(any_may).idle(&table.chunks, element));
        let mut held = asked & !live;
        for word in set_bits_of(live) {
            let tests = self.tests(may_be_lower(word));
            let (bits, holds) = self.exceeding(table, first + word, was(word), tests);
            words[word] |= bits;
            held |= u32::from(holds) << word;
        }
        held
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

    fn kernel(&self) -> &Kernel<'a> {
        self.kernel
            .get_or_init(|| Kernel::new(self.instance, self.settings))
    }

    fn tests(&self, may_be_lower: bool) -> &Tests {
        let (tests, parts, threshold_px) = if may_be_lower {
            let parts = &self.parts.leaving;
            (&self.leaving, parts, self.thresholds.coarsen_below_px)
        } else {
            let parts = &self.parts.entering;
            (&self.entering, parts, self.thresholds.refine_above_px)
        };
        tests.get_or_init(|| {
            Tests::new(
                self.instance,
                self.in_local,
                parts,
                self.settings,
                threshold_px,
            )
        })
    }

    /// The bits of one word.
    fn exceeding(
        &self,
        table: &GroupTable,
        word: usize,
        was_refined: u64,
        tests: &Tests,
    ) -> (u64, bool) {
        let (mut bits, mut holds) = (0, true);
        for index in set_bits_of(self.live(|| tests.idle_blocks(table, word))) {
            let was = (was_refined >> (index * LANES)) as u32 & 0xff;
            let answer = self.exceeding_in(table, word * LANES + index, was, tests);
            bits |= u64::from(answer.bits) << (index * LANES);
            holds &= answer.holds;
        }
        (bits & valid_bits(table, word), holds)
    }

    /// The bits of one block.
    #[inline]
    fn exceeding_in(
        &self,
        table: &GroupTable,
        block: usize,
        was_refined: u32,
        tests: &Tests,
    ) -> Answer {
        if !self.zero_is_below {
            let error_px = self.kernel().error_px(table, block, was_refined);
            return self.compared(error_px, was_refined);
        }
        let below = tests.idle_groups(table, block);
        if below.all() {
            return Answer::NONE_REFINED;
        }
        if let Some(interval) = &self.interval {
            let certain = interval.certain(table, block, was_refined);
            let told = certain.below | certain.above | below;
            let told = told.to_bitmask() | table.terminal_in(block);
            if told & 0xff == 0xff {
                return Answer {
                    bits: certain.above.to_bitmask() & 0xff,
                    holds: true,
                };
            }
            let error_px = self.kernel().error_px(table, block, was_refined);
            return self.compared(error_px, was_refined);
        }
        let kernel = self.kernel();
        match kernel.error_px_unless(below, tests, table, block, was_refined) {
            Some(error_px) => self.compared(error_px, was_refined),
            None => Answer {
                bits: 0,
                holds: false,
            },
        }
    }

    /// The bits of errors above their thresholds, as of now.
    #[inline]
    fn compared(&self, error_px: f32x8, was_refined: u32) -> Answer {
        let nan = error_px.simd_ne(error_px);
        let above = |threshold_px: f32| {
            (error_px.simd_gt(f32x8::splat(threshold_px)) | nan).to_bitmask() & 0xff
        };
        let refine = above(self.thresholds.refine_above_px) & !was_refined;
        Answer {
            bits: refine | above(self.thresholds.coarsen_below_px) & was_refined,
            holds: false,
        }
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
