//! Meshes that a program changes: water, cloth, a terrain that is dug into.
//!
//! Levels of such a mesh would be out of date before they are baked. It is drawn as it is, and prepared
//! anew once it has rested for a while: longer each time that it did not stay at rest. So is then what is baked with
//! it, as bark is with leaves, which keeps its levels until then.

use bevy::asset::AssetId;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;

use crate::api::events::asset_name;

/// Frames that a mesh must rest after its first change, and at most.
const REST: [u32; 2] = [30, 960];
/// So many changes without a rest are worth a line in the log.
const MANY_CHANGES: u32 = 30;

/// All meshes that have changed since they were first prepared.
#[derive(Default)]
pub(crate) struct ChangingMeshes {
    meshes: HashMap<AssetId<Mesh>, ChangingMesh>,
    frame: u32,
}

struct ChangingMesh {
    /// The frame of the last change; `None` while it is at rest.
    changed_at: Option<u32>,
    /// Frames for which it has to rest.
    rest: u32,
    changes: u32,
}

impl ChangingMeshes {
    /// Notes a change of a mesh that levels are known of or are being prepared, or that has changed before.
    pub(super) fn note(&mut self, mesh: AssetId<Mesh>, is_known: bool, assets: &AssetServer) {
        let changing = match self.meshes.get_mut(&mesh) {
            Some(changing) => changing,
            None if is_known => self.meshes.entry(mesh).or_insert(ChangingMesh {
                changed_at: None,
                rest: REST[0] / 2,
                changes: 0,
            }),
            None => return,
        };
        if changing.changed_at.is_none() {
            changing.rest = (changing.rest * 2).min(REST[1]);
        }
        changing.changed_at = Some(self.frame);
        changing.changes += 1;
        if changing.changes == MANY_CHANGES {
            let name = asset_name(assets, mesh.untyped());
            info!("{name} changes again and again: it is drawn as it is until it rests");
        }
    }

    /// Forgets a mesh that is gone.
    pub(super) fn forget(&mut self, mesh: AssetId<Mesh>) {
        self.meshes.remove(&mesh);
    }

    /// Whether a mesh has changed and not rested since.
    pub(super) fn contains(&self, mesh: AssetId<Mesh>) -> bool {
        let changing = self.meshes.get(&mesh);
        changing.is_some_and(|changing| changing.changed_at.is_some())
    }

    /// Ends a frame, and returns the meshes that are at rest now.
    pub(super) fn take_rested(&mut self) -> Vec<AssetId<Mesh>> {
        self.frame = self.frame.wrapping_add(1);
        let mut rested = Vec::new();
        for (id, changing) in &mut self.meshes {
            let has_rested = |&at: &u32| self.frame.wrapping_sub(at) > changing.rest;
            if changing.changed_at.take_if(|at| has_rested(at)).is_some() {
                rested.push(*id);
            }
        }
        rested
    }
}
