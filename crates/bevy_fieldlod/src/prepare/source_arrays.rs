//! The vertex attributes and indices of a Bevy mesh that baking reads, and which hierarchies fit them.

#[cfg(feature = "bake")]
use std::sync::Arc;

use bevy::asset::RenderAssetUsages;
use bevy::mesh::{Indices, Mesh, MeshVertexAttributeId, PrimitiveTopology, VertexAttributeValues};
use bevy::platform::collections::HashMap;
#[cfg(feature = "bake")]
use fieldlod_bake::{SourceMesh, Surface};
use fieldlod_hierarchy::{BakedFile, Hierarchy, SourceHash, Vertices};

use crate::api::events::LodError;

/// Vertex attributes and indices in the types of the baker.
pub(super) struct SourceArrays {
    pub(super) vertices: Vertices,
    /// Whether vertices have attributes besides these, or in other formats.
    pub(super) has_other_attributes: bool,
    pub(super) indices: Vec<u32>,
    /// What the mesh looks like, if that is known.
    #[cfg(feature = "bake")]
    pub(super) surface: Option<Arc<Surface>>,
}

impl SourceArrays {
    /// Copies them out of `mesh`, or tells why it cannot have levels of detail.
    pub(super) fn of(mesh: &Mesh) -> Result<Self, LodError> {
        // Such a mesh is there or not, as the renderer has taken its data or has not yet.
        if !mesh.asset_usage.contains(RenderAssetUsages::MAIN_WORLD) {
            return Err(LodError::NotInMainWorld);
        }
        // Only triangle lists that stay as they are can be simplified.
        if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
            return Err(LodError::Topology(mesh.primitive_topology()));
        }
        if mesh.try_has_morph_targets()? {
            return Err(LodError::Morphed);
        }
        // Positions must be there; all else may be.
        let (mut vertices, mut has_other_attributes) = (Vertices::default(), false);
        for (attribute, values) in mesh.try_attributes()? {
            has_other_attributes |= !read(attribute.id, values, &mut vertices);
        }
        let count = vertices.positions.len();
        if count == 0 {
            return Err(LodError::NoPositions);
        }
        let mut attributes = mesh.try_attributes()?;
        if let Some((attribute, _)) = attributes.find(|(_, values)| values.len() != count) {
            let attribute = attribute.name;
            return Err(LodError::AttributeCount { attribute });
        }
        // A mesh without indices draws its vertices in order.
        let indices: Vec<u32> = match mesh.try_indices_option()? {
            Some(indices) => indices.iter().map(|index| index as u32).collect(),
            None => (0..count as u32).collect(),
        };
        Ok(Self {
            vertices,
            has_other_attributes,
            indices,
            #[cfg(feature = "bake")]
            surface: None,
        })
    }

    /// What a bake takes.
    #[cfg(feature = "bake")]
    pub(super) fn into_mesh(self) -> SourceMesh {
        SourceMesh {
            positions: self.vertices.positions,
            normals: self.vertices.normals,
            uvs: self.vertices.uvs,
            tangents: self.vertices.tangents,
            uvs_1: self.vertices.uvs_1,
            colors: self.vertices.colors,
            has_other_attributes: self.has_other_attributes,
            surface: self.surface,
            indices: self.indices,
        }
    }

    #[cfg(feature = "bake")]
    pub(super) fn has_same_mesh_as(&self, other: &Self) -> bool {
        self.vertices == other.vertices
            && self.indices == other.indices
            && self.has_other_attributes == other.has_other_attributes
    }

    /// Area in texture coordinates for each unit of area in local space; 0 without either.
    pub(super) fn uv_per_area(&self) -> f32 {
        let (triangles, _) = self.indices.as_chunks::<3>();
        let (mut uv_area, mut area) = (0.0f64, 0.0f64);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|vertex| self.vertices.positions.get(vertex as usize));
            let uvs = triangle.map(|vertex| self.vertices.uvs.get(vertex as usize));
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

    /// The hierarchy of this mesh in `baked`, complete and valid: that at its own `place` if it fits. `file` names it in
    /// errors.
    pub(super) fn find_hierarchy(
        &self,
        baked: &BakedFile,
        place: Option<[u32; 2]>,
        file: &str,
    ) -> Result<Hierarchy, LodError> {
        let mut fault = LodError::Stale { file: file.into() };
        // By the attributes that hierarchies hold: this mesh with no others, and the hash of it.
        let mut known: HashMap<[bool; 5], (Vertices, SourceHash)> = HashMap::default();
        // Trees may share a trunk, which changes its levels with the leaves of each.
        let own = place.and_then(|[mesh, primitive]| baked.find(mesh, primitive));
        for primitive in own.into_iter().chain(&baked.primitives) {
            let hierarchy = &primitive.hierarchy;
            let held = attributes(&hierarchy.vertices);
            let (vertices, hash) = known.entry(held).or_insert_with(|| {
                let vertices = self.vertices_with(held);
                let hash = vertices.source_hash(&self.indices);
                (vertices, hash)
            });
            // Two primitives may differ in attributes that only one of them holds.
            if hierarchy.source == *hash {
                match self.complete(hierarchy, vertices, file) {
                    Ok(complete) => return Ok(complete),
                    Err(error) => fault = error,
                }
            }
        }
        Err(fault)
    }

    /// `hierarchy` with `vertices` for those of its source, if it lacks them. Afterwards every vertex
    /// that it refers to exists, with all attributes of this mesh.
    fn complete(
        &self,
        hierarchy: &Hierarchy,
        vertices: &Vertices,
        file: &str,
    ) -> Result<Hierarchy, LodError> {
        if !self.tells_of_moved_vertices(hierarchy) {
            return Err(LodError::MissingAttributes { file: file.into() });
        }
        let complete = match hierarchy.lacks_source_vertices() {
            true => hierarchy.clone().with_source_vertices(vertices),
            false => hierarchy.validate().map(|()| hierarchy.clone()),
        };
        let fits = |h: &Hierarchy| h.source_vertex_count as usize == self.vertices.positions.len();
        let fitting = complete.ok().filter(fits);
        fitting.ok_or_else(|| LodError::Stale { file: file.into() })
    }

    /// Whether `hierarchy` has all attributes of moved vertices, or tells where they came from.
    fn tells_of_moved_vertices(&self, hierarchy: &Hierarchy) -> bool {
        let held = attributes(&hierarchy.vertices);
        let mut pairs = attributes(&self.vertices).into_iter().zip(held);
        let holds_all = !self.has_other_attributes && pairs.all(|(own, held)| held || !own);
        let moves = hierarchy.vertices.positions.len() > hierarchy.source_vertex_count as usize;
        holds_all || !moves || !hierarchy.moved_from.is_empty()
    }

    /// The vertices with those of their [attributes] that are `held`.
    fn vertices_with(&self, held: [bool; 5]) -> Vertices {
        let [normals, uvs, tangents, uvs_1, colors] = held;
        let own = &self.vertices;
        Vertices {
            positions: own.positions.clone(),
            normals: if_held(&own.normals, normals),
            uvs: if_held(&own.uvs, uvs),
            tangents: if_held(&own.tangents, tangents),
            uvs_1: if_held(&own.uvs_1, uvs_1),
            colors: if_held(&own.colors, colors),
        }
    }
}

