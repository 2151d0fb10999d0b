//! The levels without measured deviations, and the tasks that measure them.

use std::sync::Arc;

use bevy::asset::AssetId;
use bevy::prelude::*;
use bevy::tasks::{Task, block_on, poll_once};

use crate::api::events::{LodError, asset_name};
use crate::prepare::job::PreparedMesh;
use crate::scene::lod_mesh::LodMesh;
use crate::scene::lod_scene::LodScene;

/// Levels without measured deviations, once these are needed.
#[derive(Default)]
pub(in crate::prepare) struct Measuring {
    /// Whether there was a camera with a guarantee.
    pub(in crate::prepare) is_needed: bool,
    /// Those that are not started.
    pub(in crate::prepare) waiting: Vec<(AssetId<Mesh>, Arc<LodMesh>)>,
    pub(in crate::prepare) running: Vec<MeasureTask>,
}

/// The task that bakes a mesh again.
pub(in crate::prepare) struct MeasureTask {
    pub(in crate::prepare) mesh: AssetId<Mesh>,
    pub(in crate::prepare) levels: Arc<LodMesh>,
    pub(in crate::prepare) task: Task<Result<PreparedMesh, LodError>>,
    pub(in crate::prepare) triangles: u32,
}

impl Measuring {
    /// Adds levels, if deviations are needed and they have none.
    pub(in crate::prepare) fn add(&mut self, mesh: AssetId<Mesh>, levels: &Arc<LodMesh>) {
        if self.is_needed && !levels.is_measured {
            self.waiting.push((mesh, levels.clone()));
        }
    }

    /// Drops the levels of a mesh.
    pub(in crate::prepare) fn drop_levels(&mut self, mesh: AssetId<Mesh>) {
        self.waiting.retain(|(of, _)| *of != mesh);
        self.running.retain(|measured| measured.mesh != mesh);
    }

    /// The triangles of each mesh that is being measured.
    pub(in crate::prepare) fn triangles(&self) -> impl Iterator<Item = u32> {
        self.running.iter().map(|measured| measured.triangles)
    }

    /// Gives levels the deviations that were measured.
    pub(in crate::prepare) fn collect(&mut self, scene: &mut LodScene, assets: &AssetServer) {
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
pub(in crate::prepare) fn warn_of_unmeasured(assets: &AssetServer, mesh: AssetId<Mesh>) {
    let name = asset_name(assets, mesh);
    warn!(
        "{name} has no measured deviations, which `displacement_px` needs; drawing its source mesh"
    );
}
