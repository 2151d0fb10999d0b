//! From a [`Mesh3d`] to levels of detail.
//!
//! In: mesh entities under an [`AutoLod`](crate::AutoLod). Their meshes are prepared in background tasks. Out: objects
//! with levels, which `select` and `draw` handle.

#[cfg(feature = "bake")]
mod bake;
mod changing;
mod collect;
mod in_preparation;
mod job;
mod lookup;
mod measure;
mod objects;
mod restart;
mod sidecar;
mod source_arrays;
#[cfg(test)]
mod tests;
mod threads;
pub(crate) mod track;

use bevy::prelude::*;

use crate::api::events::FieldLodEvent;
use crate::api::stats::FieldLodProgress;
use crate::api::systems::FieldLodSystems;
use crate::scene::lod_mesh::LodWaiting;
pub(crate) use job::{PreparedMesh, piece_of};
pub(crate) use lookup::LodMeshes;

/// The steps of [`FieldLodSystems::Prepare`].
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum PrepareSteps {
    /// Collects the results of background tasks.
    Collect,
    /// Opt-in features read [`FieldLodEvent`]s here, before entities get their levels.
    Read,
    /// Looks up the levels of waiting entities.
    Give,
}

/// Prepares meshes while entities wait for them.
pub(crate) fn plugin(app: &mut App) {
    use PrepareSteps::{Collect, Give, Read};
    let any_preparing = |known: Res<LodMeshes>| known.in_preparation.meshes > 0;
    let any_waiting = any_with_component::<LodWaiting>;
    app.add_plugins((restart::plugin, track::plugin))
        // With `MinimalPlugins`, no other plugin registers meshes.
        .init_asset::<Mesh>()
        .add_message::<FieldLodEvent>()
        .init_resource::<FieldLodProgress>()
        .init_resource::<LodMeshes>()
        .configure_sets(
            PostUpdate,
            // Entities get levels in the frame in which their task ends.
            (Collect, Read, Give)
                .chain()
                .in_set(FieldLodSystems::Prepare),
        )
        .add_systems(
            PostUpdate,
            (
                collect::collect_prepared_meshes
                    .run_if(any_preparing)
                    .in_set(Collect),
                (
                    measure::begin_measuring.run_if(measure::is_first_guarantee),
                    measure::measure_levels.run_if(measure::any_unmeasured),
                    objects::give_levels_to_objects.run_if(any_waiting),
                    objects::update_progress,
                    restart::drop_unused_levels,
                )
                    .chain()
                    .in_set(Give),
            ),
        );
}
