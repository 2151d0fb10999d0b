//! Ranges and references stay within their arrays.

use super::InvalidHierarchy as E;
use crate::hierarchy::{Group, Hierarchy, Unit};

impl Hierarchy {
    pub(super) fn check_ranges(&self) -> Result<(), E> {
        let (groups, units) = (&self.groups, &self.units);
        let (finer, lists) = (self.finer.len(), self.unit_vertices.len());
        let range = |group: &Group| (group.first_unit, group.unit_count);
        check_tiling("units", "group", groups, range, units.len())?;
        let range = |group: &Group| (group.first_finer, group.finer_count);
        check_tiling("finer groups", "group", groups, range, finer)?;
        let range = |unit: &Unit| (unit.first_vertex, unit.vertex_count);
        check_tiling("vertices", "unit", units, range, lists)?;
        if !self.indices.len().is_multiple_of(3) {
            return Err(broken_range("triangles", "unit", units.len()));
        }
        let triangles = self.indices.len() / 3;
        let range = |unit: &Unit| (unit.first_triangle, unit.triangle_count);
        check_tiling("triangles", "unit", units, range, triangles)
    }

    pub(super) fn check_references(&self) -> Result<(), E> {
        let (groups, vertices) = (self.groups.len(), self.vertices.positions.len());
        for (index, unit) in self.units.iter().enumerate() {
            let groups_named = [Some(unit.consumed_by), unit.producer()]
                .into_iter()
                .flatten();
            let named = groups_named.map(|group| group as usize);
            check_targets("unit", index, "group", named, groups)?;
            let used = self.vertices_of(unit).iter().map(|&vertex| vertex as usize);
            // Source geometry uses none that a simplification made.
            let (what, end) = match unit.producer() {
                Some(_) => ("vertex", vertices),
                None => ("source vertex", self.source_vertex_count as usize),
            };
            check_targets("unit", index, what, used, end)?;
            let corners = self
                .indices_of(unit)
                .iter()
                .map(|&corner| usize::from(corner));
            check_targets("unit", index, "vertex", corners, unit.vertex_count as usize)?;
        }
        for (index, &group) in self.finer.iter().enumerate() {
            check_targets(
                "finer link",
                index,
                "group",
                [group as usize].into_iter(),
                groups,
            )?;
        }
        for (index, &vertex) in self.moved_from.iter().enumerate() {
            let sources = self.source_vertex_count as usize;
            let named = [vertex as usize].into_iter();
            check_targets("moved vertex", index, "source vertex", named, sources)?;
        }
        Ok(())
    }
}

/// Checks that what `owner` refers to comes before `end`.
fn check_targets(
    owner: &'static str,
    index: usize,
    what: &'static str,
    mut targets: impl Iterator<Item = usize>,
    end: usize,
) -> Result<(), E> {
    match targets.find(|&target| target >= end) {
        Some(target) => Err(E::DanglingReference {
            owner,
            index,
            what,
            target,
        }),
        None => Ok(()),
    }
}

/// Checks that the ranges of all owners, first and count, follow each other up to `end`.
fn check_tiling<T>(
    what: &'static str,
    owner: &'static str,
    owners: &[T],
    range: impl Fn(&T) -> (u32, u32),
    end: usize,
) -> Result<(), E> {
    let mut next = 0u64;
    for (index, (first, count)) in owners.iter().map(range).enumerate() {
        if u64::from(first) != next {
            return Err(broken_range(what, owner, index));
        }
        next += u64::from(count);
    }
    if next == end as u64 {
        return Ok(());
    }
    Err(broken_range(what, owner, owners.len().saturating_sub(1)))
}

fn broken_range(what: &'static str, owner: &'static str, index: usize) -> E {
    E::BrokenRange { what, owner, index }
}
