//! Files with levels of detail: as assets ([`BakedLods`](crate::BakedLods)), and as entities without a glTF file
//! ([`LodMesh3d`](crate::LodMesh3d)).

pub(crate) mod baked_lods;
pub(crate) mod file_parts;
pub(crate) mod lod_pages;
pub(crate) mod standalone;

use bevy::prelude::*;

/// Loads files and draws [`LodMesh3d`](crate::LodMesh3d)s.
pub(crate) fn plugin(app: &mut App) {
    app.add_plugins((baked_lods::plugin, standalone::plugin));
}
