//! Applies the cut rule of [`Hierarchy`].

use crate::Hierarchy;

impl Hierarchy {
    /// Refines the groups for which `criterion` returns `true`, and further groups by the
    /// [cut rule](Self#the-cut-rule).
    ///
    /// `refined` has one entry per group. `criterion` gets the index of a group and its old entry. It is
    /// not called for groups that the rule refines.
    ///
    /// # Panics
    /// If `refined` has fewer entries than there are groups.
    pub fn refine_by(&self, refined: &mut [bool], mut criterion: impl FnMut(usize, bool) -> bool) {
        for (index, group) in self.groups.iter().enumerate() {
            // One pass is enough, because finer groups come first.
            let mut finer = self.finer_groups(group).iter();
            refined[index] = group.is_terminal()
                || finer.any(|&finer| refined[finer as usize])
                || criterion(index, refined[index]);
        }
    }

    /// Refines further groups by the [cut rule](Self#the-cut-rule): terminal groups, and groups with a
    /// refined finer group.
    ///
    /// # Panics
    /// If `refined` has fewer entries than there are groups.
    pub fn close_refinement(&self, refined: &mut [bool]) {
        self.refine_by(refined, |_, is_refined| is_refined);
    }

    /// The units of the cut at `level`. It contains finer units only where no unit has this level.
    pub fn units_at_level(&self, level: u32) -> Vec<usize> {
        let mut refined: Vec<bool> = self.groups.iter().map(|g| g.level >= level).collect();
        self.close_refinement(&mut refined);
        self.drawn_units(&refined).collect()
    }

    /// The units that the [cut rule](Self#the-cut-rule) draws for these `refined` groups, as indices into
    /// [`Hierarchy::units`], ascending.
    ///
    /// Missing entries of `refined` count as `false`.
    pub fn drawn_units(&self, refined: &[bool]) -> impl Iterator<Item = usize> {
        // Condition 1: the consumer is refined.
        let consumers = self
            .groups
            .iter()
            .zip(refined)
            .filter(|(_, refined)| **refined);
        let consumed = consumers.flat_map(|(group, _)| group.units());
        // Condition 2: the producer is not refined.
        consumed.filter(move |&unit| {
            let producer = self.units[unit].producer();
            producer.is_none_or(|producer| !refined[producer as usize])
        })
    }
}
