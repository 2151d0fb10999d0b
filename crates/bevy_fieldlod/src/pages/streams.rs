//! Reads, uploads and evicts pages.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Weak};
use std::time::Duration;

use bevy::asset::AssetId;
use bevy::platform::collections::{HashMap, HashSet};
use bevy::platform::time::Instant;
use bevy::prelude::*;
use bevy::tasks::{IoTaskPool, Task, block_on};
use fieldlod_select::MeshId;
use fieldlod_stream::{Orders, Residency, StreamMeshId, StreamPageId, StreamSettings};

use super::memory::FieldLodMemory;
use super::mesh_in_pages::{MeshInPages, UnitOfPage};
use super::read::PageError;
use crate::api::config::FieldLodAppConfig;
use crate::api::stats::FieldLodViewStats;
use crate::draw::upload::UploadQueue;
use crate::lock;
use crate::scene::lod_mesh::LodMesh;
use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::{ViewCut, ViewState};

/// Limit of concurrent reads. Further reads are queued. With few, the latency of a disk limits its rate; with
/// thousands, pages that a view has left are read before those that it needs.
const MAX_CONCURRENT_READS: usize = 32;
/// Duration of a read after which it is logged. Disks take milliseconds, and network drives up to a second, so that a
/// shorter duration logs healthy drives. A longer one logs stalled drives late.
const SLOW: Duration = Duration::from_secs(2);

/// The streamed meshes, and their pages that are being loaded.
#[derive(Resource, Default)]
pub(super) struct PageStreams {
    residency: Residency,
    /// The paged mesh of each source mesh. It is added before its first page is prepared.
    pub(super) sources: HashMap<AssetId<Mesh>, MeshInPages>,
    meshes: HashMap<StreamMeshId, StreamedMesh>,
    by_mesh: HashMap<MeshId, StreamMeshId>,
    /// Queued reads.
    queued: VecDeque<StreamPageId>,
    reading: Vec<ReadingPage>,
    sending: Vec<SentPage>,
    /// Files whose failed reads were logged.
    logged_failures: HashSet<String>,
    /// Files whose slow reads were logged.
    logged_slow: HashSet<String>,
    /// Whether it was logged that the budget is too small.
    logged_too_small: bool,
}

struct StreamedMesh {
    lod: Weak<LodMesh>,
    id: MeshId,
    source: MeshInPages,
}

struct ReadingPage {
    page: StreamPageId,
    task: Task<Result<Vec<UnitOfPage>, PageError>>,
    since: Instant,
}

/// A page on its way to the GPU.
struct SentPage {
    page: StreamPageId,
    meshes: HashMap<u32, Handle<Mesh>>,
    uploaded: Arc<AtomicBool>,
}

impl PageStreams {
    /// Whether any mesh is streamed.
    pub(super) fn has_meshes(&self) -> bool {
        !self.meshes.is_empty()
    }

    /// Factor of the thresholds of all views, at which the needed pages fit into memory.
    pub(super) fn coarsening(&self) -> f32 {
        self.residency.coarsening()
    }

    /// Adds a mesh whose first page is in the scene.
    pub(super) fn add(&mut self, lod: &Arc<LodMesh>, source: MeshInPages, scene: &mut LodScene) {
        let stream = self.residency.add_mesh(source.paged());
        // Only the first page is loaded, which has the coarsest cut: no group may be refined yet.
        scene.scene.set_available(lod.id, |_| false);
        scene.has_incomplete_sources = true;
        self.by_mesh.insert(lod.id, stream);
        let mesh = StreamedMesh {
            lod: Arc::downgrade(lod),
            id: lod.id,
            source,
        };
        self.meshes.insert(stream, mesh);
    }

    /// Sets the groups of meshes that selection may refine. It visits every group of a mesh, so it is called once per
    /// mesh and frame, after all pages that came or went.
    fn update_available_groups(&self, changed: HashSet<StreamMeshId>, scene: &mut LodScene) {
        for mesh in changed {
            if let Some(streamed) = self.meshes.get(&mesh) {
                let at_hand = |group| self.residency.is_resident(mesh, group);
                scene.scene.set_available(streamed.id, at_hand);
            }
        }
    }

