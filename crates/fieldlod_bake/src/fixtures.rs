//! Meshes made by the program, for tests, examples and measurements: no file is needed.
//!
//! Closed ones ([`icosphere`], [`rock`], [`torus_knot`], [`shells`]) have every edge shared by two
//! triangles once vertices at one place count as one; open ones ([`height_field`], [`islands`])
//! have a border; plants ([`crown`], [`tree_in_parts`], [`cards`], which [`cut_out`] cuts leaves out of) have many leaves,
//! a [`palm`] few fronds; degenerate ones test that a bake survives what files contain.

mod closed;
mod degenerate;
mod open;
mod plants;

pub use closed::{icosphere, rock, shells, torus_knot};
pub use degenerate::{coincident_points, doubled, flat_shaded, non_manifold_fan, one_triangle};
pub use open::{height_field, islands, plane};
pub use plants::{cards, crown, cut_out, palm, tree_in_parts};

use glam::Vec3;

use crate::mesh::SourceMesh;

/// Replaces the normals by the area-weighted means of the adjoining triangles' normals.
///
/// Vertices at one place are smoothed apart if they are separate vertices.
#[must_use]
pub fn with_smooth_normals(mesh: SourceMesh) -> SourceMesh {
    // Sums of normals as long as twice the area of each triangle.
    let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        for &vertex in triangle {
            sums[vertex as usize] += (b - a).cross(c - a);
        }
    }
    let normals = sums.into_iter().map(Vec3::normalize_or_zero).collect();
    SourceMesh { normals, ..mesh }
}

/// Joins meshes into one. Attributes that not all of them have are dropped.
#[must_use]
pub fn joined(meshes: &[SourceMesh]) -> SourceMesh {
    let mut all = SourceMesh::default();
    for mesh in meshes {
        let first_vertex = all.positions.len() as u32;
        all.positions.extend(&mesh.positions);
        all.normals.extend(&mesh.normals);
        all.uvs.extend(&mesh.uvs);
        all.colors.extend(&mesh.colors);
        all.indices
            .extend(mesh.indices.iter().map(|index| first_vertex + index));
    }
    if all.normals.len() != all.positions.len() {
        all.normals.clear();
    }
    if all.uvs.len() != all.positions.len() {
        all.uvs.clear();
    }
    if all.colors.len() != all.positions.len() {
        all.colors.clear();
    }
    all
}
