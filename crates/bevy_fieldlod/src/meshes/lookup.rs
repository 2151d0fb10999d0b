//! Looks up the levels of detail of mesh assets, and starts a task for those that are not known yet.

use std::sync::Arc;

use bevy::asset::{AssetId, AssetPath};
use bevy::ecs::system::SystemParam;
use bevy::mesh::{Indices, VertexAttributeValues};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use fieldlod_hierarchy::BakedFile;

use super::prepare::{PrepareJob, PreparedMesh, prepare};
use super::sidecar::SidecarFiles;
use crate::baked_lods::BakedLods;
use crate::config::{FieldLodConfig, LodKind};
use crate::events::{FieldLodEvent, LodError, asset_name};
use crate::lod_mesh::LodMesh;

/// All meshes that levels of detail were asked for.
#[derive(Resource, Default)]
pub(crate) struct LodMeshes {
    pub(super) entries: HashMap<LookupKey, LodMeshEntry>,
    /// By the mesh of a level of a whole mesh, as long as that is there, its source.
    pub(super) source_of_level: HashMap<AssetId<Mesh>, AssetId<Mesh>>,
    pub(super) sidecars: Arc<SidecarFiles>,
}

/// A mesh and the kind of levels that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct LookupKey {
    pub(super) mesh: AssetId<Mesh>,
    pub(super) kind: LodKind,
}

/// What is known of a mesh.
pub(super) enum LodMeshEntry {
    /// A task is at work.
    Preparing(Task<Result<PreparedMesh, LodError>>),
    Ready(Arc<LodMesh>),
    /// The mesh is too small, or its levels failed, as was logged.
    Plain,
}

impl LodMeshes {
    /// The source of a mesh that is a level of a whole mesh, if it is there still.
    pub(crate) fn source_of_level(
        &self,
        level: AssetId<Mesh>,
        meshes: &mut ResMut<Assets<Mesh>>,
    ) -> Option<Handle<Mesh>> {
        match *self.source_of_level.get(&level)? {
            AssetId::Uuid { uuid } => Some(Handle::Uuid(uuid, default())),
            source => meshes.get_strong_handle(source),
        }
    }

    /// Forgets a mesh that changed or is gone, and returns the levels that it had.
    pub(crate) fn forget(&mut self, mesh: AssetId<Mesh>) -> Vec<Arc<LodMesh>> {
        self.source_of_level.remove(&mesh);
        let forgotten = self.entries.extract_if(|key, _| key.mesh == mesh);
        let levels = forgotten.filter_map(|(_, entry)| match entry {
            LodMeshEntry::Ready(mesh) => Some(mesh),
            _ => None,
        });
        levels.collect()
    }

    /// How many meshes are being prepared.
    pub(super) fn preparing(&self) -> usize {
        let is_preparing = |entry: &&LodMeshEntry| matches!(entry, LodMeshEntry::Preparing(_));
        self.entries.values().filter(is_preparing).count()
    }
}

/// Looks up the levels of detail of meshes.
#[derive(SystemParam)]
pub(super) struct LodMeshLookup<'w> {
    known: ResMut<'w, LodMeshes>,
    config: Res<'w, FieldLodConfig>,
    meshes: Res<'w, Assets<Mesh>>,
    files: Res<'w, Assets<BakedLods>>,
    assets: Res<'w, AssetServer>,
    events: MessageWriter<'w, FieldLodEvent>,
}

impl LodMeshLookup<'_> {
    /// What is known of `mesh`; `None` while something is being loaded. The first time, a task is started
    /// that prepares it, once all that it needs is loaded.
    pub(super) fn find(
        &mut self,
        mesh: AssetId<Mesh>,
        baked: Option<&Handle<BakedLods>>,
        kind: LodKind,
    ) -> Option<&LodMeshEntry> {
        // The first entity that asks starts the task; all others share its result.
        let key = LookupKey { mesh, kind };
        if !self.known.entries.contains_key(&key)
            && let Some(entry) = self.start(mesh, baked, kind)
        {
            self.known.entries.insert(key, entry);
        }
        self.known.entries.get(&key)
    }

    fn start(
        &mut self,
        mesh: AssetId<Mesh>,
        baked: Option<&Handle<BakedLods>>,
        asked: LodKind,
    ) -> Option<LodMeshEntry> {
        // Small meshes need no levels.
        let source = self.meshes.get(mesh)?;
        let kind = self.config.kind_for(asked, triangle_count(source));
        if kind == LodKind::Plain {
            return Some(LodMeshEntry::Plain);
        }
        // A file that was named must be there first.
        let file = match baked {
            Some(handle) => match self.file(handle)? {
                Ok(file) => Some(file),
                Err(error) => {
                    let event = FieldLodEvent::failed(&self.assets, mesh, error);
                    self.events.write(event);
                    return Some(LodMeshEntry::Plain);
                }
            },
            None => None,
        };
        // All else is the task's.
        let job = PrepareJob {
            mesh: source.clone(),
            name: asset_name(&self.assets, mesh.untyped()),
            kind,
            file,
            sidecar: self.sidecar(mesh),
            cache_folder: self.config.cache_folder.clone(),
            measure_deviations: self.config.measure_deviations,
        };
        let task = AsyncComputeTaskPool::get().spawn(prepare(job));
        Some(LodMeshEntry::Preparing(task))
    }

    /// A `.fieldlod` file, with its name; `None` while it is being loaded.
    fn file(
        &self,
        handle: &Handle<BakedLods>,
    ) -> Option<Result<(String, Arc<BakedFile>), LodError>> {
        let file = asset_name(&self.assets, handle.id().untyped());
        if let Some(loaded) = self.files.get(handle) {
            return Some(Ok((file, loaded.file.clone())));
        }
        let has_failed = self.assets.load_state(handle).is_failed();
        has_failed.then_some(Err(LodError::FileNotLoaded { file }))
    }

    /// Where to look for a file beside the asset that a mesh is part of, if that is wanted.
    fn sidecar(
        &self,
        mesh: AssetId<Mesh>,
    ) -> Option<(AssetServer, AssetPath<'static>, Arc<SidecarFiles>)> {
        if !self.config.look_beside_assets {
            return None;
        }
        let path = self.assets.get_path(mesh)?.into_owned();
        Some((self.assets.clone(), path, self.known.sidecars.clone()))
    }
}

fn triangle_count(mesh: &Mesh) -> usize {
    // What cannot be counted is refused, with its reason, by the task.
    let corners = match mesh.try_indices_option() {
        Ok(Some(indices)) => Indices::len(indices),
        _ => mesh
            .try_attribute(Mesh::ATTRIBUTE_POSITION)
            .map_or(usize::MAX, VertexAttributeValues::len),
    };
    corners / 3
}
