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
//!     // The default is one pixel of error; this camera allows two.
//!     commands.spawn((Camera3d::default(), FieldLodCamera::with_error_px(2.0)));
//! }
//! ```
//!
//! # Five minutes
//! 1. Add [`FieldLodPlugin`], and [`AutoLod`] to the roots of your scenes or to single [`Mesh3d`]s; or mark nothing and
//!    set [`FieldLodAppConfig::whole_world`]. `cargo run --release -p bevy_fieldlod --example minimal` is a complete
//!    app of 40 lines.
//! 2. Run. Meshes are baked in background tasks while their source is drawn. [`FieldLodProgress`] counts them,
//!    [`FieldLodEvent`] reports the result for each mesh, and [`LodReady`] for each entity. A million triangles take
//!    some seconds of one core with optimised dependencies: put `[profile.dev.package."*"]` with `opt-level = 3` into
//!    `Cargo.toml`, as for Bevy itself.
//! 3. Look: `FieldLodDebugPlugin` (feature `debug`) paints the levels. [`guide::settings`] explains the settings.
//! 4. Stop baking at run time: set [`FieldLodAppConfig::cache_folder`] while you work. Ship the assets that
//!    `FieldLodProcessorPlugin` processes, or the files of the command `fieldlod bake statue.glb` of the crate
//!    `fieldlod_cli`; the plugin finds `statue.fieldlod` beside the asset. [`LodMesh3d`] needs no glTF file.
//!
//! Coming from hand-made levels: [`guide::migration`]. Limits: [`guide::compatibility`].
//!
//! # Three kinds of meshes
//! The number of triangles selects one of three kinds ([`LodKind`]):
//! - Meshes of fewer than 100 triangles have no levels.
//! - Props are drawn as *whole meshes*: the renderer draws the mesh of the current level in place of the entity's
//!   [`Mesh3d`]. The component does not change, and Bevy still batches instances of a level. All views draw the finest
//!   level that any view needs.
//! - For large meshes, each view draws its own *cut*. Each piece of the surface has the coarsest level with an error
//!   below the camera's threshold. The pieces (*units*, [`LodUnit`]) are child entities, spawned when a view first
//!   draws them. The lists of visible entities of each camera and of its shadow maps contain only its cut. If the GPU
//!   culls, the plugin updates the lists of the render world as cuts change; otherwise it filters the lists of Bevy's
//!   culling.
//!
//! The standard renderer draws all of them with the material of their mesh, of any type. The plugin needs no special
//! hardware and no shader; only the debug view has one. [`FieldLodSystems`] names the phases of a frame.
//!
//! Errors are measured in pixels by the camera-sampling field (Lin and Lee, 2004). It accounts for field of view,
//! resolution, scale and position in the image.
//!
//! # Opt-in
//! - [`FieldLodVisibleFluxPlugin`], and [`FieldLodVisibleFlux`] on a camera: hidden objects are drawn coarser.
//! - [`LodMesh3d`] with a `.fieldpages` file: a world that is larger than the memory is read in parts.
//! - [`LodLevels`]: the levels that cameras draw, for example to animate distant characters less often.
//!
//! # Names
//! Names with `FieldLod` belong to a camera or the whole app: plugins, resources, messages, and the components of
//! cameras. Components of mesh entities have short names: [`AutoLod`], [`NoLod`], [`LodUnit`].
//!
//! # Limits
//! Skinned and morphed meshes have levels if they are from a glTF file, not if a program makes them. If the GPU culls
//! ([`AdvancedAppConfig::gpu_culling`]), the plugin inserts `NoCpuCulling` on all entities with levels except
//! characters, and `VisibleEntities` of cameras and lights do not contain them.
//!
//! # Features
//! - `bake` (default): bakes in background tasks. Without it, only baked files and processed assets are used, and no
//!   C++ is linked.
//! - `debug`: `FieldLodDebugPlugin`.

mod api;
mod assets;
mod compat;
#[cfg(feature = "debug")]
mod debug;
mod draw;
mod pages;
mod prepare;
mod scene;
mod select;
mod visible_flux;

use std::sync::{Mutex, MutexGuard, PoisonError};

