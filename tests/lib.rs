//! What the suites and benches of this package share: meshes made by the program, and apps to put
//! them in.

pub mod apps;
pub mod frame_times;
pub mod scenes;
pub mod soak;
pub mod stage;

pub use fieldlod_bake::fixtures::*;
