//! A generated triangle mesh.

use bevy::asset::RenderAssetUsages;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;

/// A triangle mesh in metres with +Y up. Front faces are counter-clockwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<Vec3>,
    /// Unit normals, one per position.
    pub(crate) normals: Vec<Vec3>,
    /// Linear RGB, one per position, or empty.
    pub(crate) colors: Vec<Vec3>,
    /// Texture coordinates, one per position, or empty.
    pub(crate) uvs: Vec<Vec2>,
    /// Indices of positions, three per triangle.
    pub(crate) indices: Vec<u32>,
}

impl Shape {
    /// A shape with smooth normals, coloured by `color(position, normal)`.
    pub(crate) fn smooth(
        positions: Vec<Vec3>,
        indices: Vec<u32>,
        color: impl Fn(Vec3, Vec3) -> Vec3,
    ) -> Self {
        let normals = smooth_normals(&positions, &indices);
        let vertices = positions.iter().zip(&normals);
        let colors = vertices.map(|(p, n)| color(*p, *n)).collect();
        Self {
            positions,
            normals,
            colors,
            indices,
            ..Self::default()
        }
    }

    pub(crate) fn triangle_count(&self) -> u64 {
        self.indices.len() as u64 / 3
    }

    /// Returns the mesh and the mean of its vertex colours. The colours in the mesh are relative to the mean.
    pub(crate) fn into_mesh(self) -> (Mesh, Vec3) {
        let count = self.colors.len().max(1) as f32;
        let mean = match self.colors.iter().sum::<Vec3>() / count {
            Vec3::ZERO => Vec3::ONE,
            mean => mean,
        };
        let relative = |color: &Vec3| (*color / mean).extend(1.0).to_array();
        let colors: Vec<_> = self.colors.iter().map(relative).collect();
        let triangles = PrimitiveTopology::TriangleList;
        let mut mesh = Mesh::new(triangles, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, self.positions)
            .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, self.normals)
            .with_inserted_indices(Indices::U32(self.indices));
        if !colors.is_empty() {
            mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, colors);
        }
        if !self.uvs.is_empty() {
            mesh.insert_attribute(Mesh::ATTRIBUTE_UV_0, self.uvs);
        }
        (mesh, mean)
    }
}

/// Area-weighted mean normals of the triangles around each vertex.
pub(super) fn smooth_normals(positions: &[Vec3], indices: &[u32]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    let (triangles, _) = indices.as_chunks::<3>();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|index| positions[index as usize]);
        let area_normal = (b - a).cross(c - a);
        for index in triangle {
            normals[*index as usize] += area_normal;
        }
    }
    for normal in &mut normals {
        *normal = normal.normalize_or(Vec3::Y);
    }
    normals
}

#[cfg(test)]
impl Shape {
    /// Largest distance of a vertex from the Y axis.
    pub(crate) fn radius(&self) -> f32 {
        let flat = self.positions.iter().map(|p| p.xz().length());
        flat.fold(0.0, f32::max)
    }
}
