//! One entry per mesh asset: its hierarchy, shared by all its instances.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bevy::asset::AssetId;
use bevy::camera::primitives::Aabb;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::tasks::{AsyncComputeTaskPool, Task, block_on, poll_once};
use fieldlod_hierarchy::Hierarchy;

use crate::BakedLods;
use crate::prepare::{Origin, PrepareError, Prepared, prepare};
use crate::upload::UploadQueue;

/// The levels of detail of one mesh asset.
#[derive(Debug)]
pub(crate) struct LodMesh {
    pub(crate) hierarchy: Hierarchy,
    /// One per unit of the hierarchy.
    pub(crate) unit_meshes: Vec<Handle<Mesh>>,
    /// Whether the GPU has all unit meshes; set by the render world.
    pub(crate) uploaded: AtomicBool,
}

impl LodMesh {
    pub(crate) fn is_uploaded(&self) -> bool {
        self.uploaded.load(Ordering::Acquire)
    }

    /// The box of a unit, as Bevy's culling wants it.
    pub(crate) fn aabb_of(&self, unit: usize) -> Aabb {
        let aabb = self.hierarchy.units[unit].aabb;
        Aabb::from_min_max(aabb.min, aabb.max)
    }
}

enum Entry {
    Preparing(Task<Result<Prepared, PrepareError>>),
    Ready(Arc<LodMesh>),
    Failed,
}

/// All meshes with levels of detail.
#[derive(Resource, Default)]
pub(crate) struct LodLibrary {
    entries: HashMap<AssetId<Mesh>, Entry>,
}

/// What the library can say of a mesh.
pub(crate) enum Answer {
    Waiting,
    Ready(Arc<LodMesh>),
    Failed,
}

impl LodLibrary {
    pub(crate) fn answer(&self, mesh: AssetId<Mesh>) -> Answer {
        match self.entries.get(&mesh) {
            Some(Entry::Ready(lod)) => Answer::Ready(lod.clone()),
            Some(Entry::Failed) => Answer::Failed,
            Some(Entry::Preparing(_)) | None => Answer::Waiting,
        }
    }

    /// Forgets a mesh that changed or is gone.
    pub(crate) fn forget(&mut self, mesh: AssetId<Mesh>) -> bool {
        self.entries.remove(&mesh).is_some()
    }
}

/// Starts the task that prepares `mesh`, unless it was started before or something is still being
/// loaded.
pub(crate) fn request(
    library: &mut LodLibrary,
    mesh: AssetId<Mesh>,
    baked: Option<&Handle<BakedLods>>,
    meshes: &Assets<Mesh>,
    files: &Assets<BakedLods>,
    assets: &AssetServer,
) {
    if library.entries.contains_key(&mesh) {
        return;
    }
    let Some(source) = meshes.get(mesh) else {
        return;
    };
    let origin = match baked {
        None => Origin::Bake,
        Some(handle) => match files.get(handle) {
            Some(loaded) => Origin::File {
                name: asset_name(assets, handle.id().untyped()),
                file: Arc::new(loaded.file.clone()),
            },
            // The asset server has logged why.
            None if assets.load_state(handle).is_failed() => {
                library.entries.insert(mesh, Entry::Failed);
                return;
            }
            None => return,
        },
    };
    let source = source.clone();
    let task = AsyncComputeTaskPool::get().spawn(async move { prepare(&source, &origin) });
    library.entries.insert(mesh, Entry::Preparing(task));
}

/// Takes in the tasks that have ended.
pub(crate) fn collect_prepared(
    mut library: ResMut<LodLibrary>,
    mut meshes: ResMut<Assets<Mesh>>,
    uploads: Res<UploadQueue>,
    assets: Res<AssetServer>,
) {
    for (mesh, entry) in &mut library.entries {
        let Entry::Preparing(task) = entry else {
            continue;
        };
        let Some(result) = block_on(poll_once(task)) else {
            continue;
        };
        *entry = match result {
            Ok(prepared) => {
                let lod = Arc::new(LodMesh {
                    hierarchy: prepared.hierarchy,
                    unit_meshes: prepared
                        .unit_meshes
                        .into_iter()
                        .map(|mesh| meshes.add(mesh))
                        .collect(),
                    uploaded: AtomicBool::new(false),
                });
                uploads.push(lod.clone());
                Entry::Ready(lod)
            }
            Err(fault) => {
                let name = asset_name(&assets, mesh.untyped());
                match fault {
                    PrepareError::Morphed => info!("{name} is drawn as it is: {fault}"),
                    _ => error!("{name} is drawn without levels of detail: {fault}"),
                }
                Entry::Failed
            }
        };
    }
}

/// The path of an asset, or its id if it was made at run time.
pub(crate) fn asset_name(assets: &AssetServer, id: bevy::asset::UntypedAssetId) -> String {
    match assets.get_path(id) {
        Some(path) => path.to_string(),
        None => format!("the mesh {id:?}"),
    }
}