    /// Reports the groups that a view refines, or would refine if they were in memory. Returns how many are missing,
    /// and the largest error of the coarser geometry that is drawn instead, in pixels.
    fn report_demand(&mut self, scene: &LodScene, cut: &ViewCut) -> (u32, f32) {
        let Self {
            residency, by_mesh, ..
        } = self;
        let mut missing = (0, 0.0f32);
        if cut.state == ViewState::Cut {
            cut.selector.demand(&scene.scene, |demand| {
                if let Some(&stream) = by_mesh.get(&demand.mesh) {
                    residency.demand(stream, demand.group, demand.missing_px);
                }
                if let Some(px) = demand.missing_px {
                    missing = (missing.0 + 1, missing.1.max(px));
                }
            });
        }
        missing
    }

    /// Evicts pages. Returns the entities of their units, which the caller must despawn.
    fn evict(&mut self, pages: &[StreamPageId], scene: &mut LodScene) -> Vec<Entity> {
        let mut units: HashMap<MeshId, Vec<u32>> = HashMap::default();
        let mut changed = HashSet::new();
        for page in pages {
            let Some(mesh) = self.meshes.get(&page.mesh) else {
                continue;
            };
            let of_page = || mesh.source.paged().units_of(page.page as usize);
            units.entry(mesh.id).or_default().extend(of_page());
            if let Some(lod) = mesh.lod.upgrade() {
                // The GPU memory is freed with the last handle. Idle units, whose entities have others, are despawned
                // below.
                let mut meshes = lock(&lod.meshes);
                of_page().for_each(|unit| {
                    meshes.remove(&unit);
                });
            }
            changed.insert(page.mesh);
        }
        self.update_available_groups(changed, scene);
        if units.is_empty() {
            Vec::new()
        } else {
            scene.remove_idle_units(&units)
        }
    }

    /// Starts queued reads, up to the limit of concurrent reads.
    fn begin_reading(&mut self, assets: &AssetServer) {
        while self.reading.len() < MAX_CONCURRENT_READS
            && let Some(page) = self.queued.pop_front()
        {
            let Some(mesh) = self.meshes.get(&page.mesh) else {
                continue;
            };
            let read = mesh.source.clone().read(page.page, assets.clone());
            self.reading.push(ReadingPage {
                page,
                task: IoTaskPool::get().spawn(read),
                since: Instant::now(),
            });
        }
    }

    /// Schedules a retry and logs the reason once per file.
    fn schedule_retry(&mut self, page: StreamPageId, error: &PageError) {
        self.residency.set_failed(page);
        let file = self.meshes[&page.mesh].source.file();
        if self.logged_failures.insert(file.into()) {
            let number = page.page;
            error!("could not read page {number} of {file}: {error}; drawing coarser and retrying");
        }
    }

    /// Logs slow reads, once per file.
    fn log_slow_files(&mut self) {
        let is_slow = |reading: &&ReadingPage| reading.since.elapsed() > SLOW;
        for reading in self.reading.iter().filter(is_slow) {
            let Some(mesh) = self.meshes.get(&reading.page.mesh) else {
                continue;
            };
            let file = mesh.source.file();
            if self.logged_slow.insert(file.into()) {
                let number = reading.page.page;
                let seconds = SLOW.as_secs();
                warn!(
                    "could not read page {number} of {file} within {seconds} s; drawing coarser and waiting"
                );
            }
        }
    }
}

/// Drops meshes that nothing draws.
pub(super) fn remove_unused_meshes(
    mut streams: ResMut<PageStreams>,
    mut scene: ResMut<LodScene>,
    mut memory: ResMut<FieldLodMemory>,
) {
    let PageStreams {
        meshes,
        residency,
        by_mesh,
        reading,
        sending,
        logged_failures,
        logged_slow,
        ..
    } = &mut *streams;
    let unused = meshes.extract_if(|_, mesh| mesh.lod.strong_count() == 0);
    let unused: Vec<_> = unused.collect();
    for (stream, mesh) in &unused {
        residency.remove_mesh(*stream);
        // Ids are reused, so the id may already belong to another mesh.
        if by_mesh.get(&mesh.id) == Some(stream) {
            by_mesh.remove(&mesh.id);
        }
        logged_failures.remove(mesh.source.file());
        logged_slow.remove(mesh.source.file());
    }
    if unused.is_empty() {
        return;
    }
    reading.retain(|one| meshes.contains_key(&one.page.mesh));
    sending.retain(|one| meshes.contains_key(&one.page.mesh));
    if meshes.is_empty() {
        scene.has_incomplete_sources = false;
        memory.set_if_neq(FieldLodMemory::of(residency));
    }
}

