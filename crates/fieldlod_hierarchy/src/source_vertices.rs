//! Hierarchies that are stored without source vertices.

use glam::Vec3;

use crate::hierarchy::Hierarchy;
use crate::validate::InvalidHierarchy;
use crate::vertices::Vertices;

impl Hierarchy {
    /// Returns `true` if source vertices are missing, because the file omits them.
    ///
    /// The positions of all source vertices are NaN, and the hierarchy is [invalid](Self::validate),
    /// until [`with_source_vertices`](Self::with_source_vertices) adds them.
    #[must_use]
    pub fn lacks_source_vertices(&self) -> bool {
        let source = self
            .vertices
            .positions
            .get(..self.source_vertex_count as usize);
        source.is_some_and(|source| !source.is_empty() && source.iter().all(|p| p.is_nan()))
    }

    /// Adds missing source vertices. `source` holds the vertices of the mesh with the hash
    /// [`source`](Self::source). A complete hierarchy is returned unchanged.
    ///
    /// # Errors
    /// If `source` has another number of vertices or other attributes, or if the result breaks an invariant.
    /// `source` is then not the baked mesh, or the file is malformed.
    pub fn with_source_vertices(mut self, source: &Vertices) -> Result<Self, InvalidHierarchy> {
        if !self.lacks_source_vertices() {
            return Ok(self);
        }
        let (vertices, expected) = (source.positions.len(), self.source_vertex_count as usize);
        if vertices != expected {
            return Err(InvalidHierarchy::OtherSource { vertices, expected });
        }
        self.vertices.replace_first(expected, source)?;
        // The loader has checked only what does not depend on positions.
        self.validate()?;
        Ok(self)
    }

    /// Adds unused source vertices. This hierarchy was baked from a mesh with only the vertices `used` of `source`. The
    /// result has all vertices of `source`, but keeps the hash of the smaller mesh. Unused vertices get the position of
    /// the first used vertex, so that no box grows.
    ///
    /// # Panics
    /// If `used` does not have one index per source vertex, or an index is beyond `source`.
    #[must_use]
    pub fn with_unused_vertices(mut self, used: &[u32], source: &Vertices) -> Self {
        let (count, all) = (self.source_vertex_count as usize, source.positions.len());
        assert_eq!(used.len(), count, "one index per source vertex");
        let place = |vertex: &mut u32| {
            *vertex = match used.get(*vertex as usize) {
                Some(&place) => place,
                // Moved vertices come after all source vertices.
                None => *vertex + (all - count) as u32,
            };
        };
        self.unit_vertices.iter_mut().for_each(place);
        self.moved_from.iter_mut().for_each(place);
        let held = &mut self.vertices;
        let first = held.positions.first().copied().unwrap_or_default();
        spread(&mut held.positions, used, vec![first; all]);
        spread(&mut held.normals, used, source.normals.clone());
        spread(&mut held.uvs, used, source.uvs.clone());
        spread(&mut held.tangents, used, source.tangents.clone());
        spread(&mut held.uvs_1, used, source.uvs_1.clone());
        spread(&mut held.colors, used, source.colors.clone());
        self.source_vertex_count = all as u32;
        self
    }

    /// The source vertices in the order of the source. Positions are NaN if source vertices [are
    /// missing](Self::lacks_source_vertices).
    #[must_use]
    pub fn source_vertices(&self) -> Vertices {
        let indices: Vec<u32> = (0..self.source_vertex_count).collect();
        self.vertices.at(&indices)
    }

    /// Removes the positions of source vertices.
    pub(crate) fn without_source_vertices(mut self) -> Self {
        let count = self.source_vertex_count as usize;
        for position in self.vertices.positions.iter_mut().take(count) {
            *position = Vec3::NAN;
        }
        self
    }
}

impl Vertices {
    /// Replaces the first `count` vertices by those of `source`.
    pub(crate) fn replace_first(
        &mut self,
        count: usize,
        source: &Self,
    ) -> Result<(), InvalidHierarchy> {
        replace(&mut self.positions, &source.positions, count, "positions")?;
        replace(&mut self.normals, &source.normals, count, "normals")?;
        replace(&mut self.uvs, &source.uvs, count, "uvs")?;
        replace(&mut self.tangents, &source.tangents, count, "tangents")?;
        replace(&mut self.uvs_1, &source.uvs_1, count, "second uvs")?;
        replace(&mut self.colors, &source.colors, count, "colors")
    }
}

/// Moves the values of used vertices to their indices in `all`, and appends those of moved vertices.
fn spread<V: Copy>(values: &mut Vec<V>, used: &[u32], mut all: Vec<V>) {
    // The attribute is missing.
    if values.len() < used.len() {
        return;
    }
    for (&place, &value) in used.iter().zip(values.iter()) {
        all[place as usize] = value;
    }
    all.extend_from_slice(&values[used.len()..]);
    *values = all;
}

/// Replaces the first `count` values of an attribute, which both or neither must have.
fn replace<V: Copy>(
    values: &mut [V],
    source: &[V],
    count: usize,
    attribute: &'static str,
) -> Result<(), InvalidHierarchy> {
    match (values.get_mut(..count), source.get(..count)) {
        (Some(values), Some(source)) => values.copy_from_slice(source),
        (None, None) if source.is_empty() => {}
        _ => return Err(InvalidHierarchy::OtherAttributes { attribute }),
    }
    Ok(())
}
