//! The vertex attributes and indices of a Bevy mesh that a bake reads, and the search for the hierarchy of a mesh in a
//! file.

#[cfg(feature = "bake")]
use std::sync::{Arc, OnceLock};

use bevy::asset::{AssetId, AssetServer, Assets, RenderAssetUsages};
use bevy::gltf::GltfAssetLabel;
use bevy::mesh::{Indices, Mesh, MeshVertexAttributeId, PrimitiveTopology, VertexAttributeValues};
use bevy::platform::collections::HashMap;
#[cfg(feature = "bake")]
use fieldlod_bake::{SourceMesh, Surface};
use fieldlod_hierarchy::{BakedFile, Hierarchy, SourceHash, Vertices};

use crate::api::events::LodError;
use crate::compat::decompressed;
use crate::scene::rig::{RigArrays, is_rigged};

/// Vertex attributes and indices in the types of the baker.
#[cfg_attr(feature = "bake", derive(Clone))]
pub(crate) struct SourceArrays {
    pub(super) vertices: Vertices,
    /// Whether vertices have other attributes, or attributes in other formats.
    pub(super) has_other_attributes: bool,
    pub(super) indices: Vec<u32>,
    pub(super) rig: RigArrays,
    /// The surface of the material, if it is known.
    #[cfg(feature = "bake")]
    pub(super) surface: Option<Arc<Surface>>,
    /// Hashes of the mesh and of its surface, once a cache entry is looked up.
    #[cfg(feature = "bake")]
    pub(super) hashes: (OnceLock<SourceHash>, OnceLock<u128>),
}

