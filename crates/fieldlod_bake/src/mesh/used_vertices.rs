//! Removes vertices that no triangle uses, during the bake.

use std::borrow::Cow;

use fieldlod_hierarchy::Hierarchy;

use super::surfaces::Surfaces;
use super::topology::Topology;
use super::{MeshError, SourceMesh};

/// Indices of the used vertices in ascending order. `None` if all of `vertex_count` are used or there are no triangles.
pub(crate) fn used_of(indices: &[u32], vertex_count: usize) -> Option<Vec<u32>> {
    let mut used = indices.to_vec();
    used.sort_unstable();
    used.dedup();
    (used.len() < vertex_count && !used.is_empty()).then_some(used)
}

/// Replaces each index by its position in `used`.
pub(crate) fn renumber(indices: &mut [u32], used: &[u32]) {
    for index in indices {
        *index = used.partition_point(|vertex| vertex < index) as u32;
    }
}

/// A valid mesh without unused vertices, and the indices of its vertices in the whole mesh.
pub(crate) struct Compact<'a> {
    pub(crate) mesh: Cow<'a, SourceMesh>,
    whole: &'a SourceMesh,
    used: Option<Vec<u32>>,
}

impl<'a> Compact<'a> {
    /// Validates the mesh and removes unused vertices. Unused vertices may be invalid.
    pub(crate) fn of(whole: &'a SourceMesh) -> Result<Self, MeshError> {
        let used = used_of(&whole.indices, whole.positions.len());
        // The positions are validated below, without those of unused vertices.
        let Some(used) = used.filter(|_| whole.check_shape().is_ok()) else {
            whole.validate()?;
            return Ok(Self {
                mesh: Cow::Borrowed(whole),
                whole,
                used: None,
            });
        };
        let mut indices = whole.indices.clone();
        renumber(&mut indices, &used);
        let mesh = SourceMesh {
            vertices: whole.vertices.at(&used),
            has_other_attributes: whole.has_other_attributes,
            surface: whole.surface.clone(),
            indices,
        };
        // Errors name vertices of the whole mesh.
        mesh.validate().map_err(|fault| match fault {
            MeshError::BadPosition { vertex, position } => MeshError::BadPosition {
                vertex: used[vertex] as usize,
                position,
            },
            fault => fault,
        })?;
        Ok(Self {
            mesh: Cow::Owned(mesh),
            whole,
            used: Some(used),
        })
    }

    /// Selects the values of used vertices. `values` has one per vertex or is empty.
    pub(crate) fn at_used(&self, values: &'a [bool]) -> Cow<'a, [bool]> {
        match &self.used {
            Some(used) if !values.is_empty() => used.iter().map(|&v| values[v as usize]).collect(),
            _ => Cow::Borrowed(values),
        }
    }

    /// For each vertex of the whole mesh, the first used vertex at its place; unused vertices map to themselves.
    pub(crate) fn places(&self) -> Vec<u32> {
        let place = Topology::of(&self.mesh, &Surfaces::default()).place;
        let Some(used) = &self.used else {
            return place;
        };
        let mut of_whole: Vec<u32> = (0..self.whole.positions.len() as u32).collect();
        for (&vertex, first) in used.iter().zip(place) {
            of_whole[vertex as usize] = used[first as usize];
        }
        of_whole
    }

    /// Converts the hierarchy of the compact mesh to a hierarchy of the whole mesh.
    pub(crate) fn of_whole(&self, compact: Hierarchy) -> Hierarchy {
        match &self.used {
            Some(used) => Hierarchy {
                source: self.whole.source_hash(),
                ..compact.with_unused_vertices(used, &self.whole.finite_vertices())
            },
            None => compact,
        }
    }
}
