//! The types that a game uses: components, resources, messages and settings. The types of opt-in features are in their
//! own folders.

pub(crate) mod auto_lod;
pub(crate) mod bake_material;
pub(crate) mod config;
pub mod diagnostics;
pub(crate) mod events;
pub(crate) mod levels;
pub(crate) mod settings;
pub(crate) mod stats;
pub(crate) mod systems;
