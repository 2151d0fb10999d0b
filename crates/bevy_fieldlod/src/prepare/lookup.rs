//! Looks up the levels of detail of mesh assets, and starts a task for each mesh without an entry.

use std::sync::Arc;

use bevy::asset::{AssetId, AssetPath};
use bevy::ecs::system::SystemParam;
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;
use bevy::render::render_asset::RenderAssetBytesPerFrame;
use bevy::tasks::{BoxedFuture, Task};
#[cfg(feature = "bake")]
use fieldlod_bake::BakeConfig;

#[cfg(feature = "bake")]
use super::bake::{AllTogether, BakeJob, Candidates, Materials, RiggedBake, RiggedFiles, Surfaces};
use super::changing::ChangingMeshes;
use super::in_preparation::InPreparation;
use super::job::{LevelSource, PrepareJob, PreparedMesh, prepare};
use super::measure::measuring::Measuring;
use super::sidecar::SidecarFiles;
use super::source_arrays::{place_in_gltf, primitives_together, triangle_count};
use super::threads::{PrepareThreads, Threads};
use crate::api::auto_lod::AutoLod;
use crate::api::config::{FieldLodAppConfig, LodKind, LodPriority};
use crate::api::events::{FieldLodEvent, LodError, asset_name};
use crate::assets::baked_lods::BakedLods;
#[cfg(feature = "bake")]
use crate::compat::is_compressed;
use crate::scene::lod_mesh::{KeepOfLevels, LodMesh};
use crate::scene::lod_scene::LodScene;
use crate::scene::rig::is_rigged;

/// Prepares the levels of a mesh in another way than by a bake or a `.fieldlod` file.
pub(crate) type LevelProvider =
    Arc<dyn Fn() -> BoxedFuture<'static, Result<PreparedMesh, LodError>> + Send + Sync>;

/// All meshes whose levels of detail were requested.
#[derive(Resource, Default)]
pub(crate) struct LodMeshes {
    /// The entries of each mesh, one per request.
    entries: HashMap<AssetId<Mesh>, Vec<(AutoLod, LodMeshEntry)>>,
    /// The provider of each mesh that has one.
    providers: HashMap<AssetId<Mesh>, LevelProvider>,
    /// The glTF file of each skinned or morphed mesh.
    rigged: HashMap<AssetId<Mesh>, AssetPath<'static>>,
    /// Files of [`rigged`](Self::rigged) meshes of which some are not ready in this frame. The primitives of a
    /// character get their levels in the same frame, so that they change levels together from then on.
    unready_files: HashSet<AssetPath<'static>>,
    sidecars: Arc<SidecarFiles>,
    pub(super) in_preparation: InPreparation,
    pub(super) measuring: Measuring,
    changing: ChangingMeshes,
    /// Requests that could not be started in this frame. Other entities with the same request do not retry them.
    not_started: HashMap<AssetId<Mesh>, Vec<AutoLod>>,
    #[cfg(feature = "bake")]
    together: AllTogether,
    #[cfg(feature = "bake")]
    surfaces: Surfaces,
    #[cfg(feature = "bake")]
    rigged_files: RiggedFiles,
    threads: PrepareThreads,
}

/// The state of a mesh.
pub(super) enum LodMeshEntry {
    /// A task prepares the mesh, which has this many triangles.
    Preparing(Task<Result<PreparedMesh, LodError>>, u32),
    Ready(Arc<LodMesh>),
    /// The source mesh is drawn; with an error if preparation failed.
    Plain(Option<LodError>),
}

/// The result of a look-up.
pub(super) enum Found<'a> {
    Entry(&'a LodMeshEntry),
    /// The request has no entry, and its mesh is loaded.
    Startable,
    /// Its mesh is not loaded, or its character is not ready.
    Unready,
}

/// Why a request was not started.
pub(super) enum NotStarted {
    /// An asset is being loaded, or too many tasks are running. It is retried in the next frame.
    NotYet,
    /// The source mesh is drawn.
    Failed(LodError),
}

impl LodMeshes {
    /// Sets the provider of the levels of a mesh, for all requests.
    pub(crate) fn set_provider(&mut self, mesh: AssetId<Mesh>, provider: LevelProvider) {
        self.providers.insert(mesh, provider);
    }

