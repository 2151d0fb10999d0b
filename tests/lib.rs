//! Fixtures of the suites and benches: generated meshes, apps and scenes.

pub mod apps;
pub mod frame_times;
pub mod scenes;
pub mod soak;
pub mod stage;

pub use fieldlod_bake::fixtures::*;
