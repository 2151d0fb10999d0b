//! Bakes meshes that have no baked file. Primitives of one glTF mesh may be baked together. Results are cached.

mod cache;
mod mesh_bake;
mod primitives;
mod rigged;
mod surfaces;

pub(super) use mesh_bake::BakeJob;
pub(super) use primitives::{AllTogether, Candidates};
pub(super) use rigged::{RiggedBake, RiggedFiles};
pub(super) use surfaces::{Materials, Surfaces};
