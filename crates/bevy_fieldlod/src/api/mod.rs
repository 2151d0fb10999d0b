//! The types that a game uses: components, resources, messages and settings.

pub(crate) mod auto_lod;
pub(crate) mod config;
pub(crate) mod cut_of;
pub(crate) mod debug_options;
pub mod diagnostics;
pub(crate) mod events;
pub(crate) mod levels;
pub(crate) mod settings;
pub(crate) mod stats;
pub(crate) mod systems;
