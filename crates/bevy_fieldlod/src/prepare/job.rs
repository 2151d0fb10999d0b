//! Prepares one mesh in a background task: finds or bakes its hierarchy, and cuts it into the meshes of its units.

use std::sync::{Arc, OnceLock};

use bevy::asset::{AssetPath, AssetServer, RenderAssetUsages};
use bevy::camera::primitives::Aabb;
use bevy::log::warn;
use bevy::mesh::{Mesh, MeshAccessError};
use fieldlod_hierarchy::{BakedFile, Hierarchy, Unit};
use fieldlod_select::GroupTable;

#[cfg(feature = "bake")]
use super::bake::{BakeJob, RiggedBake};
use super::sidecar::SidecarFiles;
use super::source_arrays::SourceArrays;
use crate::api::config::LodKind;
use crate::api::events::{LodError, LodOrigin};
use crate::scene::lod_mesh::{KeepOfLevels, Kept, LodPiece};
use crate::scene::rig::{Rig, is_rigged};
use crate::scene::unit_mesh::{UnitMeshes, unit_mesh};

/// The input of a background task.
pub(super) struct PrepareJob {
    pub(super) mesh: Mesh,
    /// The name of the mesh in messages.
    pub(super) name: String,
    /// Indices of the mesh in its glTF file and of the primitive in the mesh, if it is from a glTF file.
    pub(super) place: Option<[u32; 2]>,
    /// [`LodKind::WholeMesh`] or [`LodKind::Clusters`]; [`LodKind::Auto`] if the levels decide.
    pub(super) kind: LodKind,
    /// Whether the meshes of all units are made and uploaded before any is drawn. With a limit of uploads per frame, a
    /// unit whose mesh is made when a view first draws it would be missing for some frames.
    pub(super) all_units: bool,
    pub(super) keep: Option<KeepOfLevels>,
    /// Sources of the hierarchy. The first that has one is used.
    pub(super) sources: Vec<LevelSource>,
}

