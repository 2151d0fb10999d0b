//! A hierarchy laid out for selection: structures of arrays, eight groups to a register.

mod bounds;

use fieldlod_hierarchy::{Group, Hierarchy};
use wide::f32x8;

use crate::criterion::{SILHOUETTE_WEIGHT, VISIBLE_WEIGHT, normal_variance};
use crate::hold::Whole;
pub(crate) use bounds::{Bounds, Facings};
use bounds::{around, of_one};

/// Groups in a register.
pub(crate) const LANES: usize = 8;
/// Groups in a chunk: the bits of one word.
pub(crate) const CHUNK: usize = 64;

/// What selection reads of a [`Hierarchy`], and nothing else: it does not borrow it.
///
/// Tests ask for 64 groups at once first, then for eight, then for each.
#[derive(Clone, Debug)]
pub struct GroupTable {
    pub(crate) group_count: usize,
    /// Groups, eight to an element.
    pub(crate) groups: Bounds,
    /// Elements of `groups`, eight to an element: one for each word of bits.
    pub(crate) blocks: Bounds,
    /// Elements of `blocks`, eight to an element.
    pub(crate) chunks: Bounds,
    pub(crate) facings: Facings,
    pub(crate) block_facings: Facings,
    pub(crate) normal_length: Vec<f32x8>,
    pub(crate) normal_variance: Vec<f32x8>,
    /// One bit for each group, set if it is terminal.
    pub(crate) terminal: Vec<u64>,
    pub(crate) whole: Whole,
    /// Groups that consume what a group produces, group by group.
    coarser: Vec<u32>,
    first_coarser: Vec<u32>,
    first_unit: Vec<u32>,
    units: Vec<TableUnit>,
    /// The cut in which terminal groups alone are refined.
    pub(crate) coarsest_units: Vec<u32>,
    pub(crate) coarsest_refined: Vec<u64>,
    pub(crate) coarsest_triangle_count: u64,
}

#[derive(Clone, Copy, Debug)]
struct TableUnit {
    produced_by: u32,
    triangle_count: u32,
}

impl GroupTable {
    /// Lays out a hierarchy, which must be [valid](Hierarchy::validate).
    #[must_use]
    pub fn new(hierarchy: &Hierarchy) -> Self {
        let groups = &hierarchy.groups;
        let lanes = |value: &dyn Fn(&Group) -> f32| -> Vec<f32x8> {
            let padded = groups.len().next_multiple_of(CHUNK);
            let at = |index: usize| groups.get(index).map_or(0.0, value);
            (0..padded / LANES)
                .map(|block| f32x8::from(std::array::from_fn(|lane| at(block * LANES + lane))))
                .collect()
        };
        let (first_coarser, coarser) = coarser_links(hierarchy);
        let words = groups.len().div_ceil(CHUNK);
        let table = Self {
            group_count: groups.len(),
            groups: Bounds::new(groups.iter().map(of_one), words * LANES),
            blocks: Bounds::new(groups.chunks(LANES).map(around), words),
            chunks: Bounds::new(groups.chunks(CHUNK).map(around), words.div_ceil(LANES)),
            facings: Facings::new(groups, 1, words * LANES),
            block_facings: Facings::new(groups, LANES, words),
            normal_length: lanes(&|g| g.mean_normal.length()),
            normal_variance: lanes(&|g| normal_variance(g.mean_normal)),
            terminal: groups.chunks(CHUNK).map(terminal_bits).collect(),
            whole: around(groups),
            coarser,
            first_coarser,
            first_unit: groups.iter().map(|g| g.first_unit).collect(),
            units: table_units(hierarchy),
            coarsest_units: Vec::new(),
            coarsest_refined: Vec::new(),
            coarsest_triangle_count: 0,
        };
        table.with_coarsest()
    }

    fn with_coarsest(mut self) -> Self {
        let mut refined = self.terminal.clone();
        self.close(&mut refined);
        let mut units = Vec::new();
        self.coarsest_triangle_count = self.gather_units(&refined, &mut units);
        self.coarsest_units = units;
        self.coarsest_refined = refined;
        self
    }

    /// Frees all but what tells the coarsest cut.
    pub(crate) fn retain_coarsest(&mut self) {
        let coarsest = Self {
            coarsest_units: std::mem::take(&mut self.coarsest_units),
            coarsest_triangle_count: self.coarsest_triangle_count,
            ..Self::new(&Hierarchy::default())
        };
        *self = coarsest;
    }

    /// How many groups.
    #[must_use]
    pub fn group_count(&self) -> usize {
        self.group_count
    }

    /// The groups that a word of bits stands for.
    pub(crate) fn groups_in_word(&self, word: usize) -> usize {
        self.group_count.saturating_sub(word * CHUNK).min(CHUNK)
    }

    /// At least as many as any cut has units, and as there are groups; of meshes of about the same
    /// size the same.
    pub(crate) fn size_class(&self) -> u32 {
        self.units
            .len()
            .max(self.group_count)
            .next_power_of_two()
            .trailing_zeros()
    }

