//! One entry per mesh asset: its levels of detail, shared by all its instances.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bevy::asset::{AssetId, AssetPath, UntypedAssetId};
use bevy::camera::primitives::Aabb;
use bevy::ecs::system::SystemParam;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::tasks::{AsyncComputeTaskPool, Task, block_on, poll_once};
use fieldlod_hierarchy::BakedFile;
use fieldlod_select::MeshId;

use crate::prepare::{Beside, Job, LodError, Prepared, prepare};
use crate::upload::UploadQueue;
use crate::world::LodWorld;
use crate::{BakedLods, FieldLodConfig, FieldLodEvent, LodKind};

/// The levels of detail of one mesh asset.
#[derive(Debug)]
pub(crate) struct LodMesh {
    /// In the scene that is selected from.
    pub(crate) id: MeshId,
    /// [`LodKind::Chain`] or [`LodKind::Clusters`].
    pub(crate) kind: LodKind,
    /// One per unit of the hierarchy.
    pub(crate) pieces: Vec<Piece>,
    pub(crate) triangles_full: u32,
    /// Around all of it, in local space; `None` for a mesh of nothing.
    pub(crate) whole: Option<Aabb>,
    /// Area in texture coordinates for each unit of area in local space; 0 without any.
    pub(crate) uv_per_area: f32,
    /// Whether the GPU has all pieces; set by the render world.
    pub(crate) uploaded: AtomicBool,
}

/// What draws one unit.
#[derive(Debug)]
pub(crate) struct Piece {
    /// `None` for a whole mesh at its finest: the source mesh, which its instances hold.
    pub(crate) mesh: Option<Handle<Mesh>>,
    pub(crate) aabb: Aabb,
    /// 0 is the finest.
    pub(crate) level: u32,
    pub(crate) triangles: u32,
    /// How far it may lie from the source, in local units.
    #[cfg_attr(
        not(feature = "debug"),
        expect(dead_code, reason = "heat-maps show it")
    )]
    pub(crate) error_in_local: f32,
}

impl LodMesh {
    pub(crate) fn is_uploaded(&self) -> bool {
        self.uploaded.load(Ordering::Acquire)
    }

    /// Whether `mesh` is one of its pieces.
    pub(crate) fn has_piece(&self, mesh: AssetId<Mesh>) -> bool {
        let mut meshes = self.pieces.iter().filter_map(|piece| piece.mesh.as_ref());
        meshes.any(|piece| piece.id() == mesh)
    }
}

enum Entry {
    Preparing(Task<Result<Prepared, LodError>>),
    Ready(Arc<LodMesh>),
    /// Too small, or a fault that was told of.
    Plain,
}

/// A mesh and how it was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    mesh: AssetId<Mesh>,
    kind: LodKind,
}

/// All meshes with levels of detail.
#[derive(Resource, Default)]
pub(crate) struct LodLibrary {
    entries: HashMap<Key, Entry>,
    beside: Arc<Beside>,
}

/// What the library can say of a mesh.
pub(crate) enum Answer {
    Waiting,
    Ready(Arc<LodMesh>),
    Plain,
}

impl LodLibrary {
    /// Forgets a mesh that changed or is gone, and hands out what it knew.
    pub(crate) fn forget(&mut self, mesh: AssetId<Mesh>) -> impl Iterator<Item = Arc<LodMesh>> {
        let gone = self.entries.extract_if(move |key, _| key.mesh == mesh);
        let gone: Vec<Entry> = gone.map(|(_, entry)| entry).collect();
        gone.into_iter().filter_map(|entry| match entry {
            Entry::Ready(mesh) => Some(mesh),
            _ => None,
        })
    }

    /// How many meshes are being prepared.
    pub(crate) fn preparing(&self) -> usize {
        let entries = self.entries.values();
        entries
            .filter(|entry| matches!(entry, Entry::Preparing(_)))
            .count()
    }
}

/// Why there is no `.fieldlod` file yet, or never will be.
enum NoFile {
    Loading,
    Failed(LodError),
}

/// Asks for the levels of detail of meshes.
#[derive(SystemParam)]
pub(crate) struct Librarian<'w> {
    library: ResMut<'w, LodLibrary>,
    config: Res<'w, FieldLodConfig>,
    meshes: Res<'w, Assets<Mesh>>,
    files: Res<'w, Assets<BakedLods>>,
    assets: Res<'w, AssetServer>,
    events: MessageWriter<'w, FieldLodEvent>,
}