    /// All levels of a mesh that are ready, one per request.
    pub(crate) fn ready(&self, mesh: AssetId<Mesh>) -> impl Iterator<Item = &Arc<LodMesh>> {
        let entries = self.entries.get(&mesh).into_iter().flatten();
        entries.filter_map(|(_, entry)| match entry {
            LodMeshEntry::Ready(lod) => Some(lod),
            _ => None,
        })
    }

    /// Whether the levels of a mesh were requested.
    pub(super) fn has_entries(&self, mesh: AssetId<Mesh>) -> bool {
        self.entries.contains_key(&mesh)
    }

    /// Removes the entries of a mesh that changed or was removed. Its levels are freed with their last instance.
    pub(super) fn drop_levels(&mut self, mesh: AssetId<Mesh>, scene: &mut LodScene) {
        #[cfg(feature = "bake")]
        self.together.remove_groups_of(mesh);
        self.measuring.drop_levels(mesh);
        for lod in self.ready(mesh).cloned() {
            scene.retire(lod);
        }
        if self.entries.remove(&mesh).is_some() {
            self.count_in_preparation();
        }
    }

    /// Removes everything that is stored for a removed mesh, except its levels.
    pub(super) fn remove_source(&mut self, mesh: AssetId<Mesh>) {
        self.providers.remove(&mesh);
        self.rigged.remove(&mesh);
        self.changing.remove(mesh);
        #[cfg(feature = "bake")]
        self.together.remove_source(mesh);
    }

    /// The meshes whose [`AutoLod`] names `file`; with `only_failed`, those that failed.
    pub(super) fn meshes_of_file(
        &self,
        file: AssetId<BakedLods>,
        only_failed: bool,
    ) -> Vec<AssetId<Mesh>> {
        let is_affected = |(request, entry): &(AutoLod, LodMeshEntry)| {
            let is_of_file = request.baked.as_ref().is_some_and(|of| of.id() == file);
            is_of_file && (!only_failed || matches!(entry, LodMeshEntry::Plain(Some(_))))
        };
        let meshes = self.entries.iter();
        let affected = meshes.filter(|(_, entries)| entries.iter().any(is_affected));
        affected.map(|(mesh, _)| *mesh).collect()
    }

    /// The meshes with levels that no entity uses and that a cache or a file has.
    ///
    /// Empty while meshes are prepared, because entities may wait for levels that are ready, together with others.
    pub(super) fn unused(&self) -> HashSet<AssetId<Mesh>> {
        if self.in_preparation.meshes > 0 {
            return HashSet::default();
        }
        // The entry has one reference; objects, instances and retired meshes have the others.
        let has_no_user = |lod: &Arc<LodMesh>| lod.is_uploaded() && Arc::strong_count(lod) == 1;
        let is_unused = |mesh: &AssetId<Mesh>| {
            let mut levels = self.ready(*mesh).peekable();
            levels.peek().is_some()
                && levels.all(|lod| lod.is_stored && has_no_user(lod))
                // The coarsest levels of `.fieldpages` files stay in memory.
                && !self.has_provider(*mesh)
        };
        self.entries.keys().copied().filter(is_unused).collect()
    }

    /// The meshes with levels. Levels are on the GPU only.
    pub(super) fn meshes_with_levels(&self) -> Vec<AssetId<Mesh>> {
        let is_ready = |mesh: &AssetId<Mesh>| self.ready(*mesh).next().is_some();
        self.entries.keys().copied().filter(is_ready).collect()
    }

    /// Whether the entries of a mesh are for `mesh` as it is now. Failed ones are not, since another preparation may
    /// succeed.
    pub(super) fn is_up_to_date(&self, id: AssetId<Mesh>, mesh: &Mesh) -> bool {
        let mut entries = self.entries.get(&id).into_iter().flatten();
        self.has_entries(id)
            && !entries.any(|(_, entry)| matches!(entry, LodMeshEntry::Plain(Some(_))))
            && self.changing.has_contents(id, mesh)
    }

