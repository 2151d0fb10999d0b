//! A hierarchy laid out for selection, eight groups to an element.

use std::ops::Range;

use fieldlod_hierarchy::{Group, Hierarchy};

use crate::criterion::criterion_input;
use crate::criterion::error_bounds::{EightBounds, ErrorBounds};
use crate::criterion::limits::LevelErrors;
use crate::lanes::Eight;
use crate::lanes::bits::{CHUNK, LANES, is_set, set_bits};

/// The part of a [`Hierarchy`] that selection reads; it does not borrow the hierarchy.
///
/// Selection tests bounds of 64 groups, then of eight, then each group.
#[derive(Clone, Debug)]
pub struct GroupTable {
    pub(crate) group_count: usize,
    /// Groups, eight to an element. The last elements, up to a whole word of bits, are filled with zeros.
    pub(crate) groups: Vec<Eight<9>>,
    /// Bounds of the elements of `groups`, eight to an element: one for each word of bits.
    pub(crate) blocks: Vec<EightBounds>,
    /// Bounds of the elements of `blocks`, eight to an element.
    pub(crate) chunks: Vec<EightBounds>,
    /// One bit for each group, set if it is terminal.
    pub(crate) terminal: Vec<u64>,
    /// The bounds of all groups.
    pub(crate) bounds: ErrorBounds,
    pub(crate) level_errors: LevelErrors,
    /// The level of each group.
    levels: Vec<u32>,
    /// For each group, the groups that consume its simplification.
    coarser: Vec<u32>,
    first_coarser: Vec<u32>,
    first_unit: Vec<u32>,
    /// The producer and the triangles of each unit.
    units: Vec<[u32; 2]>,
    /// The groups that may be refined; `None` if the mesh is not loaded in parts, and all groups may be refined. If a
    /// group is available, all coarser groups that consume its simplification are available. A valid cut without its
    /// unavailable groups is therefore valid.
    pub(crate) available: Option<Vec<u64>>,
    /// Counts changes of the available groups.
    pub(crate) available_revision: u32,
    /// Whether the mesh is drawn as a whole at one of its levels: each group simplifies the whole mesh.
    is_chain: bool,
    /// The coarsest cut. It refines only terminal groups.
    pub(crate) coarsest_units: Vec<u32>,
    pub(crate) coarsest_triangle_count: u64,
}

impl GroupTable {
    /// Lays out a hierarchy, which must be [valid](Hierarchy::validate).
    #[must_use]
    pub fn new(hierarchy: &Hierarchy) -> Self {
        let groups = &hierarchy.groups;
        let words = groups.len().div_ceil(CHUNK);
        let bounds =
            |groups: &[Group]| ErrorBounds::around(groups.iter().map(ErrorBounds::of_group));
        let around = |groups: &[Group]| bounds(groups).to_array();
        let (first_coarser, coarser) = coarser_links(hierarchy);
        let is_chain = groups.len() <= CHUNK && hierarchy.is_chain_of_whole_meshes();
        let units = hierarchy.units.iter();
        let units = units.map(|unit| [unit.produced_by, unit.triangle_count]);
        let mut table = Self {
            group_count: groups.len(),
            groups: Eight::list(groups.iter().map(criterion_input), words * LANES),
            blocks: Eight::list(groups.chunks(LANES).map(around), words),
            chunks: Eight::list(groups.chunks(CHUNK).map(around), words.div_ceil(LANES)),
            bounds: bounds(groups),
            level_errors: LevelErrors::new(groups, is_chain),
            levels: groups.iter().map(|group| group.level).collect(),
            terminal: groups.chunks(CHUNK).map(terminal_bits).collect(),
            coarser,
            first_coarser,
            first_unit: groups.iter().map(|group| group.first_unit).collect(),
            units: units.collect(),
            available: None,
            available_revision: 0,
            coarsest_units: Vec::new(),
            coarsest_triangle_count: 0,
            is_chain,
        };
        // Terminal groups have no simplification, so no coarser group is refined with them.
        let mut units = Vec::new();
        table.coarsest_triangle_count = table.gather_units(&table.terminal, &mut units);
        table.coarsest_units = units;
        table
    }

    /// Whether the groups and units of another table are the same, and both are loaded as a whole.
    pub(crate) fn has_same_levels(&self, other: &Self) -> bool {
        let is_whole = self.available.is_none() && other.available.is_none();
        is_whole
            && self.levels == other.levels
            && self.units == other.units
            && self.coarser == other.coarser
    }

    /// The groups that a cut at `level` refines, without the groups that must be refined with them.
    pub(crate) fn refine_from_level(&self, level: u32, refined: &mut Vec<u64>) {
        refined.clone_from(&self.terminal);
        for (group, &of_group) in self.levels.iter().enumerate() {
            refined[group / CHUNK] |= u64::from(of_group >= level) << (group % CHUNK);
        }
    }

    /// Frees everything except the units that instances may have drawn.
    pub(crate) fn retain_coarsest(&mut self) {
        *self = Self {
            coarsest_units: std::mem::take(&mut self.coarsest_units),
            coarsest_triangle_count: self.coarsest_triangle_count,
            // An instance of a chain may have been at any level.
            units: if self.is_chain {
                std::mem::take(&mut self.units)
            } else {
                Vec::new()
            },
            ..Self::new(&Hierarchy::default())
        };
    }

