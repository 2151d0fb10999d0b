//! The identity of the mesh that a hierarchy was baked from.

use bytemuck::{NoUninit, Pod, Zeroable};
use xxhash_rust::xxh3::Xxh3;

use crate::hierarchy::Vertices;

/// A hash (XXH3, 64 bits) of a mesh's vertices and triangle indices.
///
/// A hierarchy refers to its source's vertices by index, and its moved vertices mix their attributes,
/// so it is only good for the very mesh that it was baked from; this tells a stale file from a
/// fitting one. Attributes that [`Vertices`] does not hold do not count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
#[repr(transparent)]
pub struct SourceHash(pub u64);

impl SourceHash {
    /// Hashes the triangle list `indices` and the attributes of the vertices. A mesh without an index buffer is hashed with
    /// the indices `0, 1, 2, …`.
    #[must_use]
    pub fn of(indices: &[u32], vertices: &Vertices) -> Self {
        Self::default()
            .and(indices)
            .and(&vertices.positions)
            .and(&vertices.normals)
            .and(&vertices.uvs)
            .and(&vertices.tangents)
            .and(&vertices.uvs_1)
            .and(&vertices.colors)
    }

    /// Hashes one more list, and its length.
    fn and<V: NoUninit>(self, values: &[V]) -> Self {
        let mut hasher = Xxh3::with_seed(self.0);
        hasher.update(&(values.len() as u64).to_le_bytes());
        hasher.update(bytemuck::cast_slice(values));
        Self(hasher.digest())
    }
}