/// Uploads pages that have been read.
pub(super) fn upload_read_pages(
    mut streams: ResMut<PageStreams>,
    mut meshes: ResMut<Assets<Mesh>>,
    uploads: Res<UploadQueue>,
) {
    let is_read = |reading: &mut ReadingPage| reading.task.is_finished();
    let read: Vec<ReadingPage> = streams.reading.extract_if(.., is_read).collect();
    for ReadingPage { page, task, .. } in read {
        match block_on(task) {
            Ok(units) => {
                // `remove_unused_meshes` has dropped the pages of all other meshes in this frame.
                let Some(lod) = streams.meshes[&page.mesh].lod.upgrade() else {
                    continue;
                };
                let units = units.into_iter().map(|unit| {
                    // A second read of the page finds the box already set, to the same value.
                    let _ = lod.pieces[unit.index as usize].aabb.set(unit.aabb);
                    (unit.index, unit.mesh)
                });
                let (meshes, uploaded) = uploads.send(units, &mut meshes);
                streams.sending.push(SentPage {
                    page,
                    meshes,
                    uploaded,
                });
            }
            Err(error) => streams.schedule_retry(page, &error),
        }
    }
    streams.log_slow_files();
}

/// Lets selection use pages that are uploaded.
pub(super) fn use_uploaded_pages(mut streams: ResMut<PageStreams>, mut scene: ResMut<LodScene>) {
    let is_uploaded = |sent: &mut SentPage| sent.uploaded.load(Ordering::Acquire);
    let uploaded: Vec<SentPage> = streams.sending.extract_if(.., is_uploaded).collect();
    let mut changed = HashSet::new();
    for SentPage { page, meshes, .. } in uploaded {
        let lod = streams.meshes[&page.mesh].lod.upgrade();
        if let Some(lod) = lod.filter(|_| streams.residency.set_loaded(page)) {
            lock(&lod.meshes).extend(meshes);
            changed.insert(page.mesh);
        }
    }
    streams.update_available_groups(changed, &mut scene);
}

/// Reports the demand of views to the residency, and starts the loads and evictions that it orders.
pub(super) fn request_pages(
    mut commands: Commands,
    mut streams: ResMut<PageStreams>,
    mut scene: ResMut<LodScene>,
    mut memory: ResMut<FieldLodMemory>,
    mut views: Query<(&ViewCut, &mut FieldLodViewStats)>,
    config: Res<FieldLodAppConfig>,
    assets: Res<AssetServer>,
    time: Option<Res<Time<Real>>>,
) {
    streams.residency.set_settings(StreamSettings {
        gpu_bytes: config.memory.gpu_bytes,
        loading_bytes: config.memory.main_bytes,
        keep_unused: config.memory.keep_unused,
    });
    for (cut, mut stats) in &mut views {
        (stats.missing_pieces, stats.missing_px) = streams.report_demand(&scene, cut);
    }
    // A paused game streams on, since its cameras may still move.
    let elapsed = time.map_or(Duration::ZERO, |time| time.delta());
    let Orders { evict, load } = streams.residency.update(elapsed);
    for entity in streams.evict(&evict, &mut scene) {
        commands.entity(entity).try_despawn();
    }
    for page in load {
        // The first page was loaded with the mesh.
        if page.page == 0 {
            streams.residency.set_loaded(page);
        } else {
            streams.queued.push_back(page);
        }
    }
    streams.begin_reading(&assets);
    let is_too_small = streams.residency.is_budget_too_small();
    if is_too_small && !streams.logged_too_small {
        warn!(
            "the coarsest levels of .fieldpages files need more than the {} bytes of \
             FieldLodAppConfig::memory; loading nothing finer",
            config.memory.gpu_bytes
        );
    }
    streams.logged_too_small = is_too_small;
    memory.set_if_neq(FieldLodMemory::of(&streams.residency));
}
