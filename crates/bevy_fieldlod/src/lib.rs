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
//!    `cargo run --release -p bevy_fieldlod --example minimal` is such an app, of 40 lines.
//! 2. Run. Meshes are baked in background tasks and drawn in full meanwhile; [`FieldLodProgress`]
//!    tells how far that is, [`FieldLodEvent`] what became of each mesh, [`LodReady`] of each entity. A million triangles take some
//!    seconds of one core if dependencies are optimised, and longer if not: put
//!    `[profile.dev.package."*"]` with `opt-level = 3` into `Cargo.toml`, as for Bevy itself.
//! 3. Look: `FieldLodDebugPlugin` (feature `debug`) paints the levels. [`guide::tuning`] says what to
//!    turn.
//! 4. Bake no more at run time: set [`FieldLodConfig::cache_folder`] while you work; ship the files
//!    that `FieldLodProcessorPlugin` makes, or those of the command `fieldlod bake statue.glb`, whose
//!    `statue.fieldlod` is found beside the asset. [`LodMesh3d`] draws such a file by itself, without the
//!    glTF file.
//!
//! Coming from hand-made levels: [`guide::migration`]. What works with what: [`guide::compatibility`].
//!
//! # What happens
//! By the number of its triangles ([`LodKind`]) a mesh is treated in one of three ways:
//! - Small meshes stay as they are.
//! - Props are drawn as *whole meshes*: the entity's [`Mesh3d`] becomes that of a level, so that
//!   instances of a level are still drawn together. Of all views that see the prop, the one that
//!   asks for the finest level decides.
//! - Of large meshes, each view draws its own *cut*: every piece of the surface at the coarsest level
//!   that errs by no more than the pixels that its camera allows. The entities of the pieces
//!   (*units*, [`LodUnit`]) are children of the mesh's entity, spawned when a view first draws them.
//!   Each camera's list of what it draws, and those of its shadow maps, have only what its cut draws: where the
//!   GPU culls, the render world's lists are kept up to date as cuts change; elsewhere those that Bevy's
//!   culling makes anew in each frame are filtered.
//!
//! The standard renderer draws all of them, with the material of their mesh, whatever it is; no shader
//! and no special hardware is involved. [`FieldLodSystems`] names what happens in a frame, in order.
//!
//! Errors are counted in pixels by the camera-sampling field (Lin and Lee, 2004): field of view,
//! resolution, scale and position in the image count for as much as they show.
//!
//! # Names
//! What begins with `FieldLod` belongs to the plugin, a camera or the whole app: plugins, resources,
//! messages, and the components of cameras. Marks and components of mesh entities read as English:
//! [`AutoLod`], [`NoLod`], [`LodUnit`].
//!
//! # Limits
//! Skinned and morphed meshes are left as they are. Where the GPU culls
//! ([`FieldLodConfig::gpu_culling`]), the plugin puts `NoCpuCulling` on what has levels and takes it off again, and
//! `VisibleEntities` of cameras and lights have none of it. Whoever reads the [`Mesh3d`] of a prop gets that of a level,
//! and the source from [`LodSource`]; removing [`AutoLod`] puts it back.
//!
//! # Features
//! - `bake` (default): bakes in background tasks. Without it only `.fieldlod` files and processed assets
//!   are used, and no C++ is linked.
//! - `debug`: `FieldLodDebugPlugin`.

mod api;
mod assets;
mod cards;
#[cfg(feature = "debug")]
mod debug;
mod draw;
mod pages;
mod prepare;
mod scene;
mod select;
mod textures;

use bevy::prelude::*;

pub use api::auto_lod::{AutoLod, NoLod};
pub use api::config::{FieldLodConfig, LodKind, LodMemory};
pub use api::cut_of::FieldLodCutOf;
pub use api::debug_options::{FieldLodDebug, FieldLodHeatMap};
pub use api::diagnostics;
pub use api::events::{FieldLodEvent, FieldLodSharp, LodError, LodFailed, LodOrigin, LodReady};
pub use api::levels::LodLevels;
pub use api::settings::FieldLodSettings;
pub use api::stats::{FieldLodProgress, FieldLodViewStats};
pub use api::systems::FieldLodSystems;
pub use assets::baked_lods::BakedLods;
#[cfg(feature = "bake")]
pub use assets::processor::FieldLodProcessorPlugin;
pub use assets::standalone::LodMesh3d;
#[cfg(feature = "debug")]
pub use debug::{FieldLodDebugPlugin, FieldLodGizmos};
pub use draw::inherit::FieldLodAppExt;
pub use draw::units::LodUnit;
#[cfg(feature = "bake")]
pub use fieldlod_bake::{BakeConfig, MeshError};
pub use fieldlod_hierarchy::BakedFile;
pub use fieldlod_select::LodSettings;
pub use pages::FieldLodMemory;
pub use scene::lod_mesh::{LodSimplified, LodSource, LodState};
pub use textures::{FieldLodTextureDemand, FieldLodTexturePlugin, TextureDetail};

/// What a game imports.
pub mod prelude {
    pub use crate::{
        AutoLod, BakedLods, FieldLodAppExt, FieldLodConfig, FieldLodCutOf, FieldLodDebug,
        FieldLodEvent, FieldLodMemory, FieldLodPlugin, FieldLodProgress, FieldLodSettings,
        FieldLodSharp, FieldLodViewStats, LodFailed, LodKind, LodLevels, LodMemory, LodMesh3d,
        LodReady, LodState, NoLod,
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

impl Plugin for FieldLodPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<FieldLodConfig>()
            .init_resource::<FieldLodDebug>()
            .init_resource::<scene::lod_scene::LodScene>()
            .add_plugins((
                api::systems::plugin,
                assets::baked_lods::plugin,
                pages::scene_pages::plugin,
                assets::standalone::plugin,
                draw::upload::plugin,
                pages::plugin,
            ))
            // What happens in a frame, in the order of `FieldLodSystems`.
            .add_plugins((
                prepare::restart::plugin,
                prepare::track::plugin,
                prepare::plugin,
                draw::inherit::plugin,
                cards::plugin,
                select::views::plugin,
                draw::whole_meshes::plugin,
                draw::casters::plugin,
                draw::units::plugin,
                draw::cpu_lists::plugin,
                draw::count::plugin,
                api::diagnostics::plugin,
            ))
            .add_plugins((
                draw::gpu_culling::plugin,
                draw::list_changes::plugin,
                draw::gpu_lists::plugin,
                draw::motion::plugin,
                draw::released_sources::plugin,
            ));
    }
}
