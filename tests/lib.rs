//! Fixtures for the cross-crate suites of this package: meshes made by the program.

pub use fieldlod_bake::fixtures::*;
