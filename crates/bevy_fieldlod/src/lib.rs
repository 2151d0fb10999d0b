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
//! 3. Look: `FieldLodDebugPlugin` (feature `debug`) paints the levels. [`guide::settings`] says what to
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

mod auto_lod;
mod baked_lods;
mod card_levels;
mod cards;
mod casters;
mod changed;
mod config;
mod count;
mod cut_of;
#[cfg(feature = "debug")]
mod debug;
mod debug_options;
mod deferred_cuts;
pub mod diagnostics;
mod draw_records;
mod events;
mod file_parts;
mod filter;
mod glb;
mod gpu_culling;
mod gpu_lists;
mod inherit;
mod levels;
mod list_changes;
mod lod_mesh;
mod lod_pages;
mod lod_scene;
mod mesh_in_pages;
mod meshes;
mod motion;
mod pages;
#[cfg(feature = "bake")]
mod processor;
mod released_sources;
mod restart;
mod scene_pages;
mod settings;
mod shadow_lights;
mod standalone;
mod stats;
mod systems;
mod textures;
mod track;
mod unit_mesh;
mod units;
mod upload;
mod view_cut;
mod views;
mod whole_meshes;

use bevy::prelude::*;

pub use auto_lod::{AutoLod, NoLod};
pub use baked_lods::BakedLods;
pub use config::{FieldLodConfig, LodKind, LodMemory};
pub use cut_of::FieldLodCutOf;
#[cfg(feature = "debug")]
pub use debug::{FieldLodDebugPlugin, FieldLodGizmos};
pub use debug_options::{FieldLodDebug, FieldLodHeatMap};
pub use events::{FieldLodEvent, FieldLodSharp, LodError, LodFailed, LodOrigin, LodReady};
#[cfg(feature = "bake")]
pub use fieldlod_bake::{BakeConfig, MeshError};
pub use fieldlod_hierarchy::BakedFile;
pub use fieldlod_select::LodSettings;
pub use inherit::FieldLodAppExt;
pub use levels::LodLevels;
pub use lod_mesh::{LodSimplified, LodSource, LodState};
pub use pages::FieldLodMemory;
#[cfg(feature = "bake")]
pub use processor::FieldLodProcessorPlugin;
pub use settings::FieldLodSettings;
pub use standalone::LodMesh3d;
pub use stats::{FieldLodProgress, FieldLodViewStats};
pub use systems::FieldLodSystems;
pub use textures::{FieldLodTextureDemand, FieldLodTexturePlugin, TextureDetail};
pub use units::LodUnit;

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

/// Automatic levels of detail for everything under an [`AutoLod`].
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodPlugin;

impl Plugin for FieldLodPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<FieldLodConfig>()
            .init_resource::<FieldLodDebug>()
            .init_resource::<lod_scene::LodScene>()
            .add_plugins((
                systems::plugin,
                baked_lods::plugin,
                scene_pages::plugin,
                standalone::plugin,
                upload::plugin,
                pages::plugin,
            ))
            // What happens in a frame, in the order of `FieldLodSystems`.
            .add_plugins((
                restart::plugin,
                track::plugin,
                meshes::plugin,
                inherit::plugin,
                cards::plugin,
                views::plugin,
                whole_meshes::plugin,
                casters::plugin,
                units::plugin,
                filter::plugin,
                count::plugin,
                diagnostics::plugin,
            ))
            .add_plugins((
                gpu_culling::plugin,
                list_changes::plugin,
                gpu_lists::plugin,
                motion::plugin,
                released_sources::plugin,
            ));
    }
}
