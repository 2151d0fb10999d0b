//! Drops levels that no entity has used for a while, such as those of a menu that was closed while the game keeps the
//! handles of its meshes.
//!
//! Only levels that a cache or a file has are dropped: an entity that needs them again loads them.

use bevy::asset::AssetId;
use bevy::platform::collections::HashSet;
use bevy::prelude::*;

use super::lookup::LodMeshes;
use crate::scene::lod_scene::LodScene;

/// Frames between two checks: ten seconds at 60 frames per second. Levels that are unused at two checks in a row are
/// dropped. With a shorter time, enemies that come in waves load their levels for each wave.
const CHECKED_EVERY: u32 = 600;

/// Checks all levels from time to time.
pub(super) fn drop_unused_levels(
    mut known: ResMut<LodMeshes>,
    mut scene: ResMut<LodScene>,
    mut frame: Local<u32>,
    mut last_unused: Local<HashSet<AssetId<Mesh>>>,
) {
    *frame = (*frame + 1) % CHECKED_EVERY;
    if *frame != 0 {
        return;
    }
    let mut unused = known.unused();
    for mesh in unused.extract_if(|mesh| last_unused.contains(mesh)) {
        known
            .forget(mesh)
            .into_iter()
            .for_each(|lod| scene.retire(lod));
    }
    *last_unused = unused;
}
