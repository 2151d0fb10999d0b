//! The data that `prepare`, `select` and `draw` share: objects and their levels, the scene for selection, and the cut
//! of each view. Records name the entity that draws each part.

pub(crate) mod changed;
pub(crate) mod draw_records;
pub(crate) mod lod_mesh;
pub(crate) mod lod_scene;
pub(crate) mod rig;
pub(crate) mod unit_mesh;
pub(crate) mod view_cut;
