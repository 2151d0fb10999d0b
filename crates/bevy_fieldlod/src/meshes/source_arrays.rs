//! The vertex attributes and indices of a Bevy mesh that baking reads.

use bevy::math::{Vec2, Vec3};
use bevy::mesh::{Mesh, PrimitiveTopology, VertexAttributeValues};
use fieldlod_hierarchy::{BakedFile, FORMAT_VERSION, Hierarchy, SourceHash};
use xxhash_rust::xxh3::Xxh3;

use crate::events::LodError;

/// Vertex attributes and indices in the types of the baker.
pub(super) struct SourceArrays {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) indices: Vec<u32>,
}

impl SourceArrays {
    /// Copies them out of `mesh`, or tells why it cannot have levels of detail.
    pub(super) fn of(mesh: &Mesh) -> Result<Self, LodError> {
        // Only triangle lists that stay as they are can be simplified.
        if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
            return Err(LodError::Topology(mesh.primitive_topology()));
        }
        if mesh.try_has_morph_targets()? {
            return Err(LodError::Morphed);
        }
        // Positions must be there; normals and texture coordinates may be.
        let Some(VertexAttributeValues::Float32x3(positions)) =
            mesh.try_attribute_option(Mesh::ATTRIBUTE_POSITION)?
        else {
            return Err(LodError::NoPositions);
        };
        let normals = match mesh.try_attribute_option(Mesh::ATTRIBUTE_NORMAL)? {
            Some(VertexAttributeValues::Float32x3(normals)) => to_vec3(normals),
            _ => Vec::new(),
        };
        let uvs = match mesh.try_attribute_option(Mesh::ATTRIBUTE_UV_0)? {
            Some(VertexAttributeValues::Float32x2(uvs)) => {
                uvs.iter().map(|&uv| uv.into()).collect()
            }
            _ => Vec::new(),
        };
        // A mesh without indices draws its vertices in order.
        let indices = match mesh.try_indices_option()? {
            Some(indices) => indices.iter().map(|index| index as u32).collect(),
            None => (0..positions.len() as u32).collect(),
        };
        Ok(Self {
            positions: to_vec3(positions),
            normals,
            uvs,
            indices,
        })
    }

    /// The hash that `.fieldlod` files know their source mesh by.
    pub(super) fn hash(&self) -> SourceHash {
        SourceHash::of(&self.positions, self.indices.iter().copied())
    }

    /// Area in texture coordinates for each unit of area in local space; 0 without either.
    pub(super) fn uv_per_area(&self) -> f32 {
        let (triangles, _) = self.indices.as_chunks::<3>();
        let (mut uv_area, mut area) = (0.0f64, 0.0f64);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|vertex| self.positions.get(vertex as usize));
            let uvs = triangle.map(|vertex| self.uvs.get(vertex as usize));
            if let (Some(a), Some(b), Some(c), [Some(uv_a), Some(uv_b), Some(uv_c)]) =
                (a, b, c, uvs)
            {
                // Both are twice the triangle's, which the ratio does not show.
                area += f64::from((b - a).cross(c - a).length());
                uv_area += f64::from((uv_b - uv_a).perp_dot(uv_c - uv_a).abs());
            }
        }
        let ratio = (uv_area / area) as f32;
        if ratio.is_finite() { ratio } else { 0.0 }
    }

    /// The name of the cache entry: a hash of all that baking looks at.
    pub(super) fn cache_name(&self) -> String {
        let mut hasher = Xxh3::new();
        // Another version may bake differently, or write another format.
        hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
        hasher.update(&FORMAT_VERSION.to_le_bytes());
        hasher.update(&self.hash().0.to_le_bytes());
        // A NaN, which neither holds, tells where normals end.
        let normals = self.normals.iter().flat_map(Vec3::to_array);
        let uvs = self.uvs.iter().flat_map(Vec2::to_array);
        for number in normals.chain([f32::NAN]).chain(uvs) {
            hasher.update(&number.to_bits().to_le_bytes());
        }
        format!("{:032x}.fieldlod", hasher.digest128())
    }
}

fn to_vec3(values: &[[f32; 3]]) -> Vec<Vec3> {
    values.iter().copied().map(Vec3::from).collect()
}

/// The hierarchy in `file` of the mesh with this hash.
pub(super) fn find_hierarchy(file: &BakedFile, hash: SourceHash) -> Option<Hierarchy> {
    let mut hierarchies = file.primitives.iter().map(|primitive| &primitive.hierarchy);
    hierarchies
        .find(|hierarchy| hierarchy.source == hash)
        .cloned()
}
