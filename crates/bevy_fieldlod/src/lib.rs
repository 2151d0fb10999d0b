//! Automatic, view-dependent level of detail for Bevy: add it, mark a scene, done.
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
//!     commands.spawn((Camera3d::default(), FieldLodSettings::with_error_px(2.0)));
//! }
//! ```
//!
//! # Five minutes
//! 1. Add [`FieldLodPlugin`], and [`AutoLod`] to the roots of your scenes or to single [`Mesh3d`]s; or
//!    mark nothing and set [`FieldLodConfig::whole_world`].
//! 2. Run. Meshes are baked in background tasks and drawn in full meanwhile; [`FieldLodProgress`]
//!    tells how far that is, [`FieldLodEvent`] what became of each mesh. A million triangles take some
//!    seconds of one core if dependencies are optimised, and longer if not: put
//!    `[profile.dev.package."*"]` with `opt-level = 3` into `Cargo.toml`, as for Bevy itself.
//! 3. Look: `FieldLodDebugPlugin` (feature `debug`) paints the levels. [`guide::tuning`] says what to
//!    turn.
//! 4. Bake no more at run time: set [`FieldLodConfig::cache_folder`] while you work; ship the files
//!    that `FieldLodProcessorPlugin` makes, or those of the command `fieldlod bake statue.glb`, whose
//!    `statue.fieldlod` is found beside the asset.
//!
//! Coming from hand-made levels: [`guide::migration`]. What works with what: [`guide::compatibility`].
//!
//! # What happens
//! By the number of its triangles ([`LodKind`]) a mesh is treated in one of three ways:
//! - Small meshes stay as they are.
//! - Props are exchanged as a whole: the entity's [`Mesh3d`] becomes that of a level, so that
//!   instances of a level are still drawn together. Of all views that see the prop, the one that
//!   asks for the finest level decides.
//! - Of large meshes, each view draws its own *cut*: every piece of the surface at the coarsest level
//!   that errs by no more than the pixels that its camera allows. The entities of the pieces
//!   ("units") are children of the mesh's entity, spawned when a view first wants them. After Bevy's
//!   culling, each camera's list of visible entities, and those of its shadow maps, are cut down to
//!   what its cut draws.
//!
//! The standard renderer draws all of them, with the material of their mesh, whatever it is; no shader
//! and no special hardware is involved.
//!
//! Errors are counted in pixels by the camera-sampling field (Lin and Lee, 2004): field of view,
//! resolution, scale and place in the image count for as much as they show.
//!
//! # Limits
//! Skinned and morphed meshes are left as they are. Entities with `NoCpuCulling` bypass the lists of
//! visible entities and must not be marked. Whoever reads the [`Mesh3d`] of a prop gets that of a level;
//! removing [`AutoLod`] puts the source back.
//!
//! # Features
//! - `bake` (default): bakes in background tasks. Without it only `.fieldlod` files and processed assets
//!   are used, and no C++ is linked.
//! - `debug`: `FieldLodDebugPlugin`.

mod asset;
mod components;
mod config;
#[cfg(feature = "debug")]
mod debug;
pub mod diagnostics;
mod events;
mod filter;
mod gather;
mod glb;
mod inherit;
mod library;
mod marks;
mod objects;
mod prepare;
#[cfg(feature = "bake")]
mod processor;
mod slots;
mod textures;
mod units;
mod upload;
mod views;
mod world;

use bevy::camera::CameraUpdateSystems;
use bevy::camera::visibility::VisibilitySystems;
use bevy::light::SimulationLightSystems;
use bevy::mesh::mark_3d_meshes_as_changed_if_their_assets_changed;
use bevy::prelude::*;

pub use asset::{BakedLods, BakedLodsError};
pub use components::{
    AutoLod, FieldLodDebug, FieldLodHeatMap, FieldLodProgress, FieldLodSettings, FieldLodViewStats,
    NoLod,
};
pub use config::{FieldLodConfig, LodKind};
#[cfg(feature = "debug")]
pub use debug::{FieldLodDebugPlugin, FieldLodGizmos, LodSurfaceMaterial};
pub use events::{FieldLodEvent, LodOrigin};
pub use fieldlod_hierarchy::BakedFile;
pub use fieldlod_select::LodSettings;
pub use inherit::FieldLodAppExt;
pub use prepare::LodError;
#[cfg(feature = "bake")]
pub use processor::{BakeIntoGlb, FieldLodProcessorPlugin};
pub use textures::{FieldLodTextureDemand, FieldLodTexturePlugin, TextureDetail};
pub use units::LodUnit;

