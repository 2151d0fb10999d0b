//! The cut of one instance that is decided group by group, in storage that is used again.

use super::chunk_validity::ChunkValidity;
use super::decide_context::DecideContext;
use super::share_memory::{SeenShares, ShareMemory};
use crate::bits::{CHUNK, LANES, set_bits_of};
use crate::decide::Decision;
use crate::scene::Instance;
use crate::table::GroupTable;
use crate::validity::{CameraTravel, Tolerance, Validity};
use crate::view::InstanceView;

#[derive(Debug, Default)]
pub(super) struct InstanceCut {
    /// Bits of groups whose own errors exceed their thresholds.
    own: Vec<u64>,
    /// The closure of those, now and in the last frame.
    refined: Vec<u64>,
    refined_before: Vec<u64>,
    /// Of the refined groups those that are at hand, if not all are.
    drawn: Vec<u64>,
    available_revision: u32,
    units: Vec<u32>,
    units_before: Vec<u32>,
    triangle_count: u64,
    triangles_before: u64,
    groups_decided: usize,
    has_changed: bool,
    chunk_validity: ChunkValidity,
    validity: Validity,
    shares: ShareMemory,
    /// The instance that the cut is of, while there is one.
    instance: Option<u32>,
    class: u32,
}

impl InstanceCut {
    /// With room for any cut of a mesh of a [size class](GroupTable::size_class).
    pub(super) fn of_class(class: u32) -> Self {
        let units = || Vec::with_capacity(1 << class);
        let word_count = (1usize << class).div_ceil(CHUNK);
        let words = || Vec::with_capacity(word_count);
        Self {
            own: words(),
            refined: words(),
            refined_before: words(),
            drawn: words(),
            units: units(),
            units_before: units(),
            chunk_validity: ChunkValidity::with_capacity(word_count),
            shares: ShareMemory::with_capacity(word_count),
            class,
            ..Self::default()
        }
    }

    /// Begins with an instance that was at its coarsest, or not there: every group that was refined is so whatever
    /// its error.
    pub(super) fn begin_at_coarsest(&mut self, table: &GroupTable) {
        self.begin(&table.coarsest_refined);
        self.units.clone_from(&table.coarsest_units);
        self.triangle_count = table.coarsest_triangle_count;
        self.available_revision = table.available_revision;
    }

    /// Begins with a mesh that was drawn as a whole at a level.
    pub(super) fn begin_at_level(&mut self, table: &GroupTable, level: usize) {
        self.begin(&[table.refined_at_level(level)]);
        self.units.clear();
        self.triangle_count = table.gather_units(&self.refined, &mut self.units);
        // What is at hand was not asked for.
        self.available_revision = table.available_revision.wrapping_sub(1);
    }

    fn begin(&mut self, refined: &[u64]) {
        self.refined.clear();
        self.refined.extend_from_slice(refined);
        self.own.clone_from(&self.refined);
        self.chunk_validity.forget();
        self.validity = Validity::NONE;
    }

    /// Decides the next cut of the same instance: the words whose answers are not valid any more. None
    /// is if the instance `has_moved`.
    pub(super) fn decide_again(
        &mut self,
        table: &GroupTable,
        instance: &Instance,
        context: &DecideContext,
        has_moved: bool,
    ) {
        let DecideContext { test, now, .. } = context;
        // How far the camera may move with the answers still valid.
        if has_moved {
            self.chunk_validity.forget();
        }
        let farthest = test.farthest(&instance.node.bounds.sphere);
        self.chunk_validity
            .begin(self.own.len(), farthest, now, &context.last_step);
        let is_lasting = test.is_usable() && !now.is_restless() && !context.last_step.zooms();
        let tolerance = if is_lasting {
            self.chunk_validity.tolerance()
        } else {
            Tolerance::default()
        };
        // The words that are to be decided.
        let view = InstanceView::new(context.view, &instance.world_from_local);
        let memory = std::mem::take(&mut self.shares);
        let shares = memory.shares(context.parts.settings);
        let (parts, bias) = (context.parts, instance.bias);
        let decision = Decision::new(table, &view, parts, bias, &tolerance, shares);
        let own_changed = self.decide_ended(table, &decision, now, tolerance.moved > 0.0);
        self.shares = memory;
        // The cut, if it can have changed.
        self.has_changed = own_changed && self.close(table);
        if self.has_changed {
            self.end_changed();
            self.gather(table);
        }
        self.validity = self.chunk_validity.finish(now);
    }

    /// Draws a level of the mesh, for good; `is_next` says that the instance had a cut of its own before.
    pub(super) fn decide_forced(
        &mut self,
        table: &GroupTable,
        level: u32,
        is_next: bool,
        now: &CameraTravel,
    ) {
        if !is_next {
            self.refined.clone_from(&table.coarsest_refined);
        }
        table.refine_from_level(level, &mut self.own);
        self.groups_decided = table.group_count();
        self.has_changed = self.close(table) || !is_next;
        if self.has_changed {
            self.gather(table);
        }
        self.chunk_validity.forget();
        self.validity = Validity::forever(now);
    }

