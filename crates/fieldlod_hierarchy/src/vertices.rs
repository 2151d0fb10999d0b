//! Vertex attributes, and the identity of the mesh that a hierarchy was baked from.

use bytemuck::{NoUninit, Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};
use xxhash_rust::xxh3::Xxh3;

/// Vertex attributes. Local space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// Positions in local units.
    pub positions: Vec<Vec3>,
    /// Unit normals, one per position, or empty.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per position, or empty.
    pub uvs: Vec<Vec2>,
    /// Unit tangents, and in `w` the handedness of the bitangent (1 or -1), one per position, or
    /// empty.
    pub tangents: Vec<Vec4>,
    /// The second set of texture coordinates, one per position, or empty.
    pub uvs_1: Vec<Vec2>,
    /// Colours, linear red, green, blue and alpha, one per position, or empty.
    pub colors: Vec<Vec4>,
}

impl Vertices {
    /// The first attribute that only some vertices have, and its count.
    #[must_use]
    pub fn incomplete_attribute(&self) -> Option<(&'static str, usize)> {
        let counts = [
            ("normals", self.normals.len()),
            ("uvs", self.uvs.len()),
            ("tangents", self.tangents.len()),
            ("second uvs", self.uvs_1.len()),
            ("colors", self.colors.len()),
        ];
        let vertices = self.positions.len();
        let mut counts = counts.into_iter();
        counts.find(|&(_, count)| count != 0 && count != vertices)
    }

    /// The vertices with these indices, in their order.
    ///
    /// # Panics
    /// If an index is out of range.
    #[must_use]
    pub fn at(&self, indices: &[u32]) -> Self {
        Self {
            positions: values_at(&self.positions, indices),
            normals: values_at(&self.normals, indices),
            uvs: values_at(&self.uvs, indices),
            tangents: values_at(&self.tangents, indices),
            uvs_1: values_at(&self.uvs_1, indices),
            colors: values_at(&self.colors, indices),
        }
    }

    /// The hash of a mesh of these vertices and no others, with the triangle list `indices`.
    #[must_use]
    pub fn source_hash(&self, indices: &[u32]) -> SourceHash {
        SourceHash::of(indices, self)
    }
}

/// The values at some indices; none if there are no values.
fn values_at<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
    let of_index = |&index: &u32| values[index as usize];
    let has_values = !values.is_empty();
    let indices = indices.iter().filter(|_| has_values);
    indices.map(of_index).collect()
}

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