/// A source of a hierarchy.
pub(super) enum LevelSource {
    /// A `.fieldlod` file, with its name for messages. It must contain the hierarchy.
    File(String, Arc<BakedFile>),
    /// A `.fieldlod` file beside the asset with this path, if it exists and is not stale.
    BesideAsset(AssetServer, AssetPath<'static>, Arc<SidecarFiles>),
    /// The cache, then a bake.
    #[cfg(feature = "bake")]
    Bake(BakeJob),
    /// The cache, then a bake of all skinned and morphed primitives of the glTF file.
    #[cfg(feature = "bake")]
    BakeRigged(RiggedBake),
}

/// A hierarchy, and where it comes from.
pub(super) struct FoundLevels {
    pub(super) hierarchy: Hierarchy,
    pub(super) origin: LodOrigin,
    /// Whether a cache or a file has it, so that it can be loaded again.
    pub(super) is_stored: bool,
}

impl FoundLevels {
    /// A hierarchy that was read from `origin`.
    pub(super) fn stored(hierarchy: Hierarchy, origin: LodOrigin) -> Self {
        Self {
            hierarchy,
            origin,
            is_stored: true,
        }
    }
}

/// A mesh with levels of detail that is not yet in the scene and the assets.
pub(crate) struct PreparedMesh {
    /// [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
    pub(crate) kind: LodKind,
    pub(crate) origin: LodOrigin,
    /// Whether a cache or a file has the levels, so that they can be loaded again.
    pub(crate) is_stored: bool,
    /// `None` unless joints or morph targets move the vertices.
    pub(crate) rig: Option<Rig>,
    pub(crate) table: GroupTable,
    /// One per unit of the hierarchy.
    pub(crate) pieces: Vec<LodPiece>,
    /// The meshes of units that are on the GPU before any is drawn.
    pub(crate) meshes: Vec<(u32, Mesh)>,
    /// Makes the meshes of units when they are first drawn.
    pub(crate) units: Option<UnitMeshes>,
    pub(crate) triangles_full: u32,
    /// Whether the bake measured deviations.
    pub(crate) is_measured: bool,
    /// By [`KeepOfLevels`].
    pub(crate) kept: Option<Kept>,
}

/// Finds or bakes the hierarchy of a mesh and cuts it into the meshes to draw.
pub(super) async fn prepare(job: PrepareJob) -> Result<PreparedMesh, LodError> {
    let source = SourceArrays::of(&job.mesh)?;
    let found = find_hierarchy(&job, source).await?;
    let baked = found.hierarchy;
    let is_measured = baked.is_measured();
    let triangles_full = baked.source_triangle_count() as u32;
    // A large primitive may change levels together with small ones. Units would have other levels in some views.
    let is_whole = job.kind == LodKind::WholeMesh
        || job.kind == LodKind::Auto && baked.is_chain_of_whole_meshes();
    // Indices of a level have 16 bits. A mesh with a larger level is drawn as units.
    let whole_meshes = if is_whole {
        baked.whole_mesh_levels()
    } else {
        None
    };
    let rig = is_rigged(&job.mesh).then_some(Rig {
        carrier_joint: baked.carrier_joint,
    });
    let (kind, hierarchy) = match whole_meshes {
        Some(levels) => (LodKind::WholeMesh, levels),
        // Units have no bounds in other poses.
        None if rig.is_some() => return Err(LodError::Rigged),
        None => (LodKind::Clusters, baked),
    };
    let pieces = hierarchy.units.iter().map(|unit| {
        let aabb = Aabb::from_min_max(unit.aabb.min, unit.aabb.max);
        piece_of(&hierarchy, unit, OnceLock::from(aabb))
    });
    Ok(PreparedMesh {
        kind,
        origin: found.origin,
        is_stored: found.is_stored,
        rig,
        table: GroupTable::new(&hierarchy),
        pieces: pieces.collect(),
        meshes: meshes_of(&job, &hierarchy, kind)?,
        kept: job.keep.map(|KeepOfLevels(keep)| keep(&hierarchy)),
        units: (kind == LodKind::Clusters && !job.all_units).then(|| UnitMeshes::new(hierarchy)),
        triangles_full,
        is_measured,
    })
}

/// Takes the hierarchy from the first source that has it.
async fn find_hierarchy(job: &PrepareJob, mesh: SourceArrays) -> Result<FoundLevels, LodError> {
    for source in &job.sources {
        match source {
            LevelSource::File(file, baked) => {
                let found = mesh.find_hierarchy(baked, job.place, file)?;
                return Ok(FoundLevels::stored(found, LodOrigin::File));
            }
            LevelSource::BesideAsset(assets, path, sidecars) => {
                if let Some((file, baked)) = sidecars.find(assets, path).await {
                    match find_beside_asset(job, &mesh, &file, &baked) {
                        Ok(found) => {
                            return Ok(FoundLevels::stored(found, LodOrigin::BesideAsset));
                        }
                        // A stale file must not stop a game in development from being drawn with levels.
                        Err(error) => {
                            let name = &job.name;
                            warn!("could not use levels of {name}: {error}; trying other sources");
                        }
                    }
                }
            }
            #[cfg(feature = "bake")]
            LevelSource::Bake(bake) => return bake.run(mesh),
            #[cfg(feature = "bake")]
            LevelSource::BakeRigged(bake) => return bake.run(&mesh),
        }
    }
    Err(match job.place {
        None if is_rigged(&job.mesh) => LodError::Rigged,
        _ => LodError::BakeDisabled,
    })
}

/// The hierarchy of a mesh in a file beside its asset. The file must also fit the meshes that a bake would include.
fn find_beside_asset(
    job: &PrepareJob,
    mesh: &SourceArrays,
    file: &str,
    baked: &BakedFile,
) -> Result<Hierarchy, LodError> {
    let found = mesh.find_hierarchy(baked, job.place, file)?;
    #[cfg(feature = "bake")]
    for source in &job.sources {
        if let LevelSource::Bake(bake) = source {
            bake.check_others(baked, file)?;
        }
    }
    Ok(found)
}

/// The meshes of units that are not made later.
fn meshes_of(
    job: &PrepareJob,
    hierarchy: &Hierarchy,
    kind: LodKind,
) -> Result<Vec<(u32, Mesh)>, MeshAccessError> {
    let source = &job.mesh;
    let is_drawable = source.asset_usage.contains(RenderAssetUsages::RENDER_WORLD);
    let has_mesh = |index: u32| match kind {
        // Level 0 is the source itself, unless the source is in main memory only.
        LodKind::WholeMesh => index > 0 || !is_drawable,
        _ => job.all_units,
    };
    let units = (0..).zip(&hierarchy.units);
    let units = units.filter(|(index, _)| has_mesh(*index));
    let meshes = units.map(|(index, unit)| Ok((index, unit_mesh(source, hierarchy, 0, unit)?)));
    meshes.collect()
}

/// The piece of a unit.
pub(crate) fn piece_of(hierarchy: &Hierarchy, unit: &Unit, aabb: OnceLock<Aabb>) -> LodPiece {
    LodPiece {
        aabb,
        level: hierarchy.level_of(unit),
        // The finest units are source geometry, which no group produced.
        #[cfg(feature = "debug")]
        error_in_local: unit
            .producer()
            .map_or(0.0, |group| hierarchy.groups[group as usize].error_in_local),
    }
}
