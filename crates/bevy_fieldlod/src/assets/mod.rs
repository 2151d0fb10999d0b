//! Files with levels of detail: as assets ([`BakedLods`](crate::BakedLods)), as entities without a glTF file
//! ([`LodMesh3d`](crate::LodMesh3d)), and inside `.glb` files.

pub(crate) mod baked_lods;
pub(crate) mod file_parts;
pub(crate) mod glb;
pub(crate) mod lod_pages;
#[cfg(feature = "bake")]
pub(crate) mod processor;
pub(crate) mod standalone;

use bevy::prelude::*;

/// Loads files and draws [`LodMesh3d`](crate::LodMesh3d)s.
pub(crate) fn plugin(app: &mut App) {
    app.add_plugins((baked_lods::plugin, standalone::plugin));
}
