//! The cut of one instance that is decided group by group, in storage that is used again.

use crate::hidden::held_shares::{SeenShares, ShareMemory};
use crate::lanes::bits::CHUNK;
use crate::scene::table::GroupTable;

#[derive(Debug, Default)]
pub(crate) struct InstanceCut {
    /// Bits of the groups that are refined, now and in the last frame.
    refined: Vec<u64>,
    refined_before: Vec<u64>,
    /// Of the refined groups those that are at hand, if not all are.
    drawn: Vec<u64>,
    available_revision: u32,
    units: Vec<u32>,
    units_before: Vec<u32>,
    triangle_count: u64,
    shares: ShareMemory,
    class: u32,
}

impl InstanceCut {
    /// With room for any cut of a mesh of a [size class](GroupTable::size_class).
    pub(crate) fn of_class(class: u32) -> Self {
        let units = || Vec::with_capacity(1 << class);
        let word_count = (1usize << class).div_ceil(CHUNK);
        let words = || Vec::with_capacity(word_count);
        Self {
            refined: words(),
            refined_before: words(),
            drawn: words(),
            units: units(),
            units_before: units(),
            shares: ShareMemory::with_capacity(word_count),
            class,
            ..Self::default()
        }
    }

    /// Begins with an instance that drew these units and triangles: at its coarsest or, if there is one, at a level of
    /// the mesh as a whole.
    pub(crate) fn begin(
        &mut self,
        table: &GroupTable,
        level: Option<usize>,
        (units, triangle_count): (&[u32], u64),
    ) {
        match level {
            Some(level) => {
                self.refined.clear();
                self.refined.push(table.refined_at_level(level));
            }
            None => self.refined.clone_from(&table.coarsest_refined),
        }
        self.units.clear();
        self.units.extend_from_slice(units);
        self.triangle_count = triangle_count;
        self.shares.clear();
        // The first decision gathers units, whatever it decides.
        self.available_revision = table.available_revision.wrapping_sub(1);
    }

    /// Decides the next cut of the same instance. Whether other units are drawn.
    pub(crate) fn decide(
        &mut self,
        table: &GroupTable,
        decision: impl FnOnce(&ShareMemory, &[u64], &mut Vec<u64>),
    ) -> bool {
        std::mem::swap(&mut self.refined, &mut self.refined_before);
        decision(&self.shares, &self.refined_before, &mut self.refined);
        table.close_refinement(&mut self.refined);
        let is_same = self.refined == self.refined_before
            && self.available_revision == table.available_revision;
        if !is_same {
            self.gather(table);
        }
        !is_same
    }

    fn gather(&mut self, table: &GroupTable) {
        std::mem::swap(&mut self.units, &mut self.units_before);
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

    /// Goes on to what a frame sees of the instance; `None` if nothing counts as hidden.
    pub(crate) fn update_shares(&mut self, seen: Option<SeenShares>, hold_frames: u8) {
        match seen {
            None => self.shares.clear(),
            Some(seen) if self.shares.is_empty() => self.shares.begin(self.refined.len(), &seen),
            Some(seen) => self.shares.update(&seen, &self.refined, hold_frames),
        }
    }

    /// Whether nothing is refined but what always is.
    pub(crate) fn is_coarsest(&self, table: &GroupTable) -> bool {
        self.refined == table.coarsest_refined
    }

    /// What is remembered of what is visible.
    pub(crate) fn shares(&self) -> &ShareMemory {
        &self.shares
    }

    pub(crate) fn class(&self) -> u32 {
        self.class
    }

    pub(crate) fn refined(&self) -> &[u64] {
        &self.refined
    }

    /// The units drawn and their triangles.
    pub(crate) fn drawn(&self) -> (&[u32], u64) {
        (&self.units, self.triangle_count)
    }

    /// The units drawn before the last decision that drew others.
    pub(crate) fn drawn_before(&self) -> &[u32] {
        &self.units_before
    }

    /// What its storage could hold without growing.
    #[cfg(test)]
    pub(crate) fn capacity(&self) -> usize {
        self.refined.capacity()
            + self.shares.capacity()
            + self.refined_before.capacity()
            + self.drawn.capacity()
            + self.units.capacity()
            + self.units_before.capacity()
    }
}
