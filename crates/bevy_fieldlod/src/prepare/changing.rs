//! Meshes that a program changes, such as water, cloth, or a terrain with digging.
//!
//! Levels of such a mesh would be stale before they are baked. Its source is drawn, and its levels are prepared again
//! once it stays unchanged for a while. The time doubles each time that the mesh changes again.

use bevy::asset::AssetId;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;

use crate::api::events::asset_name;

/// Frames that a mesh must stay unchanged after its first change, and the upper limit of that time.
const REST: [u32; 2] = [30, 960];
/// Number of changes after which the log names the mesh.
const MANY_CHANGES: u32 = 30;

/// All meshes that have changed since their first preparation.
#[derive(Default)]
pub(crate) struct ChangingMeshes {
    meshes: HashMap<AssetId<Mesh>, ChangingMesh>,
    frame: u32,
}

struct ChangingMesh {
    /// The frame of the last change; `None` once it has stayed unchanged.
    changed_at: Option<u32>,
    /// Frames that it must stay unchanged.
    rest: u32,
    changes: u32,
}

impl ChangingMeshes {
    /// Records a change of a mesh that has entries or that has changed before.
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
            let name = asset_name(assets, mesh);
            info!(
                "{name} changes every few frames; drawing the source mesh until it stays unchanged for {} \
                 frames",
                changing.rest
            );
        }
    }

    /// Drops the data of a removed mesh.
    pub(super) fn forget(&mut self, mesh: AssetId<Mesh>) {
        self.meshes.remove(&mesh);
    }

    /// Whether a mesh has changed and has not stayed unchanged since.
    pub(super) fn contains(&self, mesh: AssetId<Mesh>) -> bool {
        let changing = self.meshes.get(&mesh);
        changing.is_some_and(|changing| changing.changed_at.is_some())
    }

    /// Ends a frame, and returns the meshes that have stayed unchanged long enough.
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
