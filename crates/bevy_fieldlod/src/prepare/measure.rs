//! Measures the deviations of levels that were baked without them.
//!
//! Two thirds of a bake of a static mesh measure deviations, which only cameras with a guarantee read. So bakes at run
//! time measure none until there is such a camera. Meshes that are ready by then are baked again in the background. The
//! levels are the same, so that other cameras see no change.

use std::sync::Arc;

use bevy::asset::AssetId;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::tasks::{Task, block_on, poll_once};

use super::job::PreparedMesh;
use super::lookup::{LodMeshEntry, LodMeshLookup, LodMeshes, NotStarted};
use crate::api::events::{LodError, asset_name};
use crate::api::settings::FieldLodCamera;
use crate::scene::lod_mesh::{LodMesh, LodObject};
use crate::scene::lod_scene::LodScene;

/// Levels without measured deviations, once these are needed.
#[derive(Default)]
pub(super) struct Measuring {
    /// Whether there was a camera with a guarantee.
    pub(super) is_needed: bool,
    /// Those that are not started.
    waiting: Vec<(AssetId<Mesh>, Arc<LodMesh>)>,
    running: Vec<MeasureTask>,
}

struct MeasureTask {
    mesh: AssetId<Mesh>,
    levels: Arc<LodMesh>,
    task: Task<Result<PreparedMesh, LodError>>,
    triangles: u32,
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

fn warn_of_unmeasured(assets: &AssetServer, mesh: AssetId<Mesh>) {
    let name = asset_name(assets, mesh);
    warn!(
        "{name} has no measured deviations, which `displacement_px` needs; drawing its source mesh"
    );
}

/// Whether the first camera with a guarantee is new.
pub(super) fn is_first_guarantee(cameras: Query<&FieldLodCamera>, known: Res<LodMeshes>) -> bool {
    let mut cameras = cameras.iter();
    !known.measuring.is_needed && cameras.any(|camera| camera.displacement_px.is_some())
}

/// Measures deviations from now on.
pub(super) fn begin_measuring(mut known: ResMut<LodMeshes>) {
    known.begin_measuring();
}

/// Whether levels wait to be measured.
pub(super) fn any_unmeasured(known: Res<LodMeshes>) -> bool {
    !known.measuring.waiting.is_empty()
}

/// Starts to measure levels, and drops those that no entity draws.
pub(super) fn measure_levels(
    objects: Query<(&LodObject, Option<&MeshMaterial3d<StandardMaterial>>)>,
    mut lookup: LodMeshLookup,
    mut scene: ResMut<LodScene>,
) {
    let (mut users, mut materials) = (HashMap::new(), HashMap::new());
    for (object, material) in &objects {
        users.entry(object.mesh.id).or_insert(&object.auto_lod);
        if let Some(material) = material {
            materials.entry(object.source).or_insert(material.id());
        }
    }
    let material_of = |mesh: AssetId<Mesh>| materials.get(&mesh).copied();
    for (mesh, levels) in std::mem::take(&mut lookup.known.measuring.waiting) {
        let started = match users.get(&levels.id) {
            Some(request) if lookup.may_measure(mesh, request) => {
                lookup.start_task(mesh, request, &material_of)
            }
            None if !lookup.known.has_provider(mesh) => {
                lookup.known.drop_levels(mesh, &mut scene);
                continue;
            }
            _ => Ok(LodMeshEntry::Plain(None)),
        };
        let measuring = &mut lookup.known.measuring;
        match started {
            Ok(LodMeshEntry::Preparing(task, triangles)) => measuring.running.push(MeasureTask {
                mesh,
                levels,
                task,
                triangles,
            }),
            Err(NotStarted::NotYet) => measuring.waiting.push((mesh, levels)),
            Ok(_) | Err(NotStarted::Failed(_)) => warn_of_unmeasured(&lookup.assets, mesh),
        }
    }
}
