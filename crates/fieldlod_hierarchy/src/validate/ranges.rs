//! Checks that ranges and references stay within their arrays.

use super::InvalidHierarchy as E;
use crate::hierarchy::{Group, Hierarchy, Unit};

impl Hierarchy {
    pub(super) fn check_group_ranges(&self) -> Result<(), E> {
        let groups = &self.groups;
        let range = |group: &Group| (group.first_unit, group.unit_count);
        check_tiling("units", "group", groups, range, self.units.len())?;
        let range = |group: &Group| (group.first_finer, group.finer_count);
        check_tiling("finer groups", "group", groups, range, self.finer.len())
    }

    pub(super) fn check_unit_ranges(&self) -> Result<(), E> {
        let units = &self.units;
        let range = |unit: &Unit| (unit.first_vertex, unit.vertex_count);
        check_tiling("vertices", "unit", units, range, self.unit_vertices.len())?;
        if !self.indices.len().is_multiple_of(3) {
            return Err(broken_range("triangles", "unit", units.len()));
        }
        let triangles = self.indices.len() / 3;
        let range = |unit: &Unit| (unit.first_triangle, unit.triangle_count);
        check_tiling("triangles", "unit", units, range, triangles)
    }

    /// Checks the group indices in units and finer links.
    pub(super) fn check_group_references(&self) -> Result<(), E> {
        let groups = self.groups.len();
        for (index, unit) in self.units.iter().enumerate() {
            let named = [Some(unit.consumed_by), unit.producer()];
            let named = named.into_iter().flatten().map(|group| group as usize);
            check_targets("unit", index, "group", named, groups)?;
        }
        for (index, &group) in self.finer.iter().enumerate() {
            let named = [group as usize].into_iter();
            check_targets("finer link", index, "group", named, groups)?;
        }
        Ok(())
    }

    /// Checks the vertex indices in units and `moved_from`.
    pub(super) fn check_vertex_references(&self) -> Result<(), E> {
        let vertices = self.vertices.positions.len();
        for (index, unit) in self.units.iter().enumerate() {
            let used = self.vertices_of(unit).iter().map(|&vertex| vertex as usize);
            // Source geometry uses source vertices only.
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
        for (index, &vertex) in self.moved_from.iter().enumerate() {
            let sources = self.source_vertex_count as usize;
            let named = [vertex as usize].into_iter();
            check_targets("moved vertex", index, "source vertex", named, sources)?;
        }
        Ok(())
    }
}

/// Checks that all `targets` of `owner` are below `end`.
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

/// Checks that the ranges (first, count) of all owners are consecutive and end at `end`.
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
    Err(broken_range(what, owner, owners.len()))
}

fn broken_range(what: &'static str, owner: &'static str, index: usize) -> E {
    E::BrokenRange { what, owner, index }
}
