//! Restarts entities with stale levels: a program has changed their mesh, their file was reloaded, or the GPU has lost
//! the meshes of their levels. Drops levels that are unused.

use bevy::asset::AssetId;
use bevy::ecs::system::SystemParam;
use bevy::platform::collections::HashSet;
use bevy::prelude::*;

use super::lookup::LodMeshes;
use crate::api::events::asset_name;
use crate::api::systems::FieldLodSystems;
use crate::assets::baked_lods::BakedLods;
use crate::draw::released_sources::ReleasedSources;
use crate::draw::upload::UploadQueue;
use crate::scene::lod_mesh::{LodObject, LodState, LodWaiting};
use crate::scene::lod_scene::LodScene;

/// Frames between two checks: ten seconds at 60 frames per second. Levels that are unused at two checks in a row are
/// dropped. With a shorter time, enemies that come in waves load their levels for each wave; with a longer time, unused
/// levels stay in memory.
const CHECKED_EVERY: u32 = 600;

/// Restarts entities before they are tracked.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct RestartObjects;

pub(super) fn plugin(app: &mut App) {
    let systems = (
        restart_changed_meshes.run_if(on_message::<AssetEvent<Mesh>>),
        // After the changes of this frame, which make a mesh wait again.
        restart_stable_meshes,
        restart_reloaded_files.run_if(on_message::<AssetEvent<BakedLods>>),
        restart_lost_levels,
    );
    app.add_systems(
        PostUpdate,
        systems
            .chain()
            .in_set(RestartObjects)
            .in_set(FieldLodSystems::Track),
    );
}

/// Drops the levels of meshes and restarts their entities.
#[derive(SystemParam)]
struct Restart<'w, 's> {
    commands: Commands<'w, 's>,
    known: ResMut<'w, LodMeshes>,
    scene: ResMut<'w, LodScene>,
    entities: Query<'w, 's, (Entity, &'static Mesh3d), (With<LodState>, Without<LodWaiting>)>,
}

impl Restart<'_, '_> {
    /// Drops the levels of meshes, which are freed with their last instance. Marks the meshes of their entities as
    /// changed, so that `track_objects` visits the entities.
    fn restart(&mut self, outdated: impl IntoIterator<Item = AssetId<Mesh>>) {
        let outdated: HashSet<AssetId<Mesh>> = outdated.into_iter().collect();
        if outdated.is_empty() {
            return;
        }
        for mesh in &outdated {
            self.known.drop_levels(*mesh, &mut self.scene);
        }
        for (entity, mesh) in &self.entities {
            if outdated.contains(&mesh.id()) {
                self.commands
                    .entity(entity)
                    .try_remove::<LodObject>()
                    .try_insert(mesh.clone());
            }
        }
    }
}

/// Handles meshes that a program has changed or removed.
fn restart_changed_meshes(
    mut restart: Restart,
    mut events: MessageReader<AssetEvent<Mesh>>,
    assets: Res<AssetServer>,
    sources: Res<ReleasedSources>,
    meshes: Res<Assets<Mesh>>,
) {
    let mut changed = Vec::new();
    for event in events.read() {
        match event {
            AssetEvent::Modified { id } => {
                let is_same = |mesh| restart.known.is_up_to_date(*id, mesh);
                if meshes.get(*id).is_some_and(is_same) {
                    sources.note_reloaded(*id);
                } else if restart.known.note_change(*id, &assets) {
                    changed.push(*id);
                }
            }
            // The last handle was dropped, or a program has removed the mesh from `Assets<Mesh>`.
            AssetEvent::Removed { id } => {
                let mut drawn = restart.entities.iter();
                if sources.is_released(*id) && drawn.any(|(_, mesh)| mesh.id() == *id) {
                    let name = asset_name(&assets, *id);
                    warn!(
                        "{name} was removed from `Assets<Mesh>` while only its units were on the GPU; drawing nothing. \
                         `AdvancedAppConfig::sources_on_gpu` keeps meshes on the GPU"
                    );
                }
                changed.extend(restart.known.has_entries(*id).then_some(*id));
                restart.known.remove_source(*id);
            }
            _ => {}
        }
    }
    restart.restart(changed);
}

/// Handles meshes that have stopped changing.
fn restart_stable_meshes(mut restart: Restart) {
    let stable = restart.known.take_stable();
    restart.restart(stable);
}

/// Handles files that were reloaded, or loaded after a failure.
fn restart_reloaded_files(mut restart: Restart, mut events: MessageReader<AssetEvent<BakedLods>>) {
    for event in events.read() {
        let meshes = match event {
            AssetEvent::Modified { id } => restart.known.meshes_of_file(*id, false),
            // A first load: meshes that wait for the file start by themselves, failed ones do not.
            AssetEvent::Added { id } => restart.known.meshes_of_file(*id, true),
            _ => continue,
        };
        restart.restart(meshes);
    }
}

/// Handles the loss of the GPU device. Bevy uploads again the meshes that main memory has; it does not have levels.
fn restart_lost_levels(mut restart: Restart, uploads: Res<UploadQueue>) {
    if uploads.take_lost() {
        let lost = restart.known.meshes_with_levels();
        restart.restart(lost);
    }
}

/// Drops levels that no entity has used for a while, although the game keeps the handles of their meshes. An example is
/// a closed menu.
///
/// Only levels that a cache or a file has are dropped: an entity that needs them again loads them.
pub(super) fn drop_unused_levels(
    mut known: ResMut<LodMeshes>,
    mut scene: ResMut<LodScene>,
    mut frame: Local<u32>,
    mut last_unused: Local<HashSet<AssetId<Mesh>>>,
) {
    // Each check visits all entries.
    *frame = (*frame + 1) % CHECKED_EVERY;
    if *frame != 0 {
        return;
    }
    let mut unused = known.unused();
    for mesh in unused.extract_if(|mesh| last_unused.contains(mesh)) {
        known.drop_levels(mesh, &mut scene);
    }
    *last_unused = unused;
}
