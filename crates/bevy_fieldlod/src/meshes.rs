//! Prepares the levels of detail of meshes: looks them up or bakes them in background tasks, and gives them
//! to the mesh entities that wait.

#[cfg(feature = "bake")]
mod bake;
#[cfg(feature = "bake")]
mod cache;
mod changing;
mod collect;
mod lookup;
mod objects;
mod prepare;
mod sidecar;
mod source_arrays;
mod stand_ins;
#[cfg(feature = "bake")]
mod surfaces;
#[cfg(test)]
mod tests;
mod threads;
#[cfg(feature = "bake")]
mod together;

use bevy::prelude::*;

use crate::events::FieldLodEvent;
use crate::lod_mesh::LodWaiting;
use crate::stats::FieldLodProgress;
use crate::systems::FieldLodSystems;
use crate::upload::{PiecesToSend, send_pieces};
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
