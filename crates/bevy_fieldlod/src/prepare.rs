//! From a Bevy mesh to its hierarchy and the meshes of its units: the work of one background task.

mod beside;
mod cache;
mod source;

use std::path::PathBuf;
use std::sync::Arc;

use bevy::asset::{AssetPath, AssetServer, RenderAssetUsages};
use bevy::camera::primitives::Aabb;
use bevy::log::warn;
use bevy::mesh::{Mesh, MeshAccessError, PrimitiveTopology};
use fieldlod_hierarchy::{BakedFile, Hierarchy, Unit};
use fieldlod_select::{GroupTable, chain_of};
use thiserror::Error;

use crate::gather::unit_mesh;
use crate::{LodKind, LodOrigin};
pub(crate) use beside::Beside;
use source::{Source, find_in};

/// What a background task is asked to do.
pub(crate) struct Job {
    pub(crate) mesh: Mesh,
    /// For messages.
    pub(crate) name: String,
    pub(crate) kind: LodKind,
    /// A `.fieldlod` file, named for messages, that must hold the hierarchy.
    pub(crate) file: Option<(String, Arc<BakedFile>)>,
    /// Where the mesh was loaded from, to look for a file there.
    pub(crate) beside: Option<(AssetServer, AssetPath<'static>, Arc<Beside>)>,
    pub(crate) cache_folder: Option<PathBuf>,
}

/// A mesh with levels of detail, but for its place in the world's collections.
pub(crate) struct Prepared {
    pub(crate) kind: LodKind,
    pub(crate) origin: LodOrigin,
    pub(crate) table: GroupTable,
    pub(crate) pieces: Vec<PreparedPiece>,
    pub(crate) triangles_full: u32,
    pub(crate) whole: Option<Aabb>,
    pub(crate) uv_per_area: f32,
}

/// What draws one unit.
pub(crate) struct PreparedPiece {
    /// `None` for a whole mesh at its finest: the source mesh.
    pub(crate) mesh: Option<Mesh>,
    pub(crate) aabb: Aabb,
    pub(crate) level: u32,
    pub(crate) triangles: u32,
    /// How far it may lie from the source, in local units.
    pub(crate) error_in_local: f32,
}

/// Why a mesh has no levels of detail.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LodError {
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
    /// The file could not be loaded; the asset server has logged why.
    #[error("{file} could not be loaded")]
    FileNotLoaded {
        /// The `.fieldlod` file.
        file: String,
    },
    /// The mesh cannot be baked.
    #[cfg(feature = "bake")]
    #[error(transparent)]
    Bake(#[from] fieldlod_bake::MeshError),
    /// No file was found and baking is compiled out.
    #[cfg(not(feature = "bake"))]
    #[error("no .fieldlod file was found and the `bake` feature is off")]
    BakeDisabled,
}

impl From<MeshAccessError> for LodError {
    fn from(_: MeshAccessError) -> Self {
        Self::NotInMainWorld
    }
}

/// Finds or bakes the hierarchy of a mesh and cuts it into the meshes to draw.
pub(crate) async fn prepare(job: Job) -> Result<Prepared, LodError> {
    let source = Source::of(&job.mesh)?;
    let uv_per_area = source.uv_per_area();
    let (hierarchy, origin) = hierarchy_of(&job, source).await?;
    let triangles_full = hierarchy.source_triangle_count() as u32;
    let chain = match job.kind {
        LodKind::Chain => chain_of(&hierarchy),
        _ => None,
    };
    let (kind, hierarchy) = match chain {
        Some(chain) => (LodKind::Chain, chain),
        None => (LodKind::Clusters, hierarchy),
    };
    Ok(Prepared {
        kind,
        origin,
        table: GroupTable::new(&hierarchy),
        pieces: pieces_of(&job.mesh, &hierarchy, kind)?,
        triangles_full,
        whole: hierarchy
            .aabb()
            .map(|whole| Aabb::from_min_max(whole.min, whole.max)),
        uv_per_area,
    })
}

/// The meshes of all units.
fn pieces_of(
    source: &Mesh,
    hierarchy: &Hierarchy,
    kind: LodKind,
) -> Result<Vec<PreparedPiece>, MeshAccessError> {
    // Rays are cast at the source of units, but at the level that a chain wears.
    let usage = match kind {
        LodKind::Chain => source.asset_usage,
        _ => RenderAssetUsages::RENDER_WORLD,
    };
    let piece = |(index, unit): (usize, &Unit)| {
        let is_source = kind == LodKind::Chain && index == 0;
        let mesh = (!is_source).then(|| unit_mesh(source, hierarchy, unit, usage));
        let producer = unit
            .producer()
            .map(|group| &hierarchy.groups[group as usize]);
        Ok(PreparedPiece {
            mesh: mesh.transpose()?,
            aabb: Aabb::from_min_max(unit.aabb.min, unit.aabb.max),
            level: hierarchy.level_of(unit),
            triangles: unit.triangle_count,
            error_in_local: producer.map_or(0.0, |group| group.error_in_local),
        })
    };
    hierarchy.units.iter().enumerate().map(piece).collect()
}

/// From the file that was named, else from one beside the asset, else from the cache, else baked.
async fn hierarchy_of(job: &Job, source: Source) -> Result<(Hierarchy, LodOrigin), LodError> {
    let hash = source.hash();
    if let Some((file, baked)) = &job.file {
        let found = find_in(baked, hash).ok_or_else(|| LodError::Stale { file: file.clone() });
        return Ok((found?, LodOrigin::File));
    }
    if let Some((assets, path, beside)) = &job.beside
        && let Some((file, baked)) = beside.find(assets, path).await
    {
        match find_in(&baked, hash) {
            Some(found) => return Ok((found, LodOrigin::BesideAsset)),
            None => warn!(
                "{}: {file} holds no hierarchy that fits it: the file is stale, bake it again",
                job.name
            ),
        }
    }
    let entry = job.cache_folder.as_ref();
    let entry = entry.map(|folder| folder.join(source.cache_name()));
    if let Some(found) = entry.as_ref().and_then(|path| cache::read(path, hash)) {
        return Ok((found, LodOrigin::Cache));
    }
    let baked = bake(source)?;
    if let Some(path) = &entry {
        cache::write(path, &baked);
    }
    Ok((baked, LodOrigin::Baked))
}

#[cfg(feature = "bake")]
fn bake(source: Source) -> Result<Hierarchy, LodError> {
    let mesh = fieldlod_bake::SourceMesh {
        positions: source.positions,
        normals: source.normals,
        uvs: source.uvs,
        indices: source.indices,
    };
    Ok(fieldlod_bake::bake_mesh(&mesh, &Default::default())?)
}

#[cfg(not(feature = "bake"))]
fn bake(_: Source) -> Result<Hierarchy, LodError> {
    Err(LodError::BakeDisabled)
}