impl SourceArrays {
    /// Copies the attributes of `mesh`. Fails if the mesh cannot have levels of detail.
    pub(crate) fn of(mesh: &Mesh) -> Result<Self, LodError> {
        // Without this usage, the data is present only until the renderer takes it, and the result would depend on
        // timing.
        if !mesh.asset_usage.contains(RenderAssetUsages::MAIN_WORLD) {
            return Err(LodError::NotInMainWorld);
        }
        if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
            return Err(LodError::Topology(mesh.primitive_topology()));
        }
        let (mut vertices, mut has_other_attributes) = (Vertices::default(), false);
        for (attribute, values) in mesh.try_attributes()? {
            let values = decompressed(mesh, attribute.id, values);
            has_other_attributes |= !read(attribute.id, &values, &mut vertices);
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
            rig: RigArrays::of(mesh)?,
            #[cfg(feature = "bake")]
            surface: None,
            #[cfg(feature = "bake")]
            hashes: <_>::default(),
        })
    }

    /// The source mesh of a bake.
    #[cfg(feature = "bake")]
    pub(super) fn into_mesh(self) -> SourceMesh {
        SourceMesh {
            vertices: self.vertices,
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

    /// The hash of the mesh.
    #[cfg(feature = "bake")]
    pub(super) fn mesh_hash(&self) -> SourceHash {
        let hash = || self.vertices.source_hash(&self.indices);
        *self.hashes.0.get_or_init(hash)
    }

    /// The hash of the surface, if it is known.
    #[cfg(feature = "bake")]
    pub(super) fn surface_hash(&self) -> Option<u128> {
        let surface = self.surface.as_ref()?;
        let hash = || xxhash_rust::xxh3::xxh3_128(&surface.to_bytes());
        Some(*self.hashes.1.get_or_init(hash))
    }

    /// The hierarchy of this mesh in `baked`, complete and valid. The hierarchy at `place` is preferred. `file` is the
    /// name of the file in errors.
    pub(super) fn find_hierarchy(
        &self,
        baked: &BakedFile,
        place: Option<[u32; 2]>,
        file: &str,
    ) -> Result<Hierarchy, LodError> {
        let found = self.find_with_all_vertices(baked, place, file);
        // Files have only the vertices that triangles use.
        if let (Err(LodError::Stale { .. }), Some(used)) = (&found, self.used()) {
            let compact = self.at(&used).find_with_all_vertices(baked, place, file)?;
            let held = attributes(&compact.vertices);
            return Ok(compact.with_unused_vertices(&used, &self.vertices_with(held)));
        }
        found
    }

    /// The vertices that triangles use, ascending; `None` if these are all, or if some do not exist.
    fn used(&self) -> Option<Vec<u32>> {
        let count = self.vertices.positions.len();
        let mut used = self.indices.clone();
        used.sort_unstable();
        used.dedup();
        let exists = used.last().is_some_and(|&last| (last as usize) < count);
        (exists && used.len() < count).then_some(used)
    }

    /// The mesh with the `used` vertices alone.
    fn at(&self, used: &[u32]) -> Self {
        let place = |vertex: &u32| used.partition_point(|other| other < vertex) as u32;
        Self {
            vertices: self.vertices.at(used),
            has_other_attributes: self.has_other_attributes,
            indices: self.indices.iter().map(place).collect(),
            rig: self.rig.at(used),
            #[cfg(feature = "bake")]
            surface: self.surface.clone(),
            #[cfg(feature = "bake")]
            hashes: <_>::default(),
        }
    }

    /// [`find_hierarchy`](Self::find_hierarchy) of a mesh of which triangles use all vertices.
    fn find_with_all_vertices(
        &self,
        baked: &BakedFile,
        place: Option<[u32; 2]>,
        file: &str,
    ) -> Result<Hierarchy, LodError> {
        let mut fault = LodError::Stale { file: file.into() };
        // For each set of attributes that hierarchies hold: the hash of this mesh with these attributes only.
        let mut hashes: HashMap<[bool; 5], SourceHash> = HashMap::default();
        let of_mesh = attributes(&self.vertices);
        // Equal primitives, such as trunks of two trees, may have different levels: that of the same place is first.
        let own = place.and_then(|[mesh, primitive]| baked.find(mesh, primitive));
        for primitive in own.into_iter().chain(&baked.primitives) {
            let hierarchy = &primitive.hierarchy;
            let held = attributes(&hierarchy.vertices);
            let hash = hashes.entry(held).or_insert_with(|| {
                let hash = if held == of_mesh {
                    self.vertices.source_hash(&self.indices)
                } else {
                    self.vertices_with(held).source_hash(&self.indices)
                };
                self.rig.add_to(hash)
            });
            // A matching hierarchy may lack an attribute that another hierarchy of the file has.
            if hierarchy.source == *hash {
                match self.checked(hierarchy, file) {
                    Ok(complete) => return Ok(complete),
                    Err(error) => fault = error,
                }
            }
        }
        Err(fault)
    }

    /// The hierarchy, if it is valid and every referenced vertex has all attributes of this mesh.
    fn checked(&self, hierarchy: &Hierarchy, file: &str) -> Result<Hierarchy, LodError> {
        if !self.covers_moved_vertices(hierarchy) {
            return Err(LodError::MissingAttributes { file: file.into() });
        }
        let count = self.vertices.positions.len();
        if hierarchy.source_vertex_count as usize != count || hierarchy.validate().is_err() {
            return Err(LodError::Stale { file: file.into() });
        }
        Ok(hierarchy.clone())
    }

    /// Whether `hierarchy` has all attributes of moved vertices, or the source vertex of each.
    fn covers_moved_vertices(&self, hierarchy: &Hierarchy) -> bool {
        let held = attributes(&hierarchy.vertices);
        let mut pairs = attributes(&self.vertices).into_iter().zip(held);
        let holds_all = !self.has_other_attributes && pairs.all(|(own, held)| held || !own);
        let moves = hierarchy.vertices.positions.len() > hierarchy.source_vertex_count as usize;
        holds_all || !moves || !hierarchy.moved_from.is_empty()
    }

    /// The vertices with the `held` [attributes] only.
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

/// The indices of the mesh and of the primitive in a label of Bevy's glTF loader.
pub(super) fn place_in_gltf(label: &str) -> Option<[u32; 2]> {
    let (mesh, primitive) = label.strip_prefix("Mesh")?.split_once("/Primitive")?;
    Some([mesh.parse().ok()?, primitive.parse().ok()?])
}

/// Largest number of primitives that are baked together. With more, searches take longer, since each primitive searches
/// for all others; with fewer, more meshes may have cracks.
const MOST_IN_GROUP: usize = 64;

/// The primitives of the glTF mesh of `mesh` that are baked together, in order. `None` for other meshes, for a single
/// primitive, and for too many or too large ones: a group is in memory as a whole, and baked again if one of its meshes
/// changes.
pub(super) fn primitives_together<'a>(
    mesh: AssetId<Mesh>,
    most_triangles: usize,
    meshes: &'a Assets<Mesh>,
    assets: &AssetServer,
) -> Option<Vec<(AssetId<Mesh>, &'a Mesh)>> {
    let path = assets.get_path(mesh)?.into_owned();
    let [of_mesh, _] = place_in_gltf(path.label()?)?;
    let handle = |primitive| {
        let mesh = of_mesh as usize;
        let label = GltfAssetLabel::Primitive { mesh, primitive };
        assets.get_handle::<Mesh>(path.clone().with_label(label.to_string()))
    };
    // The loader numbers primitives without gaps.
    let handles = (0..).map_while(handle);
    let loaded = handles.filter_map(|handle| Some((handle.id(), meshes.get(&handle)?)));
    // Characters are baked from their file. Points and lines have no levels.
    let is_baked = |mesh: &Mesh| {
        mesh.primitive_topology() == PrimitiveTopology::TriangleList && !is_rigged(mesh)
    };
    let baked = loaded.filter(|(_, mesh)| is_baked(mesh));
    let found: Vec<(AssetId<Mesh>, &Mesh)> = baked.take(MOST_IN_GROUP + 1).collect();
    let triangles = found.iter().map(|(_, mesh)| triangle_count(mesh));
    let is_group = (2..=MOST_IN_GROUP).contains(&found.len())
        && found.iter().any(|(id, _)| *id == mesh)
        && triangles.fold(0, usize::saturating_add) < most_triangles;
    is_group.then_some(found)
}

/// The number of triangles of a mesh; the largest possible number if its data cannot be read.
pub(super) fn triangle_count(mesh: &Mesh) -> usize {
    // The task rejects an unreadable mesh with the reason.
    let corners = match mesh.try_indices_option() {
        Ok(Some(indices)) => Indices::len(indices),
        _ => mesh
            .try_attribute(Mesh::ATTRIBUTE_POSITION)
            .map_or(usize::MAX, VertexAttributeValues::len),
    };
    corners / 3
}

/// Which attributes are present, besides positions.
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

/// Copies an attribute into `vertices`. Returns `false` if hierarchies do not hold it, or not in this format.
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