impl Librarian<'_> {
    /// What is known of `mesh`. The first time, a task is started that prepares it, once all that it
    /// needs is loaded.
    pub(crate) fn ask(
        &mut self,
        mesh: AssetId<Mesh>,
        baked: Option<&Handle<BakedLods>>,
        kind: LodKind,
    ) -> Answer {
        let key = Key { mesh, kind };
        if !self.library.entries.contains_key(&key)
            && let Some(entry) = self.start(mesh, baked, kind)
        {
            self.library.entries.insert(key, entry);
        }
        match self.library.entries.get(&key) {
            Some(Entry::Ready(lod)) => Answer::Ready(lod.clone()),
            Some(Entry::Plain) => Answer::Plain,
            Some(Entry::Preparing(_)) | None => Answer::Waiting,
        }
    }

    fn start(
        &mut self,
        mesh: AssetId<Mesh>,
        baked: Option<&Handle<BakedLods>>,
        kind: LodKind,
    ) -> Option<Entry> {
        let source = self.meshes.get(mesh)?;
        let kind = self.config.kind_for(kind, triangle_count(source));
        if kind == LodKind::Plain {
            return Some(Entry::Plain);
        }
        let file = match baked.map(|handle| self.file(handle)).transpose() {
            Ok(file) => file,
            Err(NoFile::Loading) => return None,
            Err(NoFile::Failed(fault)) => {
                self.events.write(failed(&self.assets, mesh, fault));
                return Some(Entry::Plain);
            }
        };
        let job = Job {
            mesh: source.clone(),
            name: asset_name(&self.assets, mesh.untyped()),
            kind,
            file,
            beside: self.beside(mesh),
            cache_folder: self.config.cache_folder.clone(),
        };
        let task = AsyncComputeTaskPool::get().spawn(prepare(job));
        Some(Entry::Preparing(task))
    }

    /// A loaded `.fieldlod` file, with its name.
    fn file(&self, handle: &Handle<BakedLods>) -> Result<(String, Arc<BakedFile>), NoFile> {
        let file = asset_name(&self.assets, handle.id().untyped());
        match self.files.get(handle) {
            Some(loaded) => Ok((file, loaded.file.clone())),
            None if self.assets.load_state(handle).is_failed() => {
                Err(NoFile::Failed(LodError::FileNotLoaded { file }))
            }
            None => Err(NoFile::Loading),
        }
    }

    /// Where to look for a file beside the asset that a mesh is part of, if that is wanted.
    fn beside(
        &self,
        mesh: AssetId<Mesh>,
    ) -> Option<(AssetServer, AssetPath<'static>, Arc<Beside>)> {
        if !self.config.look_beside_assets {
            return None;
        }
        let path = self.assets.get_path(mesh)?.into_owned();
        Some((self.assets.clone(), path, self.library.beside.clone()))
    }
}

fn triangle_count(mesh: &Mesh) -> usize {
    // What cannot be counted is refused, with its reason, by the task.
    let indices = mesh.try_indices_option().ok().flatten();
    let corners = indices.map_or_else(
        || {
            mesh.try_attribute(Mesh::ATTRIBUTE_POSITION)
                .map_or(usize::MAX, bevy::mesh::VertexAttributeValues::len)
        },
        bevy::mesh::Indices::len,
    );
    corners / 3
}

/// Whether any task is at work.
pub(crate) fn any_preparing(library: Res<LodLibrary>) -> bool {
    library.preparing() > 0
}

/// Takes in the tasks that have ended.
pub(crate) fn collect_prepared(
    mut library: ResMut<LodLibrary>,
    mut world: ResMut<LodWorld>,
    mut meshes: ResMut<Assets<Mesh>>,
    uploads: Res<UploadQueue>,
    assets: Res<AssetServer>,
    mut events: MessageWriter<FieldLodEvent>,
) {
    let mut preparing = 0;
    for (key, entry) in &mut library.entries {
        let Entry::Preparing(task) = entry else {
            continue;
        };
        let Some(result) = block_on(poll_once(task)) else {
            preparing += 1;
            continue;
        };
        let (new_entry, event) = match result {
            Ok(prepared) => {
                let event = FieldLodEvent::Ready {
                    mesh: key.mesh,
                    kind: prepared.kind,
                    origin: prepared.origin,
                    path: asset_path(&assets, key.mesh),
                };
                let lod = take_in(prepared, &mut world, &mut meshes);
                uploads.push(lod.clone());
                (Entry::Ready(lod), event)
            }
            Err(fault) => (Entry::Plain, failed(&assets, key.mesh, fault)),
        };
        *entry = new_entry;
        events.write(event);
    }
    if preparing == 0 {
        library.beside.clear();
    }
}

fn take_in(prepared: Prepared, world: &mut LodWorld, meshes: &mut Assets<Mesh>) -> Arc<LodMesh> {
    let pieces = prepared.pieces.into_iter().map(|piece| Piece {
        mesh: piece.mesh.map(|mesh| meshes.add(mesh)),
        aabb: piece.aabb,
        level: piece.level,
        triangles: piece.triangles,
        error_in_local: piece.error_in_local,
    });
    Arc::new(LodMesh {
        id: world.add_mesh(prepared.table),
        kind: prepared.kind,
        pieces: pieces.collect(),
        triangles_full: prepared.triangles_full,
        whole: prepared.whole,
        uv_per_area: prepared.uv_per_area,
        uploaded: AtomicBool::new(false),
    })
}

/// Logs a fault and makes an event of it.
fn failed(assets: &AssetServer, mesh: AssetId<Mesh>, fault: LodError) -> FieldLodEvent {
    let name = asset_name(assets, mesh.untyped());
    match fault {
        LodError::Morphed => info!("{name} is drawn as it is: {fault}"),
        _ => error!("{name} is drawn without levels of detail: {fault}"),
    }
    FieldLodEvent::Failed {
        mesh,
        path: asset_path(assets, mesh),
        fault,
    }
}

fn asset_path(assets: &AssetServer, mesh: AssetId<Mesh>) -> Option<String> {
    assets.get_path(mesh).map(|path| path.to_string())
}

/// The path of an asset, or its id if it was made at run time.
pub(crate) fn asset_name(assets: &AssetServer, id: UntypedAssetId) -> String {
    match assets.get_path(id) {
        Some(path) => path.to_string(),
        None => format!("the mesh {id:?}"),
    }
}
