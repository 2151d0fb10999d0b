//! Reads, uses and frees pages, as residency orders.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Weak};
use std::time::Duration;

use bevy::ecs::entity::EntityHashMap;
use bevy::platform::collections::{HashMap, HashSet};
use bevy::platform::time::Instant;
use bevy::prelude::*;
use bevy::tasks::{IoTaskPool, Task, block_on};
use fieldlod_select::MeshId;
use fieldlod_stream::{Orders, Residency, StreamMeshId, StreamPageId, StreamSettings};

use super::read::PageError;
use super::tell::FieldLodMemory;
use crate::api::config::FieldLodConfig;
use crate::api::events::FieldLodSharp;
use crate::api::stats::FieldLodViewStats;
use crate::draw::upload::PiecesToSend;
use crate::pages::mesh_in_pages::{MeshInPages, UnitOfPage};
use crate::scene::lod_mesh::LodMesh;
use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::{ViewCut, ViewState};

/// Pages that are read at the same time; all others wait in their order.
const MOST_READ_AT_ONCE: usize = 32;
/// The log says once of a file that one of its pages has not come for so long.
const SLOW: Duration = Duration::from_secs(2);

/// The meshes that are read in parts, and their pages on the way.
#[derive(Resource)]
pub(crate) struct PageStreams {
    residency: Residency,
    meshes: HashMap<StreamMeshId, StreamedMesh>,
    by_mesh: HashMap<MeshId, StreamMeshId>,
    /// Pages to be read, in order.
    ordered: VecDeque<StreamPageId>,
    reading: Vec<ReadingPage>,
    sending: Vec<SentPage>,
    /// Files of which the log has said that something cannot be read, and that it takes long.
    said: [HashSet<String>; 2],
    said_too_small: bool,
    /// Since when something is missing in a view.
    missing_since: EntityHashMap<Instant>,
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
    meshes: Vec<(u32, Handle<Mesh>)>,
    uploaded: Arc<AtomicBool>,
}

impl Default for PageStreams {
    fn default() -> Self {
        Self {
            residency: Residency::new(StreamSettings::default()),
            meshes: default(),
            by_mesh: default(),
            ordered: default(),
            reading: default(),
            sending: default(),
            said: default(),
            said_too_small: false,
            missing_since: default(),
        }
    }
}

impl PageStreams {
    /// Whether any mesh is read in parts.
    pub(crate) fn any(&self) -> bool {
        !self.meshes.is_empty()
    }

    /// Adds a mesh of which the first page is there.
    pub(crate) fn add(&mut self, lod: &Arc<LodMesh>, source: MeshInPages, scene: &mut LodScene) {
        let stream = self.residency.add_mesh(source.paged());
        scene.scene.set_available(lod.id, |_| false);
        scene.coarsening.get_or_insert(1.0);
        self.by_mesh.insert(lod.id, stream);
        let mesh = StreamedMesh {
            lod: Arc::downgrade(lod),
            id: lod.id,
            source,
        };
        self.meshes.insert(stream, mesh);
    }

    /// Tells selection which groups of a mesh are there.
    fn tell_scene(&self, mesh: StreamMeshId, scene: &mut LodScene) {
        if let Some(streamed) = self.meshes.get(&mesh) {
            let at_hand = |group| self.residency.is_at_hand(mesh, group);
            scene.scene.set_available(streamed.id, at_hand);
        }
    }

    /// Notes what a view refines, or would. Returns how many groups are missing, and by how many pixels.
    fn note_demand(&mut self, scene: &LodScene, cut: &ViewCut) -> (u32, f32) {
        let Self {
            residency,
            by_mesh,
            meshes,
            ..
        } = self;
        let mut missing = (0, 0.0f32);
        if cut.state == ViewState::Cut && cut.leader.is_none() {
            cut.selector.demand(&scene.scene, |demand| {
                if let Some(&stream) = by_mesh.get(&demand.mesh) {
                    residency.demand(stream, demand.group, demand.missing_px);
                }
                if let Some(px) = demand.missing_px {
                    missing = (missing.0 + 1, missing.1.max(px));
                }
            });
        }
        // What is drawn until the units of the next cut are spawned stays too, and so do those.
        scene.visit_deferred(&cut.deferred, |mesh, unit| {
            if let Some(&stream) = by_mesh.get(&mesh) {
                let units = &meshes[&stream].source.paged().graph.units;
                residency.demand(stream, units[unit as usize].consumed_by, None);
            }
        });
        missing
    }

