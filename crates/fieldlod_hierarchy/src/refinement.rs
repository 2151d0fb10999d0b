//! The cut rule of [`Hierarchy`], applied: which groups are refined, and which units are drawn then.

use crate::Hierarchy;

impl Hierarchy {
    /// Refines the groups for which `criterion` holds, and all others that the
    /// [cut rule](Self#the-cut-rule) refines with them.
    ///
    /// `refined` has one entry per group. `criterion` is given the index of a group and its entry
    /// so far; it is not asked about groups that are refined in any case.
    ///
    /// # Panics
    /// If `refined` has fewer entries than there are groups.
    pub fn refine_by(&self, refined: &mut [bool], mut criterion: impl FnMut(usize, bool) -> bool) {
        for (index, group) in self.groups.iter().enumerate() {
            // Finer groups come first, so that one pass is enough.
            let mut finer = self.finer_groups(group).iter();
            refined[index] = group.is_terminal()
                || finer.any(|&finer| refined[finer as usize])
                || criterion(index, refined[index]);
        }
    }

    /// Refines what the [cut rule](Self#the-cut-rule) refines besides the groups marked in
    /// `refined`: terminal groups, and every group with a refined finer group.
    ///
    /// # Panics
    /// If `refined` has fewer entries than there are groups.
    pub fn close_refinement(&self, refined: &mut [bool]) {
        self.refine_by(refined, |_, is_refined| is_refined);
    }

    /// The units of the cut that keeps nothing finer than `level`, unless there is nothing coarser.
    pub fn units_at_level(&self, level: u32) -> Vec<usize> {
        let mut refined: Vec<bool> = self.groups.iter().map(|g| g.level >= level).collect();
        self.close_refinement(&mut refined);
        self.drawn_units(&refined).collect()
    }

    /// The units that the [cut rule](Self#the-cut-rule) draws where these groups are `refined`: as
    /// indices into [`Hierarchy::units`], ascending.
    ///
    /// # Panics
    /// While iterated, if `refined` has fewer entries than there are groups.
    pub fn drawn_units(&self, refined: &[bool]) -> impl Iterator<Item = usize> {
        // Condition 1: the consumer is refined.
        let consumers = self
            .groups
            .iter()
            .zip(refined)
            .filter(|(_, refined)| **refined);
        let consumed = consumers.flat_map(|(group, _)| group.units());
        // Condition 2: no refined producer.
        consumed.filter(move |&unit| {
            let producer = self.units[unit].producer();
            producer.is_none_or(|producer| !refined[producer as usize])
        })
    }
}
