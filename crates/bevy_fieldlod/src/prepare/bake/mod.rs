//! Bakes meshes that have no baked file. Primitives of one glTF mesh may be baked together. Results are cached.

mod cache;
mod job;
mod rigged;
mod surfaces;
mod together;

pub(super) use job::BakeJob;
pub(super) use rigged::{RiggedBake, RiggedFiles};
pub(super) use surfaces::{Materials, Surfaces};
pub(super) use together::{AllTogether, Candidates};
