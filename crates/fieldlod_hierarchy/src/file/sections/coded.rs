//! A hierarchy in the order in which it is coded: coarsest level first, vertices in the order of
//! their first use.

use crate::file::vertices::rows::{Prediction, Rows};
use crate::hierarchy::{Group, Unit};

/// Bytes of memory that one byte of a section may stand for, so that a small file claims little.
pub(in crate::file) const MAX_PER_BYTE: u64 = 64;
/// What a group claims: itself and its index.
pub(in crate::file) const GROUP_BYTES: usize = size_of::<Group>() + 4;
/// What a triangle claims: three indices and the symbol of an edge.
pub(in crate::file) const TRIANGLE_BYTES: usize = 3 * 2 + 4;

/// The arrays of a hierarchy, in the order of its sections. Where ranges start is not kept, and
/// units of a section follow each other like its groups.
#[derive(Debug, Default)]
pub(in crate::file) struct Coded {
    /// Where each group stands in the hierarchy.
    pub(in crate::file) group_indices: Vec<u32>,
    pub(in crate::file) groups: Vec<Group>,
    pub(in crate::file) finer: Vec<u32>,
    pub(in crate::file) units: Vec<Unit>,
    /// By the order in which vertices are coded.
    pub(in crate::file) unit_vertices: Vec<u32>,
    pub(in crate::file) indices: Vec<u16>,
    /// Vertices before this one in the hierarchy are the source's.
    pub(in crate::file) source_vertex_count: u32,
    /// Whether these have no numbers of their own. They are then as predicted, which is enough to
    /// predict others from.
    pub(in crate::file) beside_source: bool,
    /// Whether vertices stand in the hierarchy in the order in which they are coded, as those of a page
    /// do: nothing is stored of where they stand.
    pub(in crate::file) is_page: bool,
    /// Where each vertex stands in the hierarchy.
    pub(in crate::file) vertex_indices: Vec<u32>,
    /// The source vertices that moved ones came from, in the order of the hierarchy.
    pub(in crate::file) moved_from: Vec<u32>,
    /// Of the vertices in the order in which they are coded, after one of zeros.
    pub(in crate::file) rows: Rows,
}

impl Coded {
    /// Nothing yet, with so many numbers for each vertex to come.
    pub(in crate::file) fn new(
        planes: usize,
        source_vertex_count: u32,
        beside_source: bool,
    ) -> Self {
        Self {
            source_vertex_count,
            beside_source,
            rows: Rows::zeros(planes, 1),
            ..Self::default()
        }
    }

    /// Groups and where they stand in the hierarchy, from the `first` on.
    pub(in crate::file) fn groups_since(
        &self,
        first: usize,
    ) -> impl Iterator<Item = (&Group, u32)> {
        let groups = self.groups[first..].iter();
        groups.zip(self.group_indices[first..].iter().copied())
    }

    /// Which of the targets of `predictions` have numbers.
    pub(in crate::file) fn are_stored(&self, predictions: &[Prediction]) -> Vec<bool> {
        let indices = predictions
            .iter()
            .map(|p| self.vertex_indices[p.target as usize - 1]);
        let is_stored = |index| !self.beside_source || index >= self.source_vertex_count;
        indices.map(is_stored).collect()
    }

    /// How much there is so far.
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

/// How long the arrays of a [`Coded`] are before a section is added.
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
