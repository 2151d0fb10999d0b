//! A hierarchy in coding order: coarsest level first, vertices in the order of their first use.

use crate::file::vertices::rows::{Prediction, Rows};
use crate::hierarchy::{Group, Unit};

/// Largest number of bytes that one byte of a section may decode to. A small malformed file cannot
/// allocate much memory.
pub(in crate::file) const MAX_PER_BYTE: u64 = 64;
/// Memory of a group and its index.
pub(in crate::file) const GROUP_BYTES: usize = size_of::<Group>() + 4;
/// Memory of a triangle: three indices and the symbol of an edge.
pub(in crate::file) const TRIANGLE_BYTES: usize = 3 * 2 + 4;

/// The arrays of a hierarchy in coding order. Ranges are consecutive, so their starts are not stored.
#[derive(Debug, Default)]
pub(in crate::file) struct Coded {
    /// The index of each group in the hierarchy.
    pub(in crate::file) group_indices: Vec<u32>,
    pub(in crate::file) groups: Vec<Group>,
    pub(in crate::file) finer: Vec<u32>,
    pub(in crate::file) units: Vec<Unit>,
    /// Vertices as indices in coding order.
    pub(in crate::file) unit_vertices: Vec<u32>,
    pub(in crate::file) indices: Vec<u16>,
    /// Number of source vertices, which come first in the hierarchy.
    pub(in crate::file) source_vertex_count: u32,
    /// Omits the attributes of source vertices. Predictions from these vertices use their predicted
    /// attributes.
    pub(in crate::file) beside_source: bool,
    /// The hierarchy is a page: its vertices are in coding order, so their indices are not stored.
    pub(in crate::file) is_page: bool,
    /// The index of each vertex in the hierarchy.
    pub(in crate::file) vertex_indices: Vec<u32>,
    /// The source vertex of each moved vertex, in the order of the hierarchy.
    pub(in crate::file) moved_from: Vec<u32>,
    /// Rows of the vertices in coding order, after one row of zeros.
    pub(in crate::file) rows: Rows,
}

impl Coded {
    /// Creates an empty hierarchy whose vertices have rows of `columns` numbers.
    pub(in crate::file) fn new(
        columns: usize,
        source_vertex_count: u32,
        beside_source: bool,
    ) -> Self {
        Self {
            source_vertex_count,
            beside_source,
            rows: Rows::zeros(columns, 1),
            ..Self::default()
        }
    }

    /// Groups and their indices in the hierarchy, starting with the group `first`.
    pub(in crate::file) fn groups_since(
        &self,
        first: usize,
    ) -> impl Iterator<Item = (&Group, u32)> {
        let groups = self.groups[first..].iter();
        groups.zip(self.group_indices[first..].iter().copied())
    }

    /// For each target of `predictions`, whether its attributes are stored.
    pub(in crate::file) fn are_stored(&self, predictions: &[Prediction]) -> Vec<bool> {
        let indices = predictions
            .iter()
            .map(|p| self.vertex_indices[p.target as usize - 1]);
        let is_stored = |index| !self.beside_source || index >= self.source_vertex_count;
        indices.map(is_stored).collect()
    }

    /// Current lengths of the arrays.
    pub(in crate::file) fn ends(&self) -> Ends {
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
pub(in crate::file) struct Ends {
    pub(in crate::file) groups: usize,
    pub(in crate::file) finer: usize,
    pub(in crate::file) units: usize,
    pub(in crate::file) unit_vertices: usize,
    pub(in crate::file) indices: usize,
    pub(in crate::file) vertices: usize,
    pub(in crate::file) moved_from: usize,
}
