//! Meshes that a program changes, such as water, cloth, or a terrain with digging.
//!
//! Levels of a changing mesh would be stale before they are baked. Its source is drawn, and its levels are prepared
//! again once it stays unchanged for a while. The time doubles each time that the mesh changes again.
//!
//! Bevy loads a glTF file again for each label that a game loads, and replaces its meshes by equal ones. These have not
//! changed, as the hashes of their contents show.

use std::hash::{BuildHasher, Hash, Hasher};
use std::mem::discriminant;

use bevy::asset::AssetId;
use bevy::mesh::{Indices, MeshAccessError};
use bevy::platform::collections::HashMap;
use bevy::platform::hash::FixedHasher;
use bevy::prelude::*;

use crate::api::events::asset_name;

/// Frames that a mesh must stay unchanged after its first change: half a second at 60 frames per second. With fewer, a
/// mesh that a user drags is baked between two movements of the mouse; with more, an edit shows its levels late.
const FIRST_WAIT_FRAMES: u32 = 30;
/// Upper limit of the wait, 16 seconds. With a shorter one, a mesh that changes every few seconds is baked each time;
/// without one, a mesh that was changed for an hour never has levels again.
const MAX_WAIT_FRAMES: u32 = 960;
/// Number of changes after which the log names the mesh: half a second of changes in every frame. With fewer, the
/// log names meshes that a user edits; with more, it names animated meshes later.
const MANY_CHANGES: u32 = 30;

/// All meshes that have changed since their first preparation.
#[derive(Default)]
pub(crate) struct ChangingMeshes {
    meshes: HashMap<AssetId<Mesh>, ChangingMesh>,
    /// The hash of each mesh at its first preparation since its last change.
    contents: HashMap<AssetId<Mesh>, u64>,
    frame: u32,
}

struct ChangingMesh {
    /// The frame of the last change; `None` once it has stayed unchanged.
    changed_at: Option<u32>,
    /// Frames that it must stay unchanged.
    wait_frames: u32,
    /// Number of changes since it last stayed unchanged.
    changes: u32,
}

impl ChangingMeshes {
    /// Records a change of a mesh that has entries or that has changed before.
    pub(super) fn note(&mut self, mesh: AssetId<Mesh>, is_known: bool, assets: &AssetServer) {
        let changing = match self.meshes.get_mut(&mesh) {
            Some(changing) => changing,
            None if is_known => self.meshes.entry(mesh).or_insert(ChangingMesh {
                changed_at: None,
                // Doubled below.
                wait_frames: FIRST_WAIT_FRAMES / 2,
                changes: 0,
            }),
            None => return,
        };
        // A change during the wait restarts the wait, but does not double it.
        if changing.changed_at.is_none() {
            changing.wait_frames = (changing.wait_frames * 2).min(MAX_WAIT_FRAMES);
        }
        changing.changed_at = Some(self.frame);
        changing.changes += 1;
        if changing.changes == MANY_CHANGES {
            let name = asset_name(assets, mesh);
            info!(
                "{name} changes every few frames; drawing the source mesh until it stays unchanged for {} \
                 frames",
                changing.wait_frames
            );
        }
    }

    /// Records what a mesh contains.
    pub(super) fn note_contents(&mut self, id: AssetId<Mesh>, mesh: &Mesh) {
        match hash_of(mesh) {
            Ok(hash) => self.contents.insert(id, hash),
            Err(_) => self.contents.remove(&id),
        };
    }

    /// Whether `mesh` is as it was recorded.
    pub(super) fn has_contents(&self, id: AssetId<Mesh>, mesh: &Mesh) -> bool {
        let noted = self.contents.get(&id);
        noted.is_some_and(|noted| hash_of(mesh).is_ok_and(|hash| hash == *noted))
    }

    /// Drops the data of a removed mesh.
    pub(super) fn remove(&mut self, mesh: AssetId<Mesh>) {
        self.meshes.remove(&mesh);
        self.contents.remove(&mesh);
    }

    /// Whether a mesh has changed and has not yet stayed unchanged for long enough.
    pub(super) fn contains(&self, mesh: AssetId<Mesh>) -> bool {
        let changing = self.meshes.get(&mesh);
        changing.is_some_and(|changing| changing.changed_at.is_some())
    }

    /// Ends a frame, and returns the meshes that have stayed unchanged long enough.
    pub(super) fn take_stable(&mut self) -> Vec<AssetId<Mesh>> {
        self.frame = self.frame.wrapping_add(1);
        let mut stable = Vec::new();
        for (id, changing) in &mut self.meshes {
            let is_stable = |&at: &u32| self.frame.wrapping_sub(at) > changing.wait_frames;
            if changing.changed_at.take_if(|at| is_stable(at)).is_some() {
                stable.push(*id);
                // The log names each mesh once.
                if changing.changes < MANY_CHANGES {
                    changing.changes = 0;
                }
            }
        }
        stable
    }
}

/// The hash of everything that levels depend on. It is the same only within one run of a program.
fn hash_of(mesh: &Mesh) -> Result<u64, MeshAccessError> {
    let hasher = &mut FixedHasher.build_hasher();
    mesh.asset_usage.bits().hash(hasher);
    mesh.primitive_topology().hash(hasher);
    for (attribute, values) in mesh.try_attributes()? {
        attribute.id.hash(hasher);
        discriminant(values).hash(hasher);
        values.get_bytes().hash(hasher);
    }
    match mesh.try_indices_option()? {
        Some(Indices::U16(indices)) => indices.hash(hasher),
        Some(Indices::U32(indices)) => indices.hash(hasher),
        None => {}
    }
    if mesh.try_has_morph_targets()? {
        for at in mesh.try_morph_targets()? {
            let deltas = [at.position, at.normal, at.tangent];
            deltas
                .map(|delta| delta.to_array().map(f32::to_bits))
                .hash(hasher);
        }
    }
    Ok(hasher.finish())
}
