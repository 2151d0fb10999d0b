//! The phases of a frame.

use bevy::asset::AssetEventSystems;
use bevy::camera::CameraUpdateSystems;
use bevy::camera::visibility::VisibilitySystems;
use bevy::light::SimulationLightSystems;
use bevy::mesh::mark_3d_meshes_as_changed_if_their_assets_changed;
use bevy::prelude::*;

/// The phases of a frame, in order, for ordering other systems. All run in `PostUpdate`.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FieldLodSystems {
    /// Finds mesh entities that enter or leave the subtree of an [`AutoLod`](crate::AutoLod), and mesh entities with a
    /// changed mesh.
    Track,
    /// Looks up or bakes the levels of detail of meshes, and inserts them on waiting entities.
    Prepare,
    /// Copies changed components of an entity, such as its material, to its units.
    Inherit,
    /// Selects the cut of each view, after cameras and transforms are final and before Bevy's culling.
    Select,
    /// Queues, for the render world, the level of each whole mesh that its views need.
    Swap,
    /// Spawns units that a view draws, and despawns units that no view has drawn for a while.
    Spawn,
    /// Filters the lists of visible entities, after Bevy's culling.
    Filter,
}

/// Orders the phases relative to each other and to Bevy's systems.
pub(crate) fn plugin(app: &mut App) {
    use FieldLodSystems::{Filter, Inherit, Prepare, Select, Spawn, Swap, Track};
    app.configure_sets(
        PostUpdate,
        (
            // After this system, Bevy collects the entities whose material needs another pipeline. Units that inherit a
            // material later would be drawn by the old pipeline for a frame.
            (Track, Prepare, Inherit)
                .chain()
                .before(mark_3d_meshes_as_changed_if_their_assets_changed)
                .before(TransformSystems::Propagate)
                .before(VisibilitySystems::VisibilityPropagate)
                .before(VisibilitySystems::CalculateBounds),
            // Units are drawn in the frame in which they are spawned, so they are spawned after transforms have
            // propagated and before culling. `AssetEventSystems` reports their new meshes to the renderer; with a
            // later spawn, the surface would have a hole for a frame.
            (Select, Swap, Spawn)
                .chain()
                .before(AssetEventSystems)
                .after(Inherit)
                .after(CameraUpdateSystems)
                .after(TransformSystems::Propagate)
                .after(VisibilitySystems::UpdateFrusta)
                .after(VisibilitySystems::VisibilityPropagate)
                .before(VisibilitySystems::CheckVisibility),
            // Bevy's culling fills the lists; other code reads them after its last visibility set.
            Filter
                .after(Spawn)
                .after(VisibilitySystems::CheckVisibility)
                .after(SimulationLightSystems::CheckLightVisibility)
                .before(VisibilitySystems::MarkNewlyHiddenEntitiesInvisible),
        ),
    );
}
