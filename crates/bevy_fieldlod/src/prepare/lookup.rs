//! Looks up the levels of detail of mesh assets, and starts a task for those that are not known yet.

use std::sync::Arc;

use bevy::asset::{AssetId, AssetPath};
use bevy::ecs::system::SystemParam;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::tasks::Task;
#[cfg(feature = "bake")]
use fieldlod_bake::BakeConfig;
use fieldlod_hierarchy::BakedFile;

#[cfg(feature = "bake")]
use super::bake::BakeJob;
#[cfg(feature = "bake")]
use super::bake::surfaces::{Materials, Surfaces};
#[cfg(feature = "bake")]
use super::bake::together::{AllTogether, Candidates, Member};
use super::changing::ChangingMeshes;
use super::job::{PrepareJob, PreparedMesh, prepare, prepare_pages};
use super::sidecar::SidecarFiles;
use super::source_arrays::{place_in_gltf, triangle_count};
use super::threads::PrepareThreads;
use crate::api::auto_lod::AutoLod;
use crate::api::config::{FieldLodConfig, LodKind};
use crate::api::events::{FieldLodEvent, LodError, asset_name};
use crate::assets::baked_lods::BakedLods;
use crate::cards::card_levels::CardLevels;
use crate::cards::{may_be_cards, stand_for};
use crate::pages::mesh_in_pages::MeshInPages;
use crate::scene::lod_mesh::{LodMesh, LodRequest};

/// All meshes that levels of detail were asked for.
#[derive(Resource, Default)]
pub(crate) struct LodMeshes {
    /// By mesh, what is known for each request.
    entries: HashMap<AssetId<Mesh>, Vec<(LodRequest, LodMeshEntry)>>,
    /// By the mesh of a level of a whole mesh, as long as that is there, its source.
    pub(super) source_of_level: HashMap<AssetId<Mesh>, AssetId<Mesh>>,
    /// The file that the levels of a mesh come from, or should.
    file_of: HashMap<AssetId<Mesh>, AssetId<BakedLods>>,
    /// By the mesh that draws the coarsest cut, where all else is read from in parts.
    pages_of: HashMap<AssetId<Mesh>, MeshInPages>,
    pub(super) sidecars: Arc<SidecarFiles>,
    pub(super) in_preparation: InPreparation,
    pub(super) changing: ChangingMeshes,
    /// What was asked for in this frame, and cannot be started yet.
    not_yet: HashMap<AssetId<Mesh>, Vec<LodRequest>>,
    #[cfg(feature = "bake")]
    pub(super) together: AllTogether,
    #[cfg(feature = "bake")]
    pub(super) surfaces: Surfaces,
    threads: Option<PrepareThreads>,
}

/// How much is being prepared.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InPreparation {
    pub(super) meshes: u32,
    triangles: u32,
}

/// Meshes that wait for a thread beside those that have one: each is a copy of its source.
const MOST_IN_PREPARATION: u32 = 64;

impl InPreparation {
    fn with(self, triangles: u32) -> Self {
        Self {
            meshes: self.meshes + 1,
            triangles: self.triangles.saturating_add(triangles),
        }
    }

    /// Whether there is room for a mesh of so many triangles more.
    fn has_room(self, triangles: u32, config: &FieldLodConfig) -> bool {
        let with = self.with(triangles);
        self.meshes == 0
            || with.meshes <= MOST_IN_PREPARATION && with.triangles <= config.triangles_at_once
    }
}

