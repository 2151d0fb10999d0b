//! Vertex attributes that simplification does not look at: kept beside the mesh, and carried over
//! to the hierarchy, whose vertices are those of the source.

use fieldlod_hierarchy::Vertices;
use glam::{Vec2, Vec4};

use crate::mesh::MeshError;

/// What a vertex may have beyond the attributes of a [`SourceMesh`](crate::SourceMesh).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExtraAttributes {
    /// Unit tangents, and in `w` the handedness of the bitangent (1 or -1), one per position, or
    /// empty.
    pub tangents: Vec<Vec4>,
    /// The second set of texture coordinates, one per position, or empty.
    pub uvs_1: Vec<Vec2>,
    /// Colours, linear red, green, blue and alpha, one per position, or empty. Without alpha in
    /// the file it is 1.
    pub colors: Vec<Vec4>,
}

impl ExtraAttributes {
    /// The attributes of [`SourceMesh::without_shared_vertices`]: those of every corner in turn.
    ///
    /// [`SourceMesh::without_shared_vertices`]: crate::SourceMesh::without_shared_vertices
    #[must_use]
    pub fn without_shared_vertices(&self, indices: &[u32]) -> Self {
        Self {
            tangents: at_corners(&self.tangents, indices),
            uvs_1: at_corners(&self.uvs_1, indices),
            colors: at_corners(&self.colors, indices),
        }
    }

    /// Checks that every attribute is there for all vertices or for none.
    pub(crate) fn check_counts(&self, vertices: usize) -> Result<(), MeshError> {
        let counts = [
            ("tangents", self.tangents.len()),
            ("second uvs", self.uvs_1.len()),
            ("colors", self.colors.len()),
        ];
        let is_wrong = |&(_, count): &(&str, usize)| count != 0 && count != vertices;
        match counts.into_iter().find(is_wrong) {
            Some((attribute, count)) => Err(MeshError::AttributeCount {
                attribute,
                count,
                vertices,
            }),
            None => Ok(()),
        }
    }

    /// Gives the attributes to the vertices that were baked. Those that are not finite count as
    /// zero.
    pub(crate) fn give_to(&self, vertices: &mut Vertices) {
        let finite = |v: &Vec4| if v.is_finite() { *v } else { Vec4::ZERO };
        let finite_uv = |v: &Vec2| if v.is_finite() { *v } else { Vec2::ZERO };
        vertices.tangents = self.tangents.iter().map(finite).collect();
        vertices.uvs_1 = self.uvs_1.iter().map(finite_uv).collect();
        vertices.colors = self.colors.iter().map(finite).collect();
    }
}

fn at_corners<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
    let corners = indices.iter().filter_map(|&v| values.get(v as usize));
    corners.copied().collect()
}
