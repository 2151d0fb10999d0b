//! Bakes meshes that have no file, alone or with the other primitives of their glTF mesh.

mod cache;
mod job;
pub(super) mod surfaces;
pub(super) mod together;

pub(super) use job::BakeJob;
