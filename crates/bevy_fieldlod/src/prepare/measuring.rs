//! The levels without measured deviations, and the tasks that measure them.

use std::sync::Arc;

use bevy::asset::AssetId;
use bevy::prelude::*;
use bevy::tasks::{Task, block_on, poll_once};

use super::job::PreparedMesh;
use crate::api::events::{LodError, asset_name};
use crate::scene::lod_mesh::LodMesh;
use crate::scene::lod_scene::LodScene;

/// Levels without measured deviations, once these are needed.
#[derive(Default)]
pub(super) struct Measuring {
    /// Whether there was a camera with a guarantee.
    pub(super) is_needed: bool,
    /// Those that are not started.
    pub(super) waiting: Vec<(AssetId<Mesh>, Arc<LodMesh>)>,
    pub(super) running: Vec<MeasureTask>,
}

/// The task that bakes a mesh again.
pub(super) struct MeasureTask {
    pub(super) mesh: AssetId<Mesh>,
    pub(super) levels: Arc<LodMesh>,
    pub(super) task: Task<Result<PreparedMesh, LodError>>,
    pub(super) triangles: u32,
}

impl Measuring {
    /// Adds levels, if deviations are needed and they have none.
    pub(super) fn add(&mut self, mesh: AssetId<Mesh>, levels: &Arc<LodMesh>) {
        if self.is_needed && !levels.is_measured {
            self.waiting.push((mesh, levels.clone()));
        }
    }

    /// Drops the levels of a mesh.
    pub(super) fn drop_levels(&mut self, mesh: AssetId<Mesh>) {
        self.waiting.retain(|(of, _)| *of != mesh);
        self.running.retain(|measured| measured.mesh != mesh);
    }

    /// The triangles of each mesh that is being measured.
    pub(super) fn triangles(&self) -> impl Iterator<Item = u32> {
        self.running.iter().map(|measured| measured.triangles)
    }

    /// Gives levels the deviations that were measured.
    pub(super) fn collect(&mut self, scene: &mut LodScene, assets: &AssetServer) {
        self.running.retain_mut(|measured| {
            let Some(result) = block_on(poll_once(&mut measured.task)) else {
                return true;
            };
            let id = measured.levels.id;
            let is_replaced = result.is_ok_and(|prepared| {
                prepared.is_measured && scene.scene.replace_table(id, prepared.table)
            });
            if !is_replaced {
                warn_of_unmeasured(assets, measured.mesh);
            }
            false
        });
    }
}

/// Logs a mesh that a camera with a guarantee draws at full detail.
pub(super) fn warn_of_unmeasured(assets: &AssetServer, mesh: AssetId<Mesh>) {
    let name = asset_name(assets, mesh);
    warn!(
        "{name} has no measured deviations, which `displacement_px` needs; drawing its source mesh"
    );
}
