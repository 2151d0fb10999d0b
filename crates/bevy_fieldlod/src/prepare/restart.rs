//! Lets entities start anew whose levels of detail are out of date: because a program has changed their mesh,
//! their `.fieldlod` file was loaded again, or the GPU has lost them.

use bevy::asset::AssetId;
use bevy::platform::collections::HashSet;
use bevy::prelude::*;

use crate::api::systems::FieldLodSystems;
use crate::assets::baked_lods::BakedLods;
use crate::draw::upload::UploadQueue;
use crate::prepare::LodMeshes;
use crate::scene::lod_mesh::{LodObject, LodPlain, LodSource};
use crate::scene::lod_scene::LodScene;

/// Looks for what is out of date in each frame.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(PostUpdate, restart_objects.in_set(FieldLodSystems::Track));
}

/// Forgets levels that are out of date, and those of meshes that are gone. `track_objects` then looks at
/// their entities as if these had just got their mesh.
pub(crate) fn restart_objects(
    mut commands: Commands,
    mut mesh_events: MessageReader<AssetEvent<Mesh>>,
    mut file_events: MessageReader<AssetEvent<BakedLods>>,
    uploads: Res<UploadQueue>,
    mut known: ResMut<LodMeshes>,
    mut scene: ResMut<LodScene>,
    objects: Query<(Entity, &LodSource), With<LodObject>>,
    plain: Query<(Entity, &Mesh3d), With<LodPlain>>,
    assets: Res<AssetServer>,
) {
    let (mut outdated, mut gone) = (HashSet::<AssetId<Mesh>>::new(), Vec::new());
    for event in mesh_events.read() {
        match event {
            AssetEvent::Modified { id } if known.note_change(*id, &assets) => {
                outdated.insert(*id);
            }
            AssetEvent::Removed { id } => gone.push(*id),
            _ => {}
        }
    }
    outdated.extend(known.take_rested());
    for event in file_events.read() {
        match event {
            AssetEvent::Modified { id } => outdated.extend(known.meshes_of_file(*id, false)),
            // A file that could not be loaded before.
            AssetEvent::Added { id } => outdated.extend(known.meshes_of_file(*id, true)),
            _ => {}
        }
    }
    if uploads.take_lost() {
        outdated.extend(known.meshes_in_units());
    }
    // What was prepared of a mesh goes with its last instance.
    for &mesh in outdated.iter().chain(&gone) {
        known
            .forget(mesh)
            .into_iter()
            .for_each(|mesh| scene.retire(mesh));
    }
    gone.iter().for_each(|mesh| known.forget_source(*mesh));
    if outdated.is_empty() {
        return;
    }
    let objects = objects
        .iter()
        .map(|(entity, source)| (entity, &source.mesh));
    let plain = plain.iter().map(|(entity, mesh)| (entity, &mesh.0));
    for (entity, source) in objects.chain(plain) {
        if outdated.contains(&source.id()) {
            let mut commands = commands.entity(entity);
            commands
                .try_remove::<LodObject>()
                .try_insert(Mesh3d(source.clone()));
        }
    }
}
