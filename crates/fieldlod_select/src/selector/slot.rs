//! The cut of one instance that is decided group by group, in storage that is used again.

use super::memory::Moment;
use super::word_holds::WordHolds;
use crate::decide::Decision;
use crate::hold::{Hold, Odometer};
use crate::table::{CHUNK, GroupTable, LANES, set_bits_of};
use crate::{InstanceView, scene::Instance};

#[derive(Debug, Default)]
pub(super) struct Slot {
    /// Bits of groups whose own errors exceed their thresholds.
    own: Vec<u64>,
    /// The closure of those, now and in the last frame.
    refined: Vec<u64>,
    refined_before: Vec<u64>,
    units: Vec<u32>,
    units_before: Vec<u32>,
    triangle_count: u64,
    triangles_before: u64,
    groups_decided: usize,
    has_changed: bool,
    holds: WordHolds,
    hold: Hold,
    class: u32,
}

impl Slot {
    /// With room for any cut of a mesh of a [size class](GroupTable::size_class).
    pub(super) fn of_class(class: u32) -> Self {
        let units = || Vec::with_capacity(1 << class);
        let word_count = (1usize << class).div_ceil(CHUNK);
        let words = || Vec::with_capacity(word_count);
        Self {
            own: words(),
            refined: words(),
            refined_before: words(),
            units: units(),
            units_before: units(),
            holds: WordHolds::with_capacity(word_count),
            class,
            ..Self::default()
        }
    }

    pub(super) fn class(&self) -> u32 {
        self.class
    }

    /// Decides the first cut of an instance that was at its coarsest, or not there.
    pub(super) fn decide(&mut self, table: &GroupTable, instance: &Instance, moment: &Moment) {
        // Every group that was refined is so whatever its error.
        self.refined.clone_from(&table.coarsest_refined);
        self.holds.forget();
        let view = InstanceView::new(moment.view, &instance.world_from_local);
        let thresholds = moment.settings.thresholds(instance.bias);
        let decision = Decision::new(table, &view, moment.parts, moment.settings, thresholds, 0.0);
        decision.decide(table, &self.refined, &mut self.own);
        self.groups_decided = table.group_count();
        self.hold = Hold::NONE;
        self.renew(table);
        self.has_changed = true;
        self.gather(table);
    }

    /// Decides the next cut of the same instance: the words whose answers do not hold any more. None does
    /// if the instance `has_moved`.
    pub(super) fn decide_again(
        &mut self,
        table: &GroupTable,
        instance: &Instance,
        moment: &Moment,
        has_moved: bool,
    ) {
        let Moment {
            view,
            parts,
            settings,
            test,
            now,
            step,
        } = *moment;
        if has_moved {
            self.holds.forget();
        }
        let farthest = test.farthest(&instance.node.whole.bounds);
        self.holds.begin(self.own.len(), farthest, &now, &step);
        let way = if test.is_usable() {
            self.holds.way()
        } else {
            0.0
        };
        let instance_view = InstanceView::new(view, &instance.world_from_local);
        let thresholds = settings.thresholds(instance.bias);
        let decision = Decision::new(table, &instance_view, parts, settings, thresholds, way);
        self.has_changed =
            self.decide_ended(table, &decision, &now, way > 0.0) && self.renew(table);
        if self.has_changed {
            self.end_changed();
            self.gather(table);
        }
        self.hold = self.holds.finish(&now);
    }

    /// Whether any bit of those words has changed. The answers hold from now on only if they `may_hold`.
    fn decide_ended(
        &mut self,
        table: &GroupTable,
        decision: &Decision,
        now: &Odometer,
        may_hold: bool,
    ) -> bool {
        self.groups_decided = 0;
        let mut has_changed = false;
        for (element, words) in self.own.chunks_mut(LANES).enumerate() {
            let first = element * LANES;
            let asked = self.holds.ended(first, now);
            if asked == 0 {
                continue;
            }
            let mut before = [0; LANES];
            before[..words.len()].copy_from_slice(words);
            for word in set_bits_of(asked) {
                words[word] = table.terminal[first + word];
            }
            let held = decision.decide_words(table, element, &self.refined, words, asked);
            has_changed |= before[..words.len()] != *words;
            let held = if may_hold { held } else { 0 };
            self.holds.put(first, asked, held, now);
            let groups = |word| table.groups_in_word(first + word);
            self.groups_decided += set_bits_of(asked).map(groups).sum::<usize>();
        }
        has_changed
    }

    /// Closes the bits anew. Whether that changes the cut.
    fn renew(&mut self, table: &GroupTable) -> bool {
        std::mem::swap(&mut self.refined, &mut self.refined_before);
        self.refined.clone_from(&self.own);
        table.close(&mut self.refined);
        self.refined != self.refined_before
    }

    /// Thresholds depend on what was refined: where that has changed, nothing holds.
    fn end_changed(&mut self) {
        let words = self.refined.iter().zip(&self.refined_before).enumerate();
        for (word, (now, before)) in words {
            if now != before {
                self.holds.end(word);
            }
        }
    }

    fn gather(&mut self, table: &GroupTable) {
        std::mem::swap(&mut self.units, &mut self.units_before);
        self.triangles_before = self.triangle_count;
        self.units.clear();
        self.triangle_count = table.gather_units(&self.refined, &mut self.units);
    }

    /// What its storage could hold without growing.
    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        self.own.capacity()
            + self.holds.capacity()
            + self.refined.capacity()
            + self.refined_before.capacity()
            + self.units.capacity()
            + self.units_before.capacity()
    }

    pub(super) fn refined(&self) -> &[u64] {
        &self.refined
    }

    pub(super) fn units(&self) -> &[u32] {
        &self.units
    }

    pub(super) fn units_before(&self) -> &[u32] {
        &self.units_before
    }

    pub(super) fn triangle_count(&self) -> u64 {
        self.triangle_count
    }

    pub(super) fn triangles_before(&self) -> u64 {
        self.triangles_before
    }

    pub(super) fn groups_decided(&self) -> usize {
        self.groups_decided
    }

    /// For how long the cut holds.
    pub(super) fn hold(&self) -> Hold {
        self.hold
    }

    pub(super) fn has_changed(&self) -> bool {
        self.has_changed
    }
}
