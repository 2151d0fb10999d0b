//! Automatic, view-dependent level of detail for Bevy.
//!
//! Add the plugin, mark a scene, done:
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_fieldlod::prelude::*;
//!
//! fn main() {
//!     App::new()
//!         .add_plugins((DefaultPlugins, FieldLodPlugin))
//!         .add_systems(Startup, setup)
//!         .run();
//! }
//!
//! fn setup(mut commands: Commands, assets: Res<AssetServer>) {
//!     let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("statue.glb"));
//!     commands.spawn((WorldAssetRoot(scene), AutoLod::default()));
//!     // One pixel of error is the default; a camera may want another.
//!     commands.spawn((Camera3d::default(), LodView::with_error_px(2.0)));
//! }
//! ```
//!
//! # What happens
//! Each mesh under an [`AutoLod`] is baked into a hierarchy of levels of detail in a background
//! task, or its hierarchy is taken from a `.fieldlod` file. Until then it is drawn as it is. Then
//! one entity per *drawable unit* of the hierarchy is spawned below the mesh's entity, and in every
//! frame each camera's list of visible entities, and that of its shadow cascades, is cut down to the
//! units of that camera's cut, after Bevy's own culling. The standard renderer and material draw
//! them; no shader and no special hardware is involved.
//!
//! # Limits
//! Skinned and morphed meshes and materials other than [`StandardMaterial`] are left as they are,
//! with one line in the log. Entities with `NoCpuCulling` bypass the lists of visible entities and
//! must not be marked.
//!
//! # Features
//! - `bake` (default): bakes in background tasks. Without it only `.fieldlod` files are used, and no
//!   C++ is linked.
//!
//! [`StandardMaterial`]: bevy::prelude::StandardMaterial

mod asset;
mod components;
mod debug;
pub mod diagnostics;
mod gather;
mod library;
mod objects;
mod prepare;
mod upload;
mod views;

use bevy::camera::CameraUpdateSystems;
use bevy::camera::visibility::VisibilitySystems;
use bevy::light::SimulationLightSystems;
use bevy::prelude::*;

pub use asset::{BakedLods, BakedLodsError};
pub use components::{AutoLod, LodDebug, LodStatus, LodView, LodViewStats};
pub use prepare::PrepareError;

/// What a game imports.
pub mod prelude {
    pub use crate::{
        AutoLod, BakedLods, FieldLodPlugin, LodDebug, LodStatus, LodView, LodViewStats,
    };
}

/// Automatic levels of detail for everything under an [`AutoLod`].
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodPlugin;

/// The phases of this plugin, to order other systems against.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FieldLodSystems {
    /// In `PostUpdate`, before transforms propagate: finds mesh entities, follows their hierarchies, spawns their units.
    Prepare,
    /// In `PostUpdate`, once cameras and transforms are final: selects the cut of each view.
    Select,
    /// In `PostUpdate`, after Bevy's culling: edits the lists of visible entities.
    Filter,
}

impl Plugin for FieldLodPlugin {
    fn build(&self, app: &mut App) {
        app.init_asset::<BakedLods>()
            .init_asset_loader::<asset::BakedLodsLoader>()
            .register_type::<AutoLod>()
            .register_type::<LodView>()
            .register_type::<LodViewStats>()
            .init_resource::<LodDebug>()
            .init_resource::<LodStatus>()
            .init_resource::<library::LodLibrary>()
            .init_resource::<views::Slots>()
            .add_plugins((upload::plugin, diagnostics::plugin))
            .add_observer(objects::despawn_units);
        configure_phases(app);
        app.add_systems(
            PostUpdate,
            (
                (
                    objects::follow_mesh_changes,
                    objects::find_objects,
                    objects::refuse_unsupported,
                    library::collect_prepared,
                    objects::advance_waiting,
                    objects::follow_material_changes,
                    debug::color_levels.run_if(resource_exists::<debug::LevelMaterials>),
                    objects::update_status,
                    views::add_view_components,
                )
                    .chain()
                    .in_set(FieldLodSystems::Prepare),
                (
                    views::number_slots.run_if(objects::objects_changed),
                    views::select_cuts,
                )
                    .chain()
                    .in_set(FieldLodSystems::Select),
                (views::filter_cameras, views::filter_shadows).in_set(FieldLodSystems::Filter),
            ),
        );
    }

    fn finish(&self, app: &mut App) {
        if app.world().contains_resource::<Assets<StandardMaterial>>() {
            app.init_resource::<debug::LevelMaterials>();
        }
    }
}

fn configure_phases(app: &mut App) {
    app.configure_sets(
        PostUpdate,
        (
            // Units spawned in this frame still get their transforms and visibility in it.
            FieldLodSystems::Prepare
                .before(TransformSystems::Propagate)
                .before(VisibilitySystems::VisibilityPropagate)
                .before(VisibilitySystems::CalculateBounds),
            FieldLodSystems::Select
                .after(FieldLodSystems::Prepare)
                .after(CameraUpdateSystems)
                .after(TransformSystems::Propagate)
                .after(VisibilitySystems::UpdateFrusta),
            FieldLodSystems::Filter
                .after(FieldLodSystems::Select)
                .after(VisibilitySystems::CheckVisibility)
                .after(SimulationLightSystems::CheckLightVisibility)
                .before(VisibilitySystems::MarkNewlyHiddenEntitiesInvisible),
        ),
    );
}
