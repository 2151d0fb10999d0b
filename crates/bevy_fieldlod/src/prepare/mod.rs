//! Prepares the levels of detail of meshes: looks them up or bakes them in background tasks, and gives them
//! to the mesh entities that wait.

#[cfg(feature = "bake")]
mod bake;
mod changing;
mod collect;
mod job;
mod lookup;
mod objects;
pub(crate) mod restart;
mod sidecar;
mod source_arrays;
mod stand_ins;
#[cfg(test)]
mod tests;
mod threads;
pub(crate) mod track;

use bevy::prelude::*;

use crate::api::events::FieldLodEvent;
use crate::api::stats::FieldLodProgress;
use crate::api::systems::FieldLodSystems;
use crate::draw::upload::{PiecesToSend, send_pieces};
use crate::scene::lod_mesh::LodWaiting;
pub(crate) use lookup::LodMeshes;

/// Prepares meshes while entities wait for them.
pub(crate) fn plugin(app: &mut App) {
    let any_preparing = |known: Res<LodMeshes>| known.in_preparation.meshes > 0;
    let any_to_send = |pieces: Res<PiecesToSend>| !pieces.is_empty();
    let any_waiting = any_with_component::<LodWaiting>;
    let systems = (
        objects::skip_unsupported_objects.run_if(any_waiting),
        collect::collect_prepared_meshes.run_if(any_preparing),
        send_pieces.run_if(any_to_send),
        objects::give_levels_to_objects.run_if(any_waiting),
        objects::update_progress,
    );
    app.init_asset::<Mesh>()
        .add_message::<FieldLodEvent>()
        .init_resource::<FieldLodProgress>()
        .init_resource::<LodMeshes>()
        .add_systems(PostUpdate, systems.chain().in_set(FieldLodSystems::Prepare));
}
