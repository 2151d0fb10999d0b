//! Files with levels of detail, as assets.

pub(crate) mod baked_lods;
pub(crate) mod file_parts;
pub(crate) mod glb;
pub(crate) mod lod_pages;
#[cfg(feature = "bake")]
pub(crate) mod processor;
pub(crate) mod standalone;
