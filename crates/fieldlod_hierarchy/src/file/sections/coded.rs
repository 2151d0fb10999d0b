//! A hierarchy in coding order: coarsest level first, vertices in the order of their first use.

use crate::file::vertices::attribute_columns::Columns;
use crate::hierarchy::{Group, Hierarchy, Unit};

/// Largest number of bytes that one byte of a section may decode to. A small malformed file cannot
/// allocate much memory. A smaller number pads more of the sections that compress well; a larger one
/// lets malformed files allocate more.
pub(crate) const MAX_PER_BYTE: u64 = 64;
/// Memory of a group and its index.
pub(crate) const GROUP_BYTES: usize = size_of::<Group>() + 4;
/// Memory of a triangle: three indices, and the numbers that they are decoded from.
pub(crate) const TRIANGLE_BYTES: usize = 3 * 2 + 3 * 4;

/// The arrays of a hierarchy in coding order. Ranges are consecutive, so their starts are not stored.
#[derive(Debug, Default)]
pub(crate) struct Coded {
    /// The index of each group in the hierarchy.
    pub(crate) group_indices: Vec<u32>,
    pub(crate) groups: Vec<Group>,
    pub(crate) finer: Vec<u32>,
    pub(crate) units: Vec<Unit>,
    /// Vertices as indices in coding order.
    pub(crate) unit_vertices: Vec<u32>,
    pub(crate) indices: Vec<u16>,
    /// The hierarchy is a page: its vertices are in coding order, so their indices are not stored.
    pub(crate) is_page: bool,
    /// The index of each vertex in the hierarchy.
    pub(crate) vertex_indices: Vec<u32>,
    /// The source vertex of each moved vertex, in the order of the hierarchy.
    pub(crate) moved_from: Vec<u32>,
    /// Attributes of the vertices in coding order.
    pub(crate) columns: Columns,
}

impl Coded {
    /// Creates an empty hierarchy whose vertices have `columns` numbers.
    pub(crate) fn new(columns: usize) -> Self {
        Self {
            columns: Columns::new(columns),
            ..Self::default()
        }
    }

    /// Adds a group with its units and links, but without their geometry.
    pub(crate) fn push_group(&mut self, hierarchy: &Hierarchy, index: u32) {
        let group = &hierarchy.groups[index as usize];
        self.group_indices.push(index);
        self.groups.push(Group {
            first_finer: 0,
            first_unit: 0,
            ..*group
        });
        self.finer.extend(hierarchy.finer_groups(group));
        let units = hierarchy.units[group.units()].iter();
        self.units.extend(units.map(|unit| Unit {
            consumed_by: 0,
            produced_by: unit.producer().map_or(0, |producer| index - producer),
            first_vertex: 0,
            first_triangle: 0,
            ..*unit
        }));
    }

    /// Restores the starts of the ranges of groups and units.
    pub(crate) fn restore_starts(&mut self) {
        // Sums wrap: a table of contents has counts of vertices and triangles, but its vertices and triangles are
        // not read with it. A malformed table must not panic.
        let (mut first_finer, mut first_unit) = (0u32, 0u32);
        for group in &mut self.groups {
            (group.first_finer, group.first_unit) = (first_finer, first_unit);
            first_finer = first_finer.wrapping_add(group.finer_count);
            first_unit = first_unit.wrapping_add(group.unit_count);
        }
        let (mut first_vertex, mut first_triangle) = (0u32, 0u32);
        for unit in &mut self.units {
            (unit.first_vertex, unit.first_triangle) = (first_vertex, first_triangle);
            first_vertex = first_vertex.wrapping_add(unit.vertex_count);
            first_triangle = first_triangle.wrapping_add(unit.triangle_count);
        }
    }

    /// Groups and their indices in the hierarchy, starting with the group `first`.
    pub(crate) fn groups_since(&self, first: usize) -> impl Iterator<Item = (&Group, u32)> {
        let groups = self.groups[first..].iter();
        groups.zip(self.group_indices[first..].iter().copied())
    }

    /// Current lengths of the arrays.
    pub(crate) fn ends(&self) -> Ends {
        Ends {
            groups: self.groups.len(),
            finer: self.finer.len(),
            units: self.units.len(),
            unit_vertices: self.unit_vertices.len(),
            indices: self.indices.len(),
            vertices: self.vertex_indices.len(),
            moved_from: self.moved_from.len(),
        }
    }
}

/// Lengths of the arrays of a [`Coded`] at the start of a section.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ends {
    pub(crate) groups: usize,
    pub(crate) finer: usize,
    pub(crate) units: usize,
    pub(crate) unit_vertices: usize,
    pub(crate) indices: usize,
    pub(crate) vertices: usize,
    pub(crate) moved_from: usize,
}
