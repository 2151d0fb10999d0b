//! Bakes meshes without a file, alone or together with the other primitives of their glTF mesh, and caches the
//! results.

mod cache;
mod job;
mod rigged;
mod surfaces;
mod together;

pub(super) use job::BakeJob;
pub(super) use rigged::{RiggedBake, RiggedFiles};
pub(super) use surfaces::{Materials, Surfaces};
pub(super) use together::{AllTogether, Candidates};
