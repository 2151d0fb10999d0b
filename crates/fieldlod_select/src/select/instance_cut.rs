//! The cut of one instance. Selection decides it group by group, and reuses its storage.

use crate::scene::InstanceId;
use crate::scene::table::GroupTable;

#[derive(Debug, Default)]
pub(crate) struct InstanceCut {
    /// Bits of groups whose own errors exceed their thresholds, in this decision and in the previous one.
    own: Vec<u64>,
    own_before: Vec<u64>,
    /// The groups of `own`, and all groups that must be refined with them.
    pub(super) refined: Vec<u64>,
    refined_before: Vec<u64>,
    /// The refined groups that are available. Used only if some groups are not available.
    drawn: Vec<u64>,
    available_revision: u32,
    units: Vec<u32>,
    /// The units that were drawn before the drawn units last changed.
    pub(super) units_before: Vec<u32>,
    triangle_count: u64,
    /// The weight of the instance in the last decision.
    pub(super) weight: f32,
}

impl InstanceCut {
    /// Starts from the units and triangles that are drawn: the units of `level`, or of the coarsest level.
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
            None => self.refined.clone_from(&table.terminal),
        }
        self.units.clear();
        self.units.extend_from_slice(units);
        self.triangle_count = triangle_count;
        // The first decision always gathers units.
        self.available_revision = table.available_revision.wrapping_sub(1);
    }

    /// Decides the next cut of the same instance. Returns `false` if the drawn units stay the same.
    pub(crate) fn decide(
        &mut self,
        table: &GroupTable,
        decision: impl FnOnce(&[u64], &mut Vec<u64>),
    ) -> bool {
        std::mem::swap(&mut self.own, &mut self.own_before);
        decision(&self.refined, &mut self.own);
        let are_units_known = self.available_revision == table.available_revision;
        // Most decisions equal those of the last frame: closing them again would give the same cut.
        if self.own == self.own_before && are_units_known {
            return false;
        }
        std::mem::swap(&mut self.refined, &mut self.refined_before);
        self.refined.clone_from(&self.own);
        table.close_refinement(&mut self.refined);
        let has_changed = self.refined != self.refined_before || !are_units_known;
        if has_changed {
            self.gather(table);
        }
        has_changed
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
                    .extend(pairs.map(|(refined, available)| refined & available));
                &self.drawn
            }
        };
        self.triangle_count = table.gather_units(refined, &mut self.units);
    }

    /// The units drawn and their triangles.
    pub(crate) fn drawn(&self) -> (&[u32], u64) {
        (&self.units, self.triangle_count)
    }
}

/// Cuts by key, and the free keys.
#[derive(Debug, Default)]
pub(crate) struct Pool {
    cuts: Vec<InstanceCut>,
    /// The last owner of each cut.
    owners: Vec<InstanceId>,
    /// Other cuts reuse their storage.
    pub(super) free: Vec<u32>,
}

impl Pool {
    /// Returns a free key for an instance. The caller must [begin](InstanceCut::begin) its cut.
    pub(crate) fn make(&mut self, owner: InstanceId) -> u32 {
        if let Some(key) = self.free.pop() {
            self.owners[key as usize] = owner;
            return key;
        }
        self.cuts.push(InstanceCut::default());
        self.owners.push(owner);
        self.cuts.len() as u32 - 1
    }

    /// The keys of all cuts, free keys included, with their last owners.
    pub(crate) fn owners(&self) -> impl Iterator<Item = (u32, InstanceId)> {
        (0..).zip(self.owners.iter().copied())
    }

    pub(crate) fn at(&self, key: u32) -> &InstanceCut {
        &self.cuts[key as usize]
    }

    pub(crate) fn at_mut(&mut self, key: u32) -> &mut InstanceCut {
        &mut self.cuts[key as usize]
    }
}