/// What is known of a mesh.
pub(super) enum LodMeshEntry {
    /// A task is at work on a mesh of so many triangles.
    Preparing(Task<Result<PreparedMesh, LodError>>, u32),
    Ready(Arc<LodMesh>),
    /// The mesh is drawn as it is; with an error if it should have levels.
    Plain(Option<LodError>),
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
        #[cfg(feature = "bake")]
        self.together.forget(mesh);
        let forgotten = self.entries.remove(&mesh).unwrap_or_default();
        if !forgotten.is_empty() {
            self.count_in_preparation();
        }
        let levels = forgotten.into_iter().filter_map(|(_, entry)| match entry {
            LodMeshEntry::Ready(mesh) => Some(mesh),
            _ => None,
        });
        levels.collect()
    }

    /// Forgets what else is known of a mesh that is gone.
    pub(crate) fn forget_source(&mut self, mesh: AssetId<Mesh>) {
        self.source_of_level.remove(&mesh);
        self.file_of.remove(&mesh);
        self.pages_of.remove(&mesh);
        self.changing.forget(mesh);
        #[cfg(feature = "bake")]
        self.together.forget_source(mesh);
    }

    /// Lets the levels of a mesh, which draws the coarsest cut, be read in parts.
    pub(crate) fn set_pages(&mut self, coarsest: AssetId<Mesh>, pages: MeshInPages) {
        self.pages_of.insert(coarsest, pages);
    }

    /// The meshes that `file` has levels of; with `only_failed`, those that have got none.
    pub(crate) fn meshes_of_file(
        &self,
        file: AssetId<BakedLods>,
        only_failed: bool,
    ) -> Vec<AssetId<Mesh>> {
        let has_failed = |mesh: AssetId<Mesh>| {
            let mut entries = self.entries.get(&mesh).into_iter().flatten();
            entries.all(|(_, entry)| matches!(entry, LodMeshEntry::Plain(_)))
        };
        let meshes = self.file_of.iter().filter(|(_, of)| **of == file);
        meshes
            .map(|(mesh, _)| *mesh)
            .filter(|mesh| !only_failed || has_failed(*mesh))
            .collect()
    }

    /// The meshes that are drawn as units, of which only the GPU has the pieces.
    pub(crate) fn meshes_in_units(&self) -> Vec<AssetId<Mesh>> {
        let is_in_units = |entry: &LodMeshEntry| matches!(entry, LodMeshEntry::Ready(mesh) if mesh.kind == LodKind::Clusters);
        let meshes = self.entries.iter();
        meshes
            .filter(|(_, entries)| entries.iter().any(|(_, entry)| is_in_units(entry)))
            .map(|(mesh, _)| *mesh)
            .collect()
    }

    /// Notes that a program has changed a mesh, and returns whether levels of it were known until now.
    pub(crate) fn note_change(&mut self, mesh: AssetId<Mesh>, assets: &AssetServer) -> bool {
        #[cfg(feature = "bake")]
        self.together.forget(mesh);
        let is_known = self.entries.contains_key(&mesh);
        self.changing.note(mesh, is_known, assets);
        is_known
    }

    /// Ends a frame for changing meshes, and returns those that are at rest now, with all that was baked with them.
    pub(crate) fn take_rested(&mut self) -> Vec<AssetId<Mesh>> {
        let rested = self.changing.take_rested();
        #[cfg(feature = "bake")]
        let rested = rested
            .into_iter()
            .flat_map(|mesh| self.together.with_others(mesh))
            .collect();
        rested
    }

    /// All that is known, each with its mesh.
    pub(super) fn entries_mut(
        &mut self,
    ) -> impl Iterator<Item = (AssetId<Mesh>, &mut LodMeshEntry)> {
        let meshes = self.entries.iter_mut();
        meshes.flat_map(|(mesh, entries)| entries.iter_mut().map(|(_, entry)| (*mesh, entry)))
    }

    /// Counts what is being prepared.
    pub(super) fn count_in_preparation(&mut self) {
        let entries = self.entries.values().flatten();
        let triangles = entries.filter_map(|(_, entry)| match entry {
            LodMeshEntry::Preparing(_, triangles) => Some(*triangles),
            _ => None,
        });
        self.in_preparation = triangles.fold(InPreparation::default(), InPreparation::with);
    }
}

/// Tells the material of an entity with a mesh.
pub(super) type MaterialOf<'a> = dyn Fn(AssetId<Mesh>) -> Option<AssetId<StandardMaterial>> + 'a;

/// Looks up the levels of detail of meshes.
#[derive(SystemParam)]
pub(super) struct LodMeshLookup<'w> {
    known: ResMut<'w, LodMeshes>,
    config: Res<'w, FieldLodConfig>,
    meshes: Res<'w, Assets<Mesh>>,
    files: Res<'w, Assets<BakedLods>>,
    #[cfg(feature = "bake")]
    materials: Materials<'w>,
    standard: Option<Res<'w, Assets<StandardMaterial>>>,
    images: Option<Res<'w, Assets<Image>>>,
    assets: Res<'w, AssetServer>,
    events: MessageWriter<'w, FieldLodEvent>,
}

