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
        let first = self.vertices.positions.first();
        self.source_vertex_count > 0 && first.is_some_and(|position| position.is_nan())
    }

    /// Adds missing source vertices. `source` holds the vertices of the mesh with the hash
    /// [`source`](Self::source). A complete hierarchy is returned unchanged.
    ///
    /// # Errors
    /// If `source` has another number of vertices or other attributes, or if it breaks an invariant.
    /// In all these cases it is not the baked mesh.
    pub fn with_source_vertices(mut self, source: &Vertices) -> Result<Self, InvalidHierarchy> {
        if !self.lacks_source_vertices() {
            return Ok(self);
        }
        let (vertices, expected) = (source.positions.len(), self.source_vertex_count as usize);
        if vertices != expected {
            return Err(InvalidHierarchy::OtherSource { vertices, expected });
        }
        self.vertices.replace_first(expected, source)?;
        self.validate()?;
        Ok(self)
    }

    /// The source's vertices, in its order; NaN where they [are missing](Self::lacks_source_vertices).
    #[must_use]
    pub fn source_vertices(&self) -> Vertices {
        let mut vertices = self.vertices.clone();
        vertices.truncate(self.source_vertex_count as usize);
        vertices
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
    fn truncate(&mut self, count: usize) {
        self.positions.truncate(count);
        self.normals.truncate(count);
        self.uvs.truncate(count);
        self.tangents.truncate(count);
        self.uvs_1.truncate(count);
        self.colors.truncate(count);
    }

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

/// Replaces the first `count` of an attribute that both have, or neither.
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
