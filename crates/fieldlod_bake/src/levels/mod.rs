//! Levels of detail: groups of clusters, simplified level by level.
//!
//! In: a valid mesh and a [`BakeConfig`](crate::BakeConfig). Out: groups with errors and deviations, assembled into a
//! hierarchy.

pub(crate) mod assemble;
pub(crate) mod build;
mod closed;
#[cfg(any(test, feature = "test-support"))]
pub(crate) mod clusterlod;
pub(crate) mod clusters;
pub(crate) mod groups;
pub(crate) mod neighbours;
pub(crate) mod simplified_group;
pub(crate) mod simplify;
pub(crate) mod source_order;
mod step;
pub(crate) mod vertices;
