//! The phases of a frame.

use bevy::asset::AssetEventSystems;
use bevy::camera::CameraUpdateSystems;
use bevy::camera::visibility::VisibilitySystems;
use bevy::light::SimulationLightSystems;
use bevy::mesh::mark_3d_meshes_as_changed_if_their_assets_changed;
use bevy::prelude::*;

/// What this plugin does in a frame, in this order, to order other systems against. All of it runs in
/// `PostUpdate`.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FieldLodSystems {
    /// Finds mesh entities that came under an [`AutoLod`](crate::AutoLod), left it, or changed their mesh.
    Track,
    /// Looks up or bakes the levels of detail of meshes, and gives them to the entities that wait.
    Prepare,
    /// Copies components that changed on an entity, such as its material, to its units.
    Inherit,
    /// Selects the cut of each view, once cameras and transforms are final and before Bevy's culling.
    Select,
    /// Gives whole meshes the level that their views ask for.
    Swap,
    /// Spawns units that a view draws, and despawns those that none has drawn for a while.
    Spawn,
    /// Filters the lists of visible entities, after Bevy's culling.
    Filter,
}

/// Puts the phases in order, among themselves and between those of Bevy.
pub(crate) fn plugin(app: &mut App) {
    use FieldLodSystems::{Filter, Inherit, Prepare, Select, Spawn, Swap, Track};
    app.configure_sets(
        PostUpdate,
        (
            // Bevy must hear of changed materials in the frame in which it extracts them.
            (Track, Prepare, Inherit)
                .chain()
                .before(mark_3d_meshes_as_changed_if_their_assets_changed)
                .before(TransformSystems::Propagate)
                .before(VisibilitySystems::VisibilityPropagate)
                .before(VisibilitySystems::CalculateBounds),
            // Units come after transforms have propagated and before culling: they are drawn in the
            // frame in which they are spawned, where their object is.
            // And before Bevy, which goes by assets then, looks for meshes to bin anew: whole meshes at another
            // level would be drawn at that of before for a frame.
            (Select, Swap, Spawn)
                .chain()
                .before(AssetEventSystems)
                .after(Inherit)
                .after(CameraUpdateSystems)
                .after(TransformSystems::Propagate)
                .after(VisibilitySystems::UpdateFrusta)
                .after(VisibilitySystems::VisibilityPropagate)
                .before(VisibilitySystems::CheckVisibility),
            Filter
                .after(Spawn)
                .after(VisibilitySystems::CheckVisibility)
                .after(SimulationLightSystems::CheckLightVisibility)
                .before(VisibilitySystems::MarkNewlyHiddenEntitiesInvisible),
        ),
    );
}
