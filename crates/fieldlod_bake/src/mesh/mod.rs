//! Meshes, their materials, and queries on their triangles.
//!
//! In: a [`SourceMesh`] with the [`Surface`](surface::Surface) of its material. Out: components, open edges, bounds,
//! and the nearest triangle to a point.

pub(crate) mod bounds;
pub(crate) mod components;
pub(crate) mod edges;
mod source_mesh;
pub(crate) mod srgb;
pub(crate) mod surface;
pub(crate) mod surfaces;
pub(crate) mod topology;
pub(crate) mod triangle_tree;
pub(crate) mod two_sided;
pub(crate) mod used_vertices;

pub(crate) use source_mesh::check_indices;
pub use source_mesh::{MAX_COORDINATE, MeshError, SourceMesh};

use glam::Vec3;
use meshopt::VertexDataAdapter;
use rustc_hash::FxHashMap;

/// Positions as meshoptimizer reads them.
pub(crate) fn adapter(positions: &[[f32; 3]]) -> VertexDataAdapter<'_> {
    let bytes = meshopt::typed_to_bytes(positions);
    match VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0) {
        Ok(vertices) => vertices,
        Err(_) => unreachable!("a stride of three floats is always valid"),
    }
}

/// The bits of a position, as the key of a map.
pub(crate) fn bits(position: Vec3) -> [u32; 3] {
    // Adding zero turns −0 into +0, so that both have the same bits.
    (position + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// For each position, the index of the first equal position.
pub(crate) fn weld(positions: impl Iterator<Item = Vec3>) -> Vec<u32> {
    let mut first_at: FxHashMap<[u32; 3], u32> = FxHashMap::default();
    let firsts = (0..).zip(positions);
    firsts
        .map(|(index, position)| *first_at.entry(bits(position)).or_insert(index))
        .collect()
}
