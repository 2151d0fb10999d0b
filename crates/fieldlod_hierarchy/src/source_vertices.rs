//! The vertices of the source mesh in a hierarchy.

use crate::hierarchy::Hierarchy;
use crate::vertices::Vertices;

impl Hierarchy {
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

    /// The source vertices in the order of the source.
    #[must_use]
    pub fn source_vertices(&self) -> Vertices {
        let indices: Vec<u32> = (0..self.source_vertex_count).collect();
        self.vertices.at(&indices)
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