    /// Tells a view when nothing is missing any more.
    fn note_sharpness(&mut self, view: Entity, stats: &FieldLodViewStats, commands: &mut Commands) {
        if stats.missing_pieces > 0 {
            self.missing_since.entry(view).or_insert_with(Instant::now);
        } else if let Some(since) = self.missing_since.remove(&view) {
            commands.entity(view).trigger(|entity| FieldLodSharp {
                entity,
                missing_for: since.elapsed(),
                error_px: stats.error_px,
            });
        }
    }

    /// Frees pages. Returns the entities of their units, which no view draws.
    fn evict(&mut self, pages: &[StreamPageId], scene: &mut LodScene) -> Vec<Entity> {
        let mut units: HashMap<MeshId, Vec<u32>> = HashMap::default();
        for page in pages {
            let Some(mesh) = self.meshes.get(&page.mesh) else {
                continue;
            };
            let of_page = || mesh.source.paged().units_of(page.page as usize);
            units.entry(mesh.id).or_default().extend(of_page());
            if let Some(lod) = mesh.lod.upgrade() {
                let mut in_pages = lod.in_pages();
                of_page().for_each(|unit| {
                    in_pages.remove(&unit);
                });
            }
            self.tell_scene(page.mesh, scene);
        }
        match units.is_empty() {
            true => Vec::new(),
            false => scene.remove_units_of_pages(&units),
        }
    }

