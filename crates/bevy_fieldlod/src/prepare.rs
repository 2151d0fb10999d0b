//! From a Bevy mesh to its hierarchy and the meshes of its units: the work of one background task.

use std::sync::Arc;

use bevy::math::{Vec2, Vec3};
use bevy::mesh::{Mesh, MeshAccessError, PrimitiveTopology, VertexAttributeValues};
use fieldlod_hierarchy::{BakedFile, Hierarchy, SourceHash};
use thiserror::Error;

use crate::gather::unit_mesh;

/// Where a mesh's hierarchy comes from.
#[derive(Clone, Debug)]
pub(crate) enum Origin {
    /// A `.fieldlod` file, named for messages.
    File { name: String, file: Arc<BakedFile> },
    /// Baked here and now.
    Bake,
}

/// A hierarchy and, for each of its units, the mesh that draws it.
#[derive(Debug)]
pub(crate) struct Prepared {
    pub(crate) hierarchy: Hierarchy,
    pub(crate) unit_meshes: Vec<Mesh>,
}

/// Why a mesh has no levels of detail.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// The vertices live on the GPU only.
    #[error("its data is not in main memory: load it with `RenderAssetUsages::MAIN_WORLD`")]
    NotInMainWorld,
    /// Points, lines or strips.
    #[error("it is not a triangle list but a {0:?}")]
    Topology(PrimitiveTopology),
    /// Morph targets move vertices at run time.
    #[error("it has morph targets")]
    Morphed,
    /// No positions, or not as three floats.
    #[error("it has no positions of three 32-bit floats")]
    NoPositions,
    /// The file holds other meshes, or an older version of this one.
    #[error("{file} holds no hierarchy that fits it: the file is stale, bake it again")]
    Stale {
        /// The `.fieldlod` file.
        file: String,
    },
    /// The mesh cannot be baked.
    #[cfg(feature = "bake")]
    #[error(transparent)]
    Bake(#[from] fieldlod_bake::MeshError),
    /// No file was given and baking is compiled out.
    #[cfg(not(feature = "bake"))]
    #[error("no .fieldlod file was given and the `bake` feature is off")]
    BakeDisabled,
}

impl From<MeshAccessError> for PrepareError {
    fn from(_: MeshAccessError) -> Self {
        Self::NotInMainWorld
    }
}

/// Finds or bakes the hierarchy of `mesh` and cuts it into unit meshes.
pub(crate) fn prepare(mesh: &Mesh, origin: &Origin) -> Result<Prepared, PrepareError> {
    let source = read_source(mesh)?;
    let hierarchy = match origin {
        Origin::File { name, file } => {
            find(file, &source).ok_or_else(|| PrepareError::Stale { file: name.clone() })?
        }
        Origin::Bake => bake(source)?,
    };
    let unit_meshes = hierarchy.units.iter();
    let unit_meshes = unit_meshes
        .map(|unit| unit_mesh(mesh, &hierarchy, unit))
        .collect::<Result<_, _>>()?;
    Ok(Prepared {
        hierarchy,
        unit_meshes,
    })
}

/// What simplification looks at, out of a Bevy mesh.
struct Source {
    positions: Vec<Vec3>,
    #[cfg_attr(
        not(feature = "bake"),
        expect(dead_code, reason = "only baking looks at it")
    )]
    normals: Vec<Vec3>,
    #[cfg_attr(
        not(feature = "bake"),
        expect(dead_code, reason = "only baking looks at it")
    )]
    uvs: Vec<Vec2>,
    indices: Vec<u32>,
}

fn read_source(mesh: &Mesh) -> Result<Source, PrepareError> {
    if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
        return Err(PrepareError::Topology(mesh.primitive_topology()));
    }
    if mesh.try_has_morph_targets()? {
        return Err(PrepareError::Morphed);
    }
    let Some(VertexAttributeValues::Float32x3(positions)) =
        mesh.try_attribute_option(Mesh::ATTRIBUTE_POSITION)?
    else {
        return Err(PrepareError::NoPositions);
    };
    let normals = match mesh.try_attribute_option(Mesh::ATTRIBUTE_NORMAL)? {
        Some(VertexAttributeValues::Float32x3(normals)) => to_vec3(normals),
        _ => Vec::new(),
    };
    let uvs = match mesh.try_attribute_option(Mesh::ATTRIBUTE_UV_0)? {
        Some(VertexAttributeValues::Float32x2(uvs)) => uvs.iter().map(|&uv| uv.into()).collect(),
        _ => Vec::new(),
    };
    let indices = match mesh.try_indices_option()? {
        Some(indices) => indices.iter().map(|index| index as u32).collect(),
        None => (0..positions.len() as u32).collect(),
    };
    Ok(Source {
        positions: to_vec3(positions),
        normals,
        uvs,
        indices,
    })
}

fn to_vec3(values: &[[f32; 3]]) -> Vec<Vec3> {
    values.iter().copied().map(Vec3::from).collect()
}

fn find(file: &BakedFile, source: &Source) -> Option<Hierarchy> {
    let hash = SourceHash::of(&source.positions, source.indices.iter().copied());
    let mut hierarchies = file.primitives.iter().map(|primitive| &primitive.hierarchy);
    hierarchies
        .find(|hierarchy| hierarchy.source == hash)
        .cloned()
}

#[cfg(feature = "bake")]
fn bake(source: Source) -> Result<Hierarchy, PrepareError> {
    let mesh = fieldlod_bake::SourceMesh {
        positions: source.positions,
        normals: source.normals,
        uvs: source.uvs,
        indices: source.indices,
    };
    Ok(fieldlod_bake::bake_mesh(&mesh, &Default::default())?)
}

#[cfg(not(feature = "bake"))]
fn bake(_: Source) -> Result<Hierarchy, PrepareError> {
    Err(PrepareError::BakeDisabled)
}