impl LodMeshLookup<'_> {
    /// Lets what could not be started in the last frame be tried again.
    pub(super) fn try_again(&mut self) {
        if !self.known.not_yet.is_empty() {
            self.known.not_yet.clear();
        }
    }

    /// What is known of `mesh`; `None` while something is being loaded. The first time, a task is started
    /// that prepares it, once all that it needs is loaded; a bake goes by the materials that
    /// meshes have then. The levels have no cards if the entity does not allow them, or its material.
    pub(super) fn find(
        &mut self,
        mesh: AssetId<Mesh>,
        auto_lod: &AutoLod,
        allows_cards: bool,
        material_of: &MaterialOf<'_>,
    ) -> Option<&LodMeshEntry> {
        // A mesh that changes is drawn as it is until it rests.
        if self.known.changing.contains(mesh) {
            return Some(&LodMeshEntry::Plain(None));
        }
        // All entities share what is read in parts.
        let request = match self.known.pages_of.contains_key(&mesh) {
            true => LodRequest::of(&AutoLod::default()),
            false => LodRequest::of(auto_lod),
        };
        let without_cards = LodRequest {
            may_be_cards: false,
            ..request.clone()
        };
        // Cards that nothing is drawn as need not be baked. All else shares what has none.
        let mut index = match self.bakes_cards(mesh, &request)?
            && !(allows_cards && self.may_be_cards(None, material_of(mesh))?)
        {
            true => self.find_or_start(mesh, &without_cards, material_of)?,
            false => self.find_or_start(mesh, &request, material_of)?,
        };
        if let LodMeshEntry::Ready(lod) = &self.known.entries[&mesh][index].1
            && let Some(cards) = &lod.cards
            && !(allows_cards && self.may_be_cards(Some(cards), material_of(mesh))?)
        {
            index = self.find_or_start(mesh, &without_cards, material_of)?;
        }
        Some(&self.known.entries[&mesh][index].1)
    }

    /// Whether a bake of a mesh makes cards, if it can; `None` while the mesh is being loaded.
    fn bakes_cards(&self, mesh: AssetId<Mesh>, request: &LodRequest) -> Option<bool> {
        #[cfg(feature = "bake")]
        {
            let config = request.bake.as_ref().unwrap_or(&self.config.bake);
            let triangles = triangle_count(self.meshes.get(mesh)?);
            let kind = self.config.kind_for(request.kind, triangles);
            Some(config.cards && kind == LodKind::WholeMesh)
        }
        #[cfg(not(feature = "bake"))]
        {
            let _ = (mesh, request);
            Some(false)
        }
    }

    /// The entry of a request, by its index. The first entity that asks starts the task; all others that ask for the
    /// same share its result.
    fn find_or_start(
        &mut self,
        mesh: AssetId<Mesh>,
        request: &LodRequest,
        material_of: &MaterialOf<'_>,
    ) -> Option<usize> {
        let known = |(one, _): &(LodRequest, LodMeshEntry)| one == request;
        let entries = self.known.entries.get(&mesh);
        if let Some(index) = entries.and_then(|entries| entries.iter().position(known)) {
            return Some(index);
        }
        let not_yet = self.known.not_yet.get(&mesh);
        if not_yet.is_some_and(|requests| requests.contains(request)) {
            return None;
        }
        let Some(entry) = self.start(mesh, request, material_of) else {
            let not_yet = self.known.not_yet.entry(mesh).or_default();
            not_yet.push(request.clone());
            return None;
        };
        let entries = self.known.entries.entry(mesh).or_default();
        entries.push((request.clone(), entry));
        Some(entries.len() - 1)
    }

    fn start(
        &mut self,
        mesh: AssetId<Mesh>,
        request: &LodRequest,
        material_of: &MaterialOf<'_>,
    ) -> Option<LodMeshEntry> {
        // Small meshes need no levels.
        let source = self.meshes.get(mesh)?;
        let triangles = triangle_count(source);
        if let Some(pages) = self.known.pages_of.get(&mesh).cloned() {
            return self.start_pages(pages, source.clone(), triangles);
        }
        let kind = self.config.kind_for(request.kind, triangles);
        if kind == LodKind::Plain {
            return Some(LodMeshEntry::Plain(None));
        }
        // Only a few sources are copied at a time.
        let triangles = triangles.min(u32::MAX as usize) as u32;
        if !self.known.in_preparation.has_room(triangles, &self.config) {
            return None;
        }
        // A file that was named must be there first.
        let file = match &request.baked {
            Some(handle) => match self.file(handle).inspect(|_| {
                self.known.file_of.insert(mesh, handle.id());
            })? {
                Ok(file) => Some(file),
                Err(error) => {
                    let event = FieldLodEvent::failed(&self.assets, mesh, error.clone());
                    self.events.write(event);
                    return Some(LodMeshEntry::Plain(Some(error)));
                }
            },
            None => None,
        };
        #[cfg(feature = "bake")]
        let bake = self.bake_job(mesh, request, kind, file.is_none(), material_of)?;
        let texture = texture_of(self.standard.as_deref(), material_of(mesh));
        #[cfg(feature = "bake")]
        let texture = bake.member.as_ref().map_or(texture, Member::texture);
        // All else is the task's.
        let path = self.assets.get_path(mesh);
        let sidecar = self.sidecar(mesh);
        let new_threads = || PrepareThreads::new(&self.config);
        let threads = self.known.threads.get_or_insert_with(new_threads);
        let job = PrepareJob {
            mesh: self.meshes.get(mesh)?.clone(),
            name: asset_name(&self.assets, mesh.untyped()),
            place: path.and_then(|path| place_in_gltf(path.label()?)),
            kind,
            simplified_level: request.simplified_level,
            may_be_cards: request.may_be_cards && self.images.is_some(),
            texture,
            file,
            sidecar,
            #[cfg(feature = "bake")]
            bake,
        };
        let task = threads.tasks.spawn(prepare(job));
        self.known.in_preparation = self.known.in_preparation.with(triangles);
        Some(LodMeshEntry::Preparing(task, triangles))
    }

    /// Whether cards may stand for a mesh with a material, or those that it has; `None` while the material is being
    /// loaded. One that comes later may be any.
    fn may_be_cards(
        &self,
        cards: Option<&CardLevels>,
        material: Option<AssetId<StandardMaterial>>,
    ) -> Option<bool> {
        let Some((all, id)) = self.standard.as_ref().zip(material) else {
            return Some(false);
        };
        match all.get(id) {
            Some(material) => Some(match cards {
                Some(cards) => stand_for(cards, material),
                None => may_be_cards(material),
            }),
            None => {
                let state = self.assets.load_state(id);
                (!state.is_loading()).then_some(!state.is_failed())
            }
        }
    }

    /// What a bake goes by; `None` while some of it is being loaded. What is drawn as a whole is baked by what it looks
    /// like, and with what it is one plant with, if it `may_be_baked` at all.
    #[cfg(feature = "bake")]
    fn bake_job(
        &mut self,
        mesh: AssetId<Mesh>,
        request: &LodRequest,
        kind: LodKind,
        may_be_baked: bool,
        material_of: &MaterialOf<'_>,
    ) -> Option<BakeJob> {
        let known = &mut *self.known;
        let new_threads = || PrepareThreads::new(&self.config);
        let threads = known.threads.get_or_insert_with(new_threads);
        let config = request.bake.as_ref().unwrap_or(&self.config.bake);
        let is_whole = kind == LodKind::WholeMesh;
        let mut job = BakeJob {
            cache_folder: self.config.cache_folder.clone(),
            // Only of what is drawn as a whole it counts how the whole looks.
            config: BakeConfig {
                measure_appearance: config.measure_appearance && is_whole,
                cards: config.cards && request.may_be_cards,
                ..config.clone()
            },
            threads: self.config.bake_at_run_time.then(|| threads.bakes.clone()),
            surface: None,
            member: None,
        };
        if is_whole && may_be_baked {
            let surfaces = &mut known.surfaces;
            let standard = self.standard.as_deref();
            let mut look_of = |mesh| {
                let material = material_of(mesh);
                let surface = match material {
                    Some(material) => surfaces.find(material, &self.materials, &self.assets)?,
                    None => None,
                };
                Some((surface, texture_of(standard, material)))
            };
            let candidates = Candidates {
                kind: request.kind,
                lods: &self.config,
                meshes: &self.meshes,
                assets: &self.assets,
            };
            (job.surface, _) = look_of(mesh)?;
            let together = &mut known.together;
            // Whether one of them may be cards must not make another bake of it than of the others.
            let for_all = BakeConfig {
                cards: config.cards,
                ..job.config.clone()
            };
            job.member = together.member(mesh, &for_all, &candidates, look_of)?;
            if job.member.is_some() {
                job.config = for_all;
            }
        }
        Some(job)
    }

    /// Prepares what of a mesh is there before its pages are read.
    fn start_pages(
        &mut self,
        pages: MeshInPages,
        coarsest: Mesh,
        triangles: usize,
    ) -> Option<LodMeshEntry> {
        let triangles = triangles.min(u32::MAX as usize) as u32;
        if !self.known.in_preparation.has_room(triangles, &self.config) {
            return None;
        }
        let new_threads = || PrepareThreads::new(&self.config);
        let threads = self.known.threads.get_or_insert_with(new_threads);
        let task = threads.tasks.spawn(prepare_pages(pages, coarsest));
        self.known.in_preparation = self.known.in_preparation.with(triangles);
        Some(LodMeshEntry::Preparing(task, triangles))
    }

    /// A `.fieldlod` file, with its name; `None` while it is being loaded.
    fn file(
        &self,
        handle: &Handle<BakedLods>,
    ) -> Option<Result<(String, Arc<BakedFile>), LodError>> {
        let file = asset_name(&self.assets, handle.id().untyped());
        if let Some(loaded) = self.files.get(handle) {
            if loaded.pages.is_some() {
                return Some(Err(LodError::InPages { file }));
            }
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

/// The texture of a material, if that is loaded: a bake waits for it.
fn texture_of(
    materials: Option<&Assets<StandardMaterial>>,
    material: Option<AssetId<StandardMaterial>>,
) -> Option<AssetId<Image>> {
    let material = materials?.get(material?)?;
    material.base_color_texture.as_ref().map(Handle::id)
}