    /// Records that a program has changed a mesh, and returns whether the mesh had entries.
    pub(super) fn note_change(&mut self, mesh: AssetId<Mesh>, assets: &AssetServer) -> bool {
        #[cfg(feature = "bake")]
        {
            self.together.remove_groups_of(mesh);
            // The glTF file of the mesh may have changed.
            if self.rigged.contains_key(&mesh) {
                self.rigged_files = default();
            }
        }
        let is_known = self.has_entries(mesh);
        self.changing.note(mesh, is_known, assets);
        is_known
    }

    /// Ends a frame for changing meshes. Returns the meshes that have stopped changing, and all meshes that were baked
    /// together with them.
    pub(super) fn take_stable(&mut self) -> Vec<AssetId<Mesh>> {
        let stable = self.changing.take_stable();
        #[cfg(feature = "bake")]
        let stable = stable
            .into_iter()
            .flat_map(|mesh| self.baked_with(mesh))
            .collect();
        stable
    }

    /// All meshes that were baked together with `mesh`, and `mesh`.
    #[cfg(feature = "bake")]
    fn baked_with(&self, mesh: AssetId<Mesh>) -> Vec<AssetId<Mesh>> {
        let Some(file) = self.rigged.get(&mesh) else {
            return self.together.with_others(mesh);
        };
        let rigged = self.rigged.iter();
        let of_file = rigged.filter(|(_, of)| *of == file);
        of_file.map(|(mesh, _)| *mesh).collect()
    }

    /// All entries, each with its mesh.
    pub(super) fn entries_mut(
        &mut self,
    ) -> impl Iterator<Item = (AssetId<Mesh>, &mut LodMeshEntry)> {
        let meshes = self.entries.iter_mut();
        meshes.flat_map(|(mesh, entries)| entries.iter_mut().map(|(_, entry)| (*mesh, entry)))
    }

    /// Updates the counters. If no task is running, drops the data that tasks share.
    pub(super) fn end_of_collection(&mut self) {
        self.count_in_preparation();
        if self.in_preparation.meshes == 0 {
            self.threads.end_loading_screen();
            // Files and materials may change before the next task.
            self.sidecars = default();
            #[cfg(feature = "bake")]
            {
                self.together.clear();
                self.surfaces = default();
                self.rigged_files = default();
            }
        }
    }

    /// Whether a provider makes the levels of a mesh.
    pub(super) fn has_provider(&self, mesh: AssetId<Mesh>) -> bool {
        self.providers.contains_key(&mesh)
    }

    /// Measures deviations from now on.
    pub(super) fn begin_measuring(&mut self) {
        self.measuring.is_needed = true;
        for (mesh, entries) in &self.entries {
            for (_, entry) in entries {
                if let LodMeshEntry::Ready(levels) = entry {
                    self.measuring.add(*mesh, levels);
                }
            }
        }
    }

    /// The files of rigged meshes of which some are being prepared or uploaded, or could not be started.
    fn find_unready_files(&self) -> HashSet<AssetPath<'static>> {
        let is_unready = |(_, entry): &(AutoLod, LodMeshEntry)| match entry {
            LodMeshEntry::Preparing(..) => true,
            LodMeshEntry::Ready(lod) => !lod.is_uploaded(),
            LodMeshEntry::Plain(_) => false,
        };
        let unready = self.rigged.iter().filter(|(mesh, _)| {
            let mut entries = self.entries.get(*mesh).into_iter().flatten();
            self.not_started.contains_key(*mesh) || entries.any(is_unready)
        });
        unready.map(|(_, path)| path.clone()).collect()
    }

    fn count_in_preparation(&mut self) {
        let entries = self.entries.values().flatten();
        let triangles = entries.filter_map(|(_, entry)| match entry {
            LodMeshEntry::Preparing(_, triangles) => Some(*triangles),
            _ => None,
        });
        let triangles = triangles.chain(self.measuring.triangles());
        self.in_preparation = triangles.fold(InPreparation::default(), InPreparation::with);
    }
}

/// Returns the material of an entity with a mesh.
pub(super) type MaterialOf<'a> = dyn Fn(AssetId<Mesh>) -> Option<AssetId<StandardMaterial>> + 'a;

