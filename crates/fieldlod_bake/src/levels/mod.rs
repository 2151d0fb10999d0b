//! Levels of detail: groups of clusters, simplified level by level.
//!
//! In: a valid mesh and a [`BakeConfig`](crate::BakeConfig). Out: groups with errors and deviations, assembled into a
//! hierarchy.

pub(crate) mod assemble;
mod attributes;
mod build;
mod closed;
pub(crate) mod clusterlod;
pub(crate) mod clusters;
mod groups;
pub(crate) mod simplify;
pub(crate) mod vertices;

pub(crate) use build::build_levels;