    /// Begins to read what is ordered, as far as so much is read at the same time.
    fn begin_reading(&mut self, assets: &AssetServer) {
        while self.reading.len() < MOST_READ_AT_ONCE
            && let Some(page) = self.ordered.pop_front()
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

    /// Has the page loaded anew later, and the log say why, once for each file.
    fn note_failure(&mut self, page: StreamPageId, error: &PageError) {
        self.residency.set_failed(page);
        let file = self.meshes[&page.mesh].source.file();
        if self.said[0].insert(file.into()) {
            let number = page.page;
            error!(
                "{file} is drawn coarser where its page {number} is wanted, and it is tried again: {error}"
            );
        }
    }

    /// Has the log say once of a file that its pages take long.
    fn note_slow_files(&mut self) {
        let is_slow = |reading: &&ReadingPage| reading.since.elapsed() > SLOW;
        for reading in self.reading.iter().filter(is_slow) {
            let Some(mesh) = self.meshes.get(&reading.page.mesh) else {
                continue;
            };
            let file = mesh.source.file();
            if self.said[1].insert(file.into()) {
                let number = reading.page.page;
                warn!(
                    "{file} is drawn coarser meanwhile: its page {number} has not been read for {} s",
                    SLOW.as_secs()
                );
            }
        }
    }
}

/// Forgets meshes that nothing draws any more.
pub(super) fn forget_gone_meshes(
    mut streams: ResMut<PageStreams>,
    mut scene: ResMut<LodScene>,
    mut memory: ResMut<FieldLodMemory>,
) {
    let streams = streams.bypass_change_detection();
    let PageStreams {
        meshes,
        residency,
        by_mesh,
        said,
        ..
    } = streams;
    let count = meshes.len();
    meshes.retain(|stream, mesh| {
        let is_there = mesh.lod.strong_count() > 0;
        if !is_there {
            residency.remove_mesh(*stream);
            // The id may be that of a later mesh by now.
            if by_mesh.get(&mesh.id) == Some(stream) {
                by_mesh.remove(&mesh.id);
            }
            said.iter_mut().for_each(|said| {
                said.remove(mesh.source.file());
            });
        }
        is_there
    });
    if streams.meshes.len() == count {
        return;
    }
    let meshes = &streams.meshes;
    streams
        .reading
        .retain(|one| meshes.contains_key(&one.page.mesh));
    streams
        .sending
        .retain(|one| meshes.contains_key(&one.page.mesh));
    if meshes.is_empty() {
        scene.coarsening = None;
        streams.missing_since.clear();
        *memory = FieldLodMemory::of(&streams.residency);
    }
}

/// Sends pages that have been read to the GPU.
pub(super) fn collect_pages(
    mut streams: ResMut<PageStreams>,
    meshes: Res<Assets<Mesh>>,
    mut to_send: ResMut<PiecesToSend>,
) {
    let streams = streams.bypass_change_detection();
    let is_read = |reading: &mut ReadingPage| reading.task.is_finished();
    let read: Vec<ReadingPage> = streams.reading.extract_if(.., is_read).collect();
    for ReadingPage { page, task, .. } in read {
        match block_on(task) {
            Ok(units) => {
                let Some(lod) = streams.meshes[&page.mesh].lod.upgrade() else {
                    continue;
                };
                let (mut named, mut sent) = (Vec::new(), Vec::new());
                for unit in units {
                    let handle = meshes.reserve_handle();
                    // It is the same each time.
                    let _ = lod.pieces[unit.index as usize].aabb.set(unit.aabb);
                    named.push((unit.index, handle.clone()));
                    sent.push((handle, unit.mesh));
                }
                streams.sending.push(SentPage {
                    page,
                    meshes: named,
                    uploaded: to_send.push(sent),
                });
            }
            Err(error) => streams.note_failure(page, &error),
        }
    }
    streams.note_slow_files();
}

/// Lets selection use the pages that the GPU has got.
pub(super) fn use_pages(mut streams: ResMut<PageStreams>, mut scene: ResMut<LodScene>) {
    let streams = streams.bypass_change_detection();
    let is_there = |sent: &mut SentPage| sent.uploaded.load(Ordering::Acquire);
    let there: Vec<SentPage> = streams.sending.extract_if(.., is_there).collect();
    let mut changed = HashSet::new();
    for SentPage { page, meshes, .. } in there {
        let lod = streams.meshes[&page.mesh].lod.upgrade();
        if let Some(lod) = lod.filter(|_| streams.residency.set_loaded(page)) {
            lod.in_pages().extend(meshes);
            changed.insert(page.mesh);
        }
    }
    let scene = scene.bypass_change_detection();
    for mesh in changed {
        streams.tell_scene(mesh, scene);
    }
}

/// Tells residency what views ask for, and does as it says.
pub(super) fn order_pages(
    mut commands: Commands,
    mut streams: ResMut<PageStreams>,
    mut scene: ResMut<LodScene>,
    mut memory: ResMut<FieldLodMemory>,
    mut views: Query<(Entity, &ViewCut, &mut FieldLodViewStats)>,
    config: Res<FieldLodConfig>,
    assets: Res<AssetServer>,
    time: Option<Res<Time<Real>>>,
) {
    let (streams, scene) = (
        streams.bypass_change_detection(),
        scene.bypass_change_detection(),
    );
    streams.residency.set_settings(StreamSettings {
        gpu_bytes: config.memory.gpu_bytes,
        loading_bytes: config.memory.main_bytes,
        keep_unused: config.memory.keep_unused,
    });
    for (view, cut, mut stats) in &mut views {
        (stats.missing_pieces, stats.missing_px) = streams.note_demand(scene, cut);
        streams.note_sharpness(view, &stats, &mut commands);
    }
    let Orders { evict, load } = streams
        .residency
        .update(time.map_or(Duration::ZERO, |time| time.delta()));
    for entity in streams.evict(&evict, scene) {
        commands.entity(entity).try_despawn();
    }
    for page in load {
        // First pages came with the mesh.
        if page.page == 0 {
            streams.residency.set_loaded(page);
        } else {
            streams.ordered.push_back(page);
        }
    }
    streams.begin_reading(&assets);
    scene.coarsening = Some(streams.residency.coarsening());
    let is_too_small = streams.residency.is_budget_too_small();
    if is_too_small && !streams.said_too_small {
        warn!(
            "the coarsest levels of .fieldpages files take more than the {} bytes of FieldLodConfig::memory: \
             nothing finer is loaded",
            config.memory.gpu_bytes
        );
    }
    streams.said_too_small = is_too_small;
    memory.set_if_neq(FieldLodMemory::of(&streams.residency));
}
