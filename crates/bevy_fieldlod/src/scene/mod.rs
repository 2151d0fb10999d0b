//! The scene that cuts are selected from, and which entity draws which part of it.

pub(crate) mod changed;
pub(crate) mod deferred_cuts;
pub(crate) mod draw_records;
pub(crate) mod lod_mesh;
pub(crate) mod lod_scene;
pub(crate) mod unit_mesh;
pub(crate) mod view_cut;
