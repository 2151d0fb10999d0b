//! Vertex attributes and the hash of a source mesh.

use bytemuck::{NoUninit, Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};
use xxhash_rust::xxh3::Xxh3;

/// Vertex attributes in local space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// Positions in local units.
    pub positions: Vec<Vec3>,
    /// Unit normals, one per position, or empty.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per position, or empty.
    pub uvs: Vec<Vec2>,
    /// Unit tangents, one per position, or empty. `w` is the handedness of the bitangent (1 or -1).
    pub tangents: Vec<Vec4>,
    /// Second texture coordinates, one per position, or empty.
    pub uvs_1: Vec<Vec2>,
    /// Linear colours (red, green, blue, alpha), one per position, or empty.
    pub colors: Vec<Vec4>,
}

impl Vertices {
    /// The first attribute with a wrong number of values, and this number.
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

    /// The vertices with these indices.
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

    /// Adds a copy of a vertex at another position.
    ///
    /// # Panics
    /// If the index is out of range.
    pub fn push_copy(&mut self, vertex: u32, position: Vec3) {
        let copy = self.at(&[vertex]);
        self.positions.push(position);
        self.normals.extend(copy.normals);
        self.uvs.extend(copy.uvs);
        self.tangents.extend(copy.tangents);
        self.uvs_1.extend(copy.uvs_1);
        self.colors.extend(copy.colors);
    }

    /// Hash of a mesh with exactly these vertices and the triangle list `indices`.
    ///
    /// The indices of a mesh without an index buffer are `0, 1, 2, …`.
    #[must_use]
    pub fn source_hash(&self, indices: &[u32]) -> SourceHash {
        SourceHash::default()
            .and(indices)
            .and(&self.positions)
            .and(&self.normals)
            .and(&self.uvs)
            .and(&self.tangents)
            .and(&self.uvs_1)
            .and(&self.colors)
    }
}

/// The values at these indices. Empty if the attribute is missing.
fn values_at<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
    let of_index = |&index: &u32| values[index as usize];
    let count = if values.is_empty() { 0 } else { indices.len() };
    indices[..count].iter().map(of_index).collect()
}

/// A hash (XXH3, 64 bits) of the vertices and triangle indices of a mesh.
///
/// A hierarchy refers to source vertices by index, so it only fits the mesh that it was baked from. The
/// hash detects stale files. It ignores attributes that [`Vertices`] does not hold, except for
/// [joints](Self::with_joints) and [morph targets](Self::with_morph_target) that are added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
#[repr(transparent)]
pub struct SourceHash(pub u64);

impl SourceHash {
    /// Adds the joints and weights of a skinned mesh, as `Mesh` holds them.
    #[must_use]
    pub fn with_joints(self, joints: &[[u16; 4]], weights: &[[f32; 4]]) -> Self {
        self.and(joints).and(weights)
    }

    /// Adds the position deltas of the next morph target, one per vertex.
    #[must_use]
    pub fn with_morph_target(self, position_deltas: &[Vec3]) -> Self {
        self.and(position_deltas)
    }

    /// Adds a list and its length to the hash.
    fn and<V: NoUninit>(self, values: &[V]) -> Self {
        // The seed and the length change the hash if a value moves from one list to the next.
        let mut hasher = Xxh3::with_seed(self.0);
        hasher.update(&(values.len() as u64).to_le_bytes());
        hasher.update(bytemuck::cast_slice(values));
        Self(hasher.digest())
    }
}
