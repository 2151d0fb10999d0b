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
    /// Hashes the triangle list `indices`, three a triangle. A mesh without an index buffer is hashed
    /// with the indices `0, 1, 2, …`.
    #[must_use]
    pub fn of(indices: &[u32]) -> Self {
        Self::default().and(indices)
    }

    /// Hashes one more list of a mesh: its attributes follow in the order of the fields of
    /// [`Vertices`], those that it lacks as empty lists.
    #[must_use]
    pub fn and<V: NoUninit>(self, values: &[V]) -> Self {
        let mut hasher = Xxh3::with_seed(self.0);
        hasher.update(&(values.len() as u64).to_le_bytes());
        hasher.update(bytemuck::cast_slice(values));
        Self(hasher.digest())
    }
}

impl Vertices {
    /// The hash of a mesh of these vertices and no others, with the triangle list `indices`.
    #[must_use]
    pub fn source_hash(&self, indices: &[u32]) -> SourceHash {
        SourceHash::of(indices)
            .and(&self.positions)
            .and(&self.normals)
            .and(&self.uvs)
            .and(&self.tangents)
            .and(&self.uvs_1)
            .and(&self.colors)
    }
}
