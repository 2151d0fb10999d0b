//! Meshes, their materials, and questions about their triangles.
//!
//! In: a [`SourceMesh`] with the [`Surface`](surface::Surface) of its material. Out: components, open edges, bounds, and
//! the nearest triangle to a point.

pub(crate) mod bounds;
pub(crate) mod components;
pub(crate) mod edges;
mod source_mesh;
pub(crate) mod srgb;
pub(crate) mod surface;
pub(crate) mod surfaces;
pub(crate) mod topology;
pub(crate) mod triangle;
pub(crate) mod triangle_tree;
mod triangles_4;
pub(crate) mod two_sided;
pub(crate) mod used_vertices;

pub use source_mesh::{MAX_COORDINATE, MeshError, SourceMesh};
