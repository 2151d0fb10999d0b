//! A hierarchy in the order in which it is coded: coarsest level first, vertices in the order of
//! their first use.

use super::rows::{Prediction, Rows};
use crate::hierarchy::{Group, Unit};

/// Bytes of memory that one byte of a section may stand for, so that a small file claims little.
pub(super) const MAX_PER_BYTE: u64 = 64;
/// What a group claims: itself and its index.
pub(super) const GROUP_BYTES: usize = size_of::<Group>() + 4;
/// What a triangle claims: three indices and the symbol of an edge.
pub(super) const TRIANGLE_BYTES: usize = 3 * 2 + 4;

/// The arrays of a hierarchy, in the order of its sections. Where ranges start is not kept, and
/// units of a section follow each other like its groups.
#[derive(Debug, Default)]
pub(super) struct Coded {
    /// Where each group stands in the hierarchy.
    pub(super) group_indices: Vec<u32>,
    pub(super) groups: Vec<Group>,
    pub(super) finer: Vec<u32>,
    pub(super) units: Vec<Unit>,
    /// By the order in which vertices are coded.
    pub(super) unit_vertices: Vec<u32>,
    pub(super) indices: Vec<u16>,
    /// Vertices before this one in the hierarchy are the source's.
    pub(super) source_vertex_count: u32,
    /// Whether these have no numbers of their own. They are then as predicted, which is enough to
    /// predict others from.
    pub(super) beside_source: bool,
    /// Whether vertices stand in the hierarchy in the order in which they are coded, as those of a page
    /// do: nothing is stored of where they stand.
    pub(super) is_page: bool,
    /// Where each vertex stands in the hierarchy.
    pub(super) vertex_indices: Vec<u32>,
    /// The source vertices that moved ones came from, in the order of the hierarchy.
    pub(super) moved_from: Vec<u32>,
    /// Of the vertices in the order in which they are coded, after one of zeros.
    pub(super) rows: Rows,
}

impl Coded {
    /// Nothing yet, with so many numbers for each vertex to come.
    pub(super) fn new(planes: usize, source_vertex_count: u32, beside_source: bool) -> Self {
        Self {
            source_vertex_count,
            beside_source,
            rows: Rows::zeros(planes, 1),
            ..Self::default()
        }
    }

    /// Groups and where they stand in the hierarchy, from the `first` on.
    pub(super) fn groups_since(&self, first: usize) -> impl Iterator<Item = (&Group, u32)> {
        let groups = self.groups[first..].iter();
        groups.zip(self.group_indices[first..].iter().copied())
    }

    /// Which of the targets of `predictions` have numbers.
    pub(super) fn are_stored(&self, predictions: &[Prediction]) -> Vec<bool> {
        let indices = predictions
            .iter()
            .map(|p| self.vertex_indices[p.target as usize - 1]);
        let is_stored = |index| !self.beside_source || index >= self.source_vertex_count;
        indices.map(is_stored).collect()
    }

    /// How much there is so far.
    pub(super) fn ends(&self) -> Ends {
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
pub(super) struct Ends {
    pub(super) groups: usize,
    pub(super) finer: usize,
    pub(super) units: usize,
    pub(super) unit_vertices: usize,
    pub(super) indices: usize,
    pub(super) vertices: usize,
    pub(super) moved_from: usize,
}