    /// Decides the words that are not valid any more. Whether any bit of theirs has changed. The answers
    /// stay valid only if they `may_stay`.
    fn decide_ended(
        &mut self,
        table: &GroupTable,
        decision: &Decision,
        now: &CameraTravel,
        may_stay: bool,
    ) -> bool {
        self.groups_decided = 0;
        let mut has_changed = false;
        for (element, words) in self.own.chunks_mut(LANES).enumerate() {
            let first = element * LANES;
            let asked = self.chunk_validity.ended(first, now);
            if asked == 0 {
                continue;
            }
            // What the words say so far, and with nothing decided.
            let mut before = [0; LANES];
            before[..words.len()].copy_from_slice(words);
            for word in set_bits_of(asked) {
                words[word] = table.terminal[first + word];
            }
            // What they say now, and whether that stays so.
            let valid = decision.decide_words(table, element, &self.refined, words, asked);
            has_changed |= before[..words.len()] != *words;
            let valid = if may_stay { valid } else { 0 };
            self.chunk_validity.put(first, asked, valid, now);
            let groups = |word| table.groups_in_word(first + word);
            self.groups_decided += set_bits_of(asked).map(groups).sum::<usize>();
        }
        has_changed
    }

    /// Closes the bits anew. Whether that changes the cut.
    fn close(&mut self, table: &GroupTable) -> bool {
        std::mem::swap(&mut self.refined, &mut self.refined_before);
        self.refined.clone_from(&self.own);
        table.close_refinement(&mut self.refined);
        self.refined != self.refined_before
    }

    /// Thresholds depend on what was refined. A group that becomes what it asks for stays so: its error counts for
    /// no less where it is refined, and against no higher threshold. The answers for others end.
    fn end_changed(&mut self) {
        let words = self.refined.iter().zip(&self.refined_before).zip(&self.own);
        for (word, ((now, before), own)) in words.enumerate() {
            if (now ^ before) & (now ^ own) != 0 {
                self.chunk_validity.end(word);
            }
        }
    }

    /// Begins with what is visible of an instance; `None` where nothing counts as hidden.
    pub(super) fn begin_shares(&mut self, instance: u32, words: usize, seen: Option<SeenShares>) {
        self.instance = Some(instance);
        match seen {
            Some(seen) => self.shares.begin(words, &seen),
            None => self.shares.clear(),
        }
    }

    /// Whether nothing is refined but what always is.
    pub(super) fn is_coarsest(&self, table: &GroupTable) -> bool {
        self.refined == table.coarsest_refined
    }

    /// Takes notice of what is visible now. Whether the cut has to be decided again.
    pub(super) fn update_shares(&mut self, seen: Option<SeenShares>, hold_frames: u8) -> bool {
        let was_empty = self.shares.is_empty();
        let Some(seen) = seen else {
            self.shares.clear();
            return !was_empty;
        };
        if was_empty {
            self.shares.begin(self.refined.len(), &seen);
            return true;
        }
        let mut has_changed = false;
        let (validity, refined) = (&mut self.chunk_validity, &self.refined);
        self.shares.update(&seen, refined, hold_frames, |word| {
            validity.end(word);
            has_changed = true;
        });
        has_changed
    }

    /// What is remembered of what is visible.
    pub(super) fn shares(&self) -> &ShareMemory {
        &self.shares
    }

    pub(super) fn instance(&self) -> Option<u32> {
        self.instance
    }

    /// Nothing has this cut any more.
    pub(super) fn release(&mut self) {
        self.instance = None;
    }

    fn gather(&mut self, table: &GroupTable) {
        std::mem::swap(&mut self.units, &mut self.units_before);
        self.triangles_before = self.triangle_count;
        self.units.clear();
        self.available_revision = table.available_revision;
        let refined = match &table.available {
            None => &self.refined,
            Some(available) => {
                let pairs = self.refined.iter().zip(available);
                self.drawn.clear();
                self.drawn
                    .extend(pairs.map(|(refined, at_hand)| refined & at_hand));
                &self.drawn
            }
        };
        self.triangle_count = table.gather_units(refined, &mut self.units);
    }

    /// Gathers the units anew, if others are at hand than when that was last done. Whether it was.
    pub(super) fn update_available(&mut self, table: &GroupTable) -> bool {
        let is_due = self.available_revision != table.available_revision;
        if is_due {
            self.gather(table);
        }
        is_due
    }

    /// What its storage could hold without growing.
    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        self.own.capacity()
            + self.chunk_validity.capacity()
            + self.shares.capacity()
            + self.refined.capacity()
            + self.refined_before.capacity()
            + self.drawn.capacity()
            + self.units.capacity()
            + self.units_before.capacity()
    }

    pub(super) fn class(&self) -> u32 {
        self.class
    }

    pub(super) fn refined(&self) -> &[u64] {
        &self.refined
    }

    /// The units drawn and their triangles.
    pub(super) fn drawn(&self) -> (&[u32], u64) {
        (&self.units, self.triangle_count)
    }

    /// What was drawn before.
    pub(super) fn drawn_before(&self) -> (&[u32], u64) {
        (&self.units_before, self.triangles_before)
    }

    pub(super) fn groups_decided(&self) -> usize {
        self.groups_decided
    }

    /// For how long the cut is valid.
    pub(super) fn validity(&self) -> Validity {
        self.validity
    }

    pub(super) fn has_changed(&self) -> bool {
        self.has_changed
    }
}