/// What a game imports.
pub mod prelude {
    pub use crate::{
        AutoLod, BakedLods, FieldLodAppExt, FieldLodConfig, FieldLodDebug, FieldLodEvent,
        FieldLodPlugin, FieldLodProgress, FieldLodSettings, FieldLodViewStats, LodKind, NoLod,
    };
}

/// Guides.
pub mod guide {
    #[doc = include_str!("../docs/compatibility.md")]
    pub mod compatibility {}
    #[doc = include_str!("../docs/migration.md")]
    pub mod migration {}
    #[doc = include_str!("../docs/tuning.md")]
    pub mod tuning {}
}

/// Automatic levels of detail for everything under an [`AutoLod`].
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodPlugin;

/// The phases of this plugin, to order other systems against.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FieldLodSystems {
    /// In `PostUpdate`, before transforms propagate: finds mesh entities and follows their levels of
    /// detail.
    Prepare,
    /// In `PostUpdate`, once cameras and transforms are final and before Bevy's culling: selects the
    /// cut of each view, exchanges whole meshes and spawns units.
    Select,
    /// In `PostUpdate`, after Bevy's culling: edits the lists of visible entities.
    Filter,
}

impl Plugin for FieldLodPlugin {
    fn build(&self, app: &mut App) {
        app.init_asset::<Mesh>()
            .init_asset::<BakedLods>()
            .init_asset_loader::<asset::BakedLodsLoader>()
            .register_type::<MeshMaterial3d<StandardMaterial>>()
            .add_message::<FieldLodEvent>()
            .init_resource::<FieldLodConfig>()
            .init_resource::<FieldLodProgress>()
            .init_resource::<FieldLodDebug>()
            .init_resource::<library::LodLibrary>()
            .init_resource::<world::LodWorld>()
            .init_resource::<inherit::Inheritance>()
            .init_resource::<inherit::Outdated>()
            .add_plugins((upload::plugin, diagnostics::plugin))
            .add_observer(objects::note_new)
            .add_observer(objects::undress)
            .add_observer(units::replace_lost)
            .add_observer(views::release_view);
        configure_phases(app);
        add_systems(app);
    }
}

/// In a frame in which nothing happens, most of them do not run.
fn add_systems(app: &mut App) {
    let prepare = (
        objects::follow_mesh_changes.run_if(on_message::<AssetEvent<Mesh>>),
        objects::find_objects,
        objects::refuse_unsupported.run_if(objects::any_waiting),
        library::collect_prepared.run_if(library::any_preparing),
        objects::advance_waiting.run_if(objects::any_waiting),
        objects::update_progress,
        views::add_view_components.run_if(views::any_new),
        inherit::find_outdated.run_if(world::has_clusters),
        inherit::renew_units.run_if(inherit::any_outdated),
    );
    let select = (
        views::place_instances,
        views::select_views,
        views::exchange_levels.run_if(world::has_restless),
        units::spawn_units.run_if(units::any_wanted),
        units::despawn_idle.run_if(world::has_idle),
    );
    let filter = (
        filter::filter_cameras,
        filter::filter_shadows.run_if(world::has_clusters),
    );
    app.add_systems(
        PostUpdate,
        (
            prepare.chain().in_set(FieldLodSystems::Prepare),
            select.chain().in_set(FieldLodSystems::Select),
            filter.in_set(FieldLodSystems::Filter),
        ),
    );
}

fn configure_phases(app: &mut App) {
    app.configure_sets(
        PostUpdate,
        (
            // Bevy must hear of changed materials in the frame in which it extracts them.
            FieldLodSystems::Prepare
                .before(mark_3d_meshes_as_changed_if_their_assets_changed)
                .before(TransformSystems::Propagate)
                .before(VisibilitySystems::VisibilityPropagate)
                .before(VisibilitySystems::CalculateBounds),
            FieldLodSystems::Select
                .after(FieldLodSystems::Prepare)
                .after(CameraUpdateSystems)
                .after(TransformSystems::Propagate)
                .after(VisibilitySystems::UpdateFrusta)
                .after(VisibilitySystems::VisibilityPropagate)
                .before(VisibilitySystems::CheckVisibility),
            FieldLodSystems::Filter
                .after(FieldLodSystems::Select)
                .after(VisibilitySystems::CheckVisibility)
                .after(SimulationLightSystems::CheckLightVisibility)
                .before(VisibilitySystems::MarkNewlyHiddenEntitiesInvisible),
        ),
    );
}