    /// Whether the mesh is drawn as a whole at one level and all levels are available.
    pub(crate) fn is_chain(&self) -> bool {
        self.is_chain && self.available.is_none()
    }

    /// The units of a whole mesh at a level, and their triangles.
    pub(crate) fn drawn_at_level(&self, level: usize) -> (&[u32], u64) {
        let [_, triangle_count] = self.units[level];
        (level_unit(level), u64::from(triangle_count))
    }

    /// The finest level of a chain that is not finer than `level`; the coarsest if there is none.
    pub(crate) fn chain_level(&self, level: u32) -> usize {
        let found = self.levels.iter().position(|&of_group| of_group >= level);
        found.unwrap_or(self.group_count - 1)
    }

    /// The bits of the groups that are refined when a chain is drawn at a level.
    pub(crate) fn refined_at_level(&self, level: usize) -> u64 {
        u64::MAX << level & self.present_in(0)
    }

    /// Restricts refinement to groups that `are_loaded` together with all coarser groups. Returns whether these groups
    /// have changed.
    pub(crate) fn set_available(&mut self, are_loaded: impl Fn(u32) -> bool) -> bool {
        let mut available = self.terminal.clone();
        // Coarser groups have larger indices, so one pass from the coarsest is enough.
        for group in (0..self.group_count).rev() {
            let coarser = self.coarser_of(group).iter();
            let is_reached = coarser
                .clone()
                .all(|&coarser| is_set(&available, coarser as usize));
            if is_reached && are_loaded(group as u32) {
                available[group / CHUNK] |= 1 << (group % CHUNK);
            }
        }
        let has_changed = self.available.as_ref() != Some(&available);
        if has_changed {
            self.available = Some(available);
            self.available_revision += 1;
        }
        has_changed
    }

    /// Like [`Hierarchy::close_refinement`]. The bits of all terminal groups must be set. Finer groups come first, so
    /// one pass also visits the bits that it sets.
    pub(crate) fn close_refinement(&self, refined: &mut [u64]) {
        for word in 0..refined.len() {
            let mut done = 0u64;
            while refined[word] & !done != 0 {
                let bit = (refined[word] & !done).trailing_zeros();
                // Bits below are done: coarser groups have larger indices.
                done |= u64::MAX >> (63 - bit);
                for &coarser in self.coarser_of(word * CHUNK + bit as usize) {
                    refined[coarser as usize / CHUNK] |= 1 << (coarser as usize % CHUNK);
                }
            }
        }
    }

    /// The bits of a word that belong to groups.
    pub(crate) fn present_in(&self, word: usize) -> u64 {
        let count = self.group_count.saturating_sub(word * CHUNK).min(CHUNK);
        u64::MAX.checked_shr((CHUNK - count) as u32).unwrap_or(0)
    }

    pub(crate) fn coarser_of(&self, group: usize) -> &[u32] {
        &self.coarser[self.first_coarser[group] as usize..self.first_coarser[group + 1] as usize]
    }

    /// Appends the units of a valid cut, ascending; returns the number of their triangles.
    pub(crate) fn gather_units(&self, refined: &[u64], units: &mut Vec<u32>) -> u64 {
        let mut triangle_count = 0;
        for group in set_bits(refined) {
            for index in self.units_of(group) {
                let [produced_by, unit_triangles] = self.units[index];
                // Source geometry has a producer beyond the end, whose bit is not set.
                if !is_set(refined, produced_by as usize) {
                    units.push(index as u32);
                    triangle_count += u64::from(unit_triangles);
                }
            }
        }
        triangle_count
    }

    fn units_of(&self, group: usize) -> Range<usize> {
        let end = self
            .first_unit
            .get(group + 1)
            .map_or(self.units.len(), |&first| first as usize);
        self.first_unit[group] as usize..end
    }
}

/// The unit of a level of a chain.
pub(crate) fn level_unit(level: usize) -> &'static [u32] {
    &UNITS[level..=level]
}

/// The units of a chain, one for each level.
static UNITS: [u32; CHUNK] = {
    let mut units = [0; CHUNK];
    let mut index = 0;
    while index < CHUNK {
        units[index] = index as u32;
        index += 1;
    }
    units
};

fn terminal_bits(groups: &[Group]) -> u64 {
    let bit = |(index, group): (usize, &Group)| u64::from(group.is_terminal()) << index;
    groups.iter().enumerate().map(bit).sum()
}

/// The inverse of [`Hierarchy::finer_groups`], as one list with the start of each group's part.
fn coarser_links(hierarchy: &Hierarchy) -> (Vec<u32>, Vec<u32>) {
    let mut links: Vec<(u32, u32)> = Vec::new();
    for (index, group) in hierarchy.groups.iter().enumerate() {
        let finer = hierarchy.finer_groups(group).iter();
        links.extend(finer.map(|&finer| (finer, index as u32)));
    }
    // Binary search finds the first link of each group.
    links.sort_unstable();
    links.dedup();
    let first = |group: usize| links.partition_point(|&(finer, _)| (finer as usize) < group) as u32;
    let firsts = (0..=hierarchy.groups.len()).map(first).collect();
    (
        firsts,
        links.into_iter().map(|(_, coarser)| coarser).collect(),
    )
}