use bevy::app::PluginGroupBuilder;
use bevy::prelude::*;

pub use api::auto_lod::{AutoLod, NoLod};
pub use api::bake_material::BakeMaterial;
pub use api::config::{AdvancedAppConfig, FieldLodAppConfig, LodKind, LodMemory, LodPriority};
pub use api::events::{FieldLodEvent, LodError, LodFailed, LodOrigin, LodReady};
pub use api::levels::LodLevels;
pub use api::settings::{AdvancedCamera, FieldLodCamera};
pub use api::stats::{FieldLodProgress, FieldLodViewStats};
pub use api::systems::FieldLodSystems;
pub use assets::baked_lods::BakedLods;
#[cfg(feature = "bake")]
pub use assets::processor::FieldLodProcessorPlugin;
pub use assets::standalone::LodMesh3d;
#[cfg(feature = "debug")]
pub use debug::{FieldLodDebug, FieldLodDebugPlugin, FieldLodGizmos, FieldLodHeatMap};
pub use draw::inherit::FieldLodAppExt;
pub use draw::units::LodUnit;
#[cfg(feature = "bake")]
pub use fieldlod_bake::{BakeConfig, MeshError};
pub use fieldlod_hierarchy::BakedFile;
pub use pages::{FieldLodMemory, FieldLodPagesPlugin};
pub use scene::lod_mesh::LodState;
pub use visible_flux::{FieldLodVisibleFlux, FieldLodVisibleFluxPlugin};

/// The types that most games import.
pub mod prelude {
    #[cfg(feature = "debug")]
    pub use crate::FieldLodDebug;
    pub use crate::{
        AdvancedAppConfig, AdvancedCamera, AutoLod, BakedLods, FieldLodAppConfig, FieldLodAppExt,
        FieldLodCamera, FieldLodEvent, FieldLodMemory, FieldLodPlugin, FieldLodProgress,
        FieldLodViewStats, FieldLodVisibleFlux, FieldLodVisibleFluxPlugin, LodFailed, LodKind,
        LodLevels, LodMemory, LodMesh3d, LodPriority, LodReady, LodState, NoLod,
    };
}

/// Paths of the plugin's values in Bevy's diagnostics.
pub use api::diagnostics;

/// Guides.
pub mod guide {
    #[doc = include_str!("../docs/architecture.md")]
    pub mod architecture {}
    #[doc = include_str!("../docs/compatibility.md")]
    pub mod compatibility {}
    #[doc = include_str!("../docs/content.md")]
    pub mod content {}
    #[doc = include_str!("../docs/migration.md")]
    pub mod migration {}
    #[doc = include_str!("../docs/settings.md")]
    pub mod settings {}
}

/// Automatic levels of detail for every mesh under an [`AutoLod`]: [`FieldLodCorePlugin`] and the opt-in features that
/// cost nothing while they are not used.
///
/// ```no_run
/// use bevy::prelude::*;
/// use bevy_fieldlod::{FieldLodPagesPlugin, prelude::*};
///
/// // Without streaming.
/// let plugins = FieldLodPlugin.build().disable::<FieldLodPagesPlugin>();
/// App::new().add_plugins((DefaultPlugins, plugins)).run();
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodPlugin;

impl PluginGroup for FieldLodPlugin {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(FieldLodCorePlugin)
            .add(FieldLodPagesPlugin)
    }
}

/// Gives meshes levels, selects the cut of each camera, and spawns the entities that Bevy draws.
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodCorePlugin;

impl Plugin for FieldLodCorePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<FieldLodAppConfig>()
            .init_resource::<LodPriority>()
            .init_resource::<scene::lod_scene::LodScene>()
            .add_plugins((
                api::systems::plugin,
                api::diagnostics::plugin,
                assets::plugin,
                prepare::plugin,
                select::views::plugin,
                draw::plugin,
            ));
    }
}

#[cfg(all(feature = "bake", target_arch = "wasm32"))]
compile_error!(
    "the feature `bake` is not available in browsers: disable the default features and ship .fieldlod files"
);

/// Locks a mutex. A panic of another thread leaves the values of this crate valid.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