/// Looks up the levels of detail of meshes.
#[derive(SystemParam)]
pub(super) struct LodMeshLookup<'w> {
    pub(super) known: ResMut<'w, LodMeshes>,
    config: Res<'w, FieldLodAppConfig>,
    priority: Res<'w, LodPriority>,
    upload_limit: Option<Res<'w, RenderAssetBytesPerFrame>>,
    keep: Option<Res<'w, KeepOfLevels>>,
    meshes: Res<'w, Assets<Mesh>>,
    files: Res<'w, Assets<BakedLods>>,
    #[cfg(feature = "bake")]
    materials: Materials<'w>,
    pub(super) assets: Res<'w, AssetServer>,
    events: MessageWriter<'w, FieldLodEvent>,
}

impl LodMeshLookup<'_> {
    /// Updates the files that are not ready, and permits retries of requests that could not be started.
    pub(super) fn begin_frame(&mut self) {
        let known = &mut *self.known;
        known.unready_files = known.find_unready_files();
        known.not_started.clear();
    }

    /// Finds the entry of a request.
    pub(super) fn find(&self, mesh: AssetId<Mesh>, auto_lod: &AutoLod) -> Found<'_> {
        let known = &*self.known;
        // The source of a changing mesh is drawn until it stops changing.
        if known.changing.contains(mesh) {
            return Found::Entry(&LodMeshEntry::Plain(None));
        }
        let entries = known.entries.get(&mesh).into_iter().flatten();
        // Providers ignore the request, so that all entities with the mesh share one entry.
        let ignores_request = known.has_provider(mesh);
        let mut same = entries.filter(|(one, _)| ignores_request || one.is_same_request(auto_lod));
        let Some((_, entry)) = same.next() else {
            // An entity may have the handle of a mesh that is still being loaded. The parts of a character are recorded
            // before there is room for their tasks, because they wait for each other.
            let source = self.meshes.get(mesh);
            let has_room = known.in_preparation.has_room(0);
            return match source.filter(|source| has_room || is_rigged(source)) {
                Some(_) => Found::Startable,
                None => Found::Unready,
            };
        };
        // A primitive with levels would not fit the primitives of its character that are not ready.
        let file = known.rigged.get(&mesh);
        if file.is_some_and(|file| known.unready_files.contains(file)) {
            return Found::Unready;
        }
        Found::Entry(entry)
    }

    /// Adds the entry of a request without one, and starts its task, unless assets that it needs are not loaded. A bake
    /// reads the materials that meshes have at that time.
    pub(super) fn start(
        &mut self,
        mesh: AssetId<Mesh>,
        auto_lod: &AutoLod,
        material_of: &MaterialOf<'_>,
    ) {
        let request = if self.known.has_provider(mesh) {
            AutoLod::default()
        } else {
            auto_lod.request()
        };
        // Another entity with the same request was first in this frame.
        let has_entry = self.known.entries.get(&mesh).into_iter().flatten();
        let not_started = self.known.not_started.get(&mesh);
        if has_entry.map(|(one, _)| one).any(|one| *one == request)
            || not_started.is_some_and(|requests| requests.contains(&request))
        {
            return;
        }
        let entry = match self.start_task(mesh, &request, material_of) {
            Ok(entry) => entry,
            Err(NotStarted::Failed(error)) => {
                let event = FieldLodEvent::failed(&self.assets, mesh, error.clone());
                self.events.write(event);
                LodMeshEntry::Plain(Some(error))
            }
            Err(NotStarted::NotYet) => {
                self.known
                    .not_started
                    .entry(mesh)
                    .or_default()
                    .push(request);
                return;
            }
        };
        let known = &mut *self.known;
        let entries = known.entries.entry(mesh).or_default();
        // The mesh may have changed since its first entry, before the change is reported.
        if let Some(source) = self.meshes.get(mesh).filter(|_| entries.is_empty()) {
            known.changing.note_contents(mesh, source);
        }
        entries.push((request, entry));
    }

    /// Starts the preparation of a mesh.
    pub(super) fn start_task(
        &mut self,
        mesh: AssetId<Mesh>,
        request: &AutoLod,
        material_of: &MaterialOf<'_>,
    ) -> Result<LodMeshEntry, NotStarted> {
        let source = self.meshes.get(mesh).ok_or(NotStarted::NotYet)?;
        let triangles = triangle_count(source);
        let provider = self.known.providers.get(&mesh).cloned();
        let kind = if is_rigged(source) {
            // Primitives that cannot start yet are recorded too, because the others of their file wait for them.
            if let Some(path) = self.assets.get_path(mesh) {
                let file = path.without_label().into_owned();
                self.known.rigged.insert(mesh, file);
            }
            // Small primitives of a character change levels with the others.
            match request.kind {
                LodKind::Plain => LodKind::Plain,
                _ => LodKind::WholeMesh,
            }
        } else {
            self.kind_of(mesh, request, triangles)
        };
        if provider.is_none() && kind == LodKind::Plain {
            return Ok(LodMeshEntry::Plain(None));
        }
        let triangles = triangles.min(u32::MAX as usize) as u32;
        if !self.known.in_preparation.has_room(triangles) {
            return Err(NotStarted::NotYet);
        }
        let prepared: BoxedFuture<_> = match provider {
            Some(provider) => provider(),
            None => {
                let sources = self.sources(mesh, request, kind, material_of)?;
                let source = self.meshes.get(mesh).ok_or(NotStarted::NotYet)?.clone();
                let kind = match (request.kind, kind) {
                    (LodKind::Auto, LodKind::Clusters) => LodKind::Auto,
                    (_, kind) => kind,
                };
                let path = self.assets.get_path(mesh);
                let limit = self.upload_limit.as_ref();
                Box::pin(prepare(PrepareJob {
                    mesh: source,
                    name: asset_name(&self.assets, mesh),
                    place: path.and_then(|path| place_in_gltf(path.label()?)),
                    kind,
                    all_units: limit.is_some_and(|limit| limit.max_bytes.is_some()),
                    keep: self.keep.as_deref().copied(),
                    sources,
                }))
            }
        };
        let task = self.threads().tasks.spawn(prepared);
        self.known.in_preparation = self.known.in_preparation.with(triangles);
        Ok(LodMeshEntry::Preparing(task, triangles))
    }

    /// The kind of a mesh that is not rigged. A small primitive that is baked with others changes levels with them:
    /// otherwise there would be cracks.
    fn kind_of(&self, mesh: AssetId<Mesh>, request: &AutoLod, triangles: usize) -> LodKind {
        let kind_for = |triangles| self.config.kind_for(request.kind, triangles);
        if request.kind == LodKind::Plain || kind_for(triangles) != LodKind::Plain {
            return kind_for(triangles);
        }
        #[cfg(feature = "bake")]
        let most_triangles = {
            let config = request.bake.as_ref().unwrap_or(&self.config.bake);
            config.together_below_triangles
        };
        // A file may be baked with any limit.
        #[cfg(not(feature = "bake"))]
        let most_triangles = usize::MAX;
        let group = primitives_together(mesh, most_triangles, &self.meshes, &self.assets);
        let mut all = group.iter().flatten();
        if all.any(|(_, mesh)| kind_for(triangle_count(mesh)) != LodKind::Plain) {
            LodKind::WholeMesh
        } else {
            LodKind::Plain
        }
    }

    /// Whether another preparation for a request may measure deviations.
    pub(super) fn may_measure(&self, mesh: AssetId<Mesh>, request: &AutoLod) -> bool {
        #[cfg(feature = "bake")]
        let may = self.bake_config(request).measure_deviation;
        #[cfg(not(feature = "bake"))]
        let may = false;
        may && request.baked.is_none() && !self.known.has_provider(mesh)
    }

    /// The settings of a bake. Those of the app measure deviations once a camera needs them.
    #[cfg(feature = "bake")]
    fn bake_config(&self, request: &AutoLod) -> BakeConfig {
        let of_app = &self.config.bake;
        request.bake.clone().unwrap_or_else(|| BakeConfig {
            measure_deviation: of_app.measure_deviation && self.known.measuring.is_needed,
            ..of_app.clone()
        })
    }

    fn threads(&mut self) -> &Threads {
        self.known.threads.of(*self.priority, &self.config)
    }

    /// The sources of the levels of a mesh, in the order in which they are tried.
    fn sources(
        &mut self,
        mesh: AssetId<Mesh>,
        request: &AutoLod,
        kind: LodKind,
        material_of: &MaterialOf<'_>,
    ) -> Result<Vec<LevelSource>, NotStarted> {
        // The fallback to another source would hide that a named file is missing or stale.
        if let Some(file) = &request.baked {
            return Ok(vec![self.file(file)?]);
        }
        let path = self.assets.get_path(mesh).map(AssetPath::into_owned);
        let is_rigged = self.meshes.get(mesh).is_some_and(is_rigged);
        let mut sources = Vec::new();
        if let Some(path) = path.clone() {
            let sidecars = self.known.sidecars.clone();
            sources.push(LevelSource::BesideAsset(
                self.assets.clone(),
                path,
                sidecars,
            ));
        }
        #[cfg(feature = "bake")]
        if is_rigged {
            // A compressed mesh differs from that of its file.
            let path = path.filter(|_| !self.meshes.get(mesh).is_some_and(is_compressed));
            sources.extend(path.and_then(|path| self.rigged_bake(path, request)));
        } else {
            let bake = self.bake_job(mesh, request, kind, material_of)?;
            sources.push(LevelSource::Bake(bake));
        }
        #[cfg(not(feature = "bake"))]
        let _ = (kind, material_of);
        // A program made the mesh. A bake needs the skeleton and the clips of a glTF file.
        if is_rigged && sources.is_empty() {
            return Err(NotStarted::Failed(LodError::Rigged));
        }
        Ok(sources)
    }

    /// The bake of a skinned or morphed primitive of a glTF file; `None` for other files.
    #[cfg(feature = "bake")]
    fn rigged_bake(&mut self, path: AssetPath<'static>, request: &AutoLod) -> Option<LevelSource> {
        let place = place_in_gltf(path.label()?)?;
        let threads = self.threads().bakes.clone();
        let config = &self.bake_config(request);
        let file = path.without_label().into_owned();
        Some(LevelSource::BakeRigged(RiggedBake {
            assets: self.assets.clone(),
            file: self.known.rigged_files.find(file, config),
            place,
            cache_folder: self.config.cache_folder.clone(),
            threads: self.config.bake_at_run_time.then_some(threads),
        }))
    }

    /// The file that an [`AutoLod`] names.
    fn file(&self, handle: &Handle<BakedLods>) -> Result<LevelSource, NotStarted> {
        let file = asset_name(&self.assets, handle.id());
        match self.files.get(handle) {
            // Only `LodMesh3d` streams pages: the mesh of this entity is the source.
            Some(loaded) if loaded.pages.is_some() => {
                Err(NotStarted::Failed(LodError::InPages { file }))
            }
            Some(loaded) => Ok(LevelSource::File(file, loaded.file.clone())),
            None if self.assets.load_state(handle).is_failed() => {
                Err(NotStarted::Failed(LodError::FileNotLoaded { file }))
            }
            None => Err(NotStarted::NotYet),
        }
    }

    /// The bake of a mesh, together with the other primitives of its glTF mesh. Whole meshes are baked with the surface
    /// of their material.
    #[cfg(feature = "bake")]
    fn bake_job(
        &mut self,
        mesh: AssetId<Mesh>,
        request: &AutoLod,
        kind: LodKind,
        material_of: &MaterialOf<'_>,
    ) -> Result<BakeJob, NotStarted> {
        let threads = self.threads().bakes.clone();
        let config = &self.bake_config(request);
        let is_whole = kind == LodKind::WholeMesh;
        let LodMeshes {
            surfaces, together, ..
        } = &mut *self.known;
        let mut surface_of = |mesh| match material_of(mesh) {
            Some(material) => surfaces.find(material, &self.materials, &self.assets),
            None => Ok(None),
        };
        let candidates = Candidates {
            kind: request.kind,
            lods: &self.config,
            meshes: &self.meshes,
            assets: &self.assets,
        };
        let surface = if is_whole { surface_of(mesh)? } else { None };
        let member = together.member(mesh, config, &candidates, surface_of)?;
        Ok(BakeJob {
            cache_folder: self.config.cache_folder.clone(),
            config: BakeConfig {
                // Only levels that are drawn as whole meshes use the measurement, and groups may have some.
                measure_appearance: config.measure_appearance && (is_whole || member.is_some()),
                ..config.clone()
            },
            threads: self.config.bake_at_run_time.then_some(threads),
            surface,
            member,
        })
    }
}