    /// Makes the cut valid: whatever has a refined finer group becomes refined. Finer groups come
    /// first, so one pass over the set bits does it, reading also those that it sets.
    pub(crate) fn close(&self, refined: &mut [u64]) {
        for word in 0..refined.len() {
            let mut done = 0u64;
            while refined[word] & !done != 0 {
                let bit = (refined[word] & !done).trailing_zeros();
                // Bits below are done: coarser groups have greater indices.
                done |= u64::MAX >> (63 - bit);
                for &coarser in self.coarser_of(word * CHUNK + bit as usize) {
                    refined[coarser as usize / CHUNK] |= 1 << (coarser as usize % CHUNK);
                }
            }
        }
    }

    /// The bits of a block's terminal groups, and of what is missing to a full block.
    #[inline]
    pub(crate) fn terminal_in(&self, block: usize) -> u32 {
        let first = block * LANES;
        let word = self.terminal.get(first / CHUNK).copied().unwrap_or(0);
        let terminal = (word >> (first % CHUNK)) as u32 & 0xff;
        let present = self.group_count.saturating_sub(first).min(LANES);
        terminal | (0xff << present) & 0xff
    }

    pub(crate) fn coarser_of(&self, group: usize) -> &[u32] {
        &self.coarser[self.first_coarser[group] as usize..self.first_coarser[group + 1] as usize]
    }

    /// The units of a valid cut, ascending, appended to `units`; returns their triangles.
    pub(crate) fn gather_units(&self, refined: &[u64], units: &mut Vec<u32>) -> u64 {
        let mut triangle_count = 0;
        for group in set_bits(refined) {
            for index in self.units_of(group) {
                let unit = self.units[index];
                if !is_set(refined, unit.produced_by) {
                    units.push(index as u32);
                    triangle_count += u64::from(unit.triangle_count);
                }
            }
        }
        triangle_count
    }

    /// Triangles of the units that `group` consumes, each with its producer, if any.
    pub(crate) fn consumed_by(&self, group: usize) -> impl Iterator<Item = (Option<u32>, u32)> {
        self.units[self.units_of(group)].iter().map(|unit| {
            let is_source = unit.produced_by == fieldlod_hierarchy::NO_GROUP;
            (
                (!is_source).then_some(unit.produced_by),
                unit.triangle_count,
            )
        })
    }

    fn units_of(&self, group: usize) -> std::ops::Range<usize> {
        let end = self
            .first_unit
            .get(group + 1)
            .map_or(self.units.len(), |&first| first as usize);
        self.first_unit[group] as usize..end
    }
}

/// The indices of the bits that are set, ascending.
pub(crate) fn set_bits(words: &[u64]) -> impl Iterator<Item = usize> + '_ {
    let in_word = |(index, &word)| set_bits_of(word).map(move |bit| index * CHUNK + bit);
    words.iter().enumerate().flat_map(in_word)
}

/// The same of one word.
#[inline]
pub(crate) fn set_bits_of(word: impl Into<u64>) -> impl Iterator<Item = usize> {
    let mut rest: u64 = word.into();
    std::iter::from_fn(move || {
        let bit = (rest != 0).then(|| rest.trailing_zeros() as usize)?;
        rest &= rest - 1;
        Some(bit)
    })
}

/// Whether a bit is set; no bit beyond the end is.
fn is_set(words: &[u64], bit: u32) -> bool {
    let word = words.get(bit as usize / CHUNK);
    word.is_some_and(|word| word >> (bit as usize % CHUNK) & 1 == 1)
}

/// Terminal groups are told by their bit; as numbers they ask for nothing.
fn of_simplified(group: &Group, value: f32) -> f32 {
    if group.is_terminal() { 0.0 } else { value }
}

fn error_weighed(group: &Group) -> f32 {
    let facing = group.mean_normal.length();
    let variance = normal_variance(group.mean_normal);
    let visible = 0.5 * VISIBLE_WEIGHT * (facing + (facing * facing + variance).sqrt());
    let weight = visible + SILHOUETTE_WEIGHT;
    of_simplified(group, group.error_in_local) * weight.sqrt()
}

fn terminal_bits(groups: &[Group]) -> u64 {
    let bit = |(index, group): (usize, &Group)| u64::from(group.is_terminal()) << index;
    groups.iter().enumerate().map(bit).sum()
}

fn table_units(hierarchy: &Hierarchy) -> Vec<TableUnit> {
    let of = |unit: &fieldlod_hierarchy::Unit| TableUnit {
        produced_by: unit.produced_by,
        triangle_count: unit.triangle_count,
    };
    hierarchy.units.iter().map(of).collect()
}

/// The inverse of [`Hierarchy::finer_groups`], as one list with the start of each group's part.
fn coarser_links(hierarchy: &Hierarchy) -> (Vec<u32>, Vec<u32>) {
    let mut links: Vec<(u32, u32)> = Vec::new();
    for (index, group) in hierarchy.groups.iter().enumerate() {
        let finer = hierarchy.finer_groups(group).iter();
        links.extend(finer.map(|&finer| (finer, index as u32)));
    }
    links.sort_unstable();
    links.dedup();
    let first = |group: usize| links.partition_point(|&(finer, _)| (finer as usize) < group) as u32;
    let firsts = (0..=hierarchy.groups.len()).map(first).collect();
    (
        firsts,
        links.into_iter().map(|(_, coarser)| coarser).collect(),
    )
}
