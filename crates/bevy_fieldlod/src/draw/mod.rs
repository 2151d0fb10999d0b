//! Draws what was selected.

pub(crate) mod casters;
pub(crate) mod count;
pub(crate) mod cpu_lists;
pub(crate) mod gpu_culling;
pub(crate) mod gpu_lists;
pub(crate) mod inherit;
pub(crate) mod list_changes;
pub(crate) mod motion;
pub(crate) mod released_sources;
pub(crate) mod units;
pub(crate) mod upload;
pub(crate) mod whole_meshes;