/// Which mesh of its glTF file the primitive with this label is of, and which primitive of that.
pub(super) fn place_in_gltf(label: &str) -> Option<[u32; 2]> {
    let (mesh, primitive) = label.strip_prefix("Mesh")?.split_once("/Primitive")?;
    Some([mesh.parse().ok()?, primitive.parse().ok()?])
}

/// How many triangles a mesh has, as far as that can be told.
pub(super) fn triangle_count(mesh: &Mesh) -> usize {
    // What cannot be counted is refused, with its reason, by the task.
    let corners = match mesh.try_indices_option() {
        Ok(Some(indices)) => Indices::len(indices),
        _ => mesh
            .try_attribute(Mesh::ATTRIBUTE_POSITION)
            .map_or(usize::MAX, VertexAttributeValues::len),
    };
    corners / 3
}

/// Which attributes there are besides positions.
fn attributes(vertices: &Vertices) -> [bool; 5] {
    [
        !vertices.normals.is_empty(),
        !vertices.uvs.is_empty(),
        !vertices.tangents.is_empty(),
        !vertices.uvs_1.is_empty(),
        !vertices.colors.is_empty(),
    ]
}

fn if_held<V: Clone>(values: &[V], is_held: bool) -> Vec<V> {
    if is_held { values.to_vec() } else { Vec::new() }
}

/// Puts an attribute where hierarchies hold it; false if they do not, or not in this format.
fn read(
    id: MeshVertexAttributeId,
    values: &VertexAttributeValues,
    vertices: &mut Vertices,
) -> bool {
    use VertexAttributeValues::{Float32x2, Float32x3, Float32x4};
    match values {
        Float32x3(values) if id == Mesh::ATTRIBUTE_POSITION.id => {
            vertices.positions = converted(values);
        }
        Float32x3(values) if id == Mesh::ATTRIBUTE_NORMAL.id => {
            vertices.normals = converted(values);
        }
        Float32x2(values) if id == Mesh::ATTRIBUTE_UV_0.id => vertices.uvs = converted(values),
        Float32x2(values) if id == Mesh::ATTRIBUTE_UV_1.id => vertices.uvs_1 = converted(values),
        Float32x4(values) if id == Mesh::ATTRIBUTE_TANGENT.id => {
            vertices.tangents = converted(values);
        }
        Float32x4(values) if id == Mesh::ATTRIBUTE_COLOR.id => vertices.colors = converted(values),
        _ => return false,
    }
    true
}

fn converted<A: Copy, V: From<A>>(values: &[A]) -> Vec<V> {
    values.iter().copied().map(V::from).collect()
}
