//! The identity of the mesh that a hierarchy was baked from.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use xxhash_rust::xxh3::Xxh3;

/// A hash (XXH3, 64 bits) of a mesh's positions and triangle indices.
///
/// A hierarchy refers to its source's vertices by index, so it is only good for the very mesh that
/// it was baked from; this tells a stale file from a fitting one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
#[repr(transparent)]
pub struct SourceHash(pub u64);

impl SourceHash {
    /// Hashes `positions` (local space, one per vertex) and the triangle list `indices` (three per
    /// triangle). A mesh without an index buffer is hashed with the indices `0, 1, 2, …`.
    #[must_use]
    pub fn of(positions: &[Vec3], indices: impl Iterator<Item = u32>) -> Self {
        let mut hasher = Xxh3::new();
        hasher.update(&(positions.len() as u64).to_le_bytes());
        for position in positions {
            for component in position.to_array() {
                hasher.update(&component.to_bits().to_le_bytes());
            }
        }
        for index in indices {
            hasher.update(&index.to_le_bytes());
        }
        Self(hasher.digest())
    }
}
