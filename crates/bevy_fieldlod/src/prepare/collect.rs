//! Collects the results of background tasks.

use std::sync::{Arc, Mutex};

use bevy::prelude::*;
use bevy::tasks::{block_on, poll_once};

use super::job::PreparedMesh;
use super::lookup::{LodMeshEntry, LodMeshes};
use crate::api::events::{FieldLodEvent, asset_path};
use crate::draw::upload::UploadQueue;
use crate::scene::lod_mesh::LodMesh;
use crate::scene::lod_scene::LodScene;

/// Collects the meshes whose tasks have ended.
pub(super) fn collect_prepared_meshes(
    known: ResMut<LodMeshes>,
    mut scene: ResMut<LodScene>,
    mut meshes: ResMut<Assets<Mesh>>,
    uploads: Res<UploadQueue>,
    assets: Res<AssetServer>,
    mut events: MessageWriter<FieldLodEvent>,
) {
    let known = known.into_inner();
    known.measuring.collect(&mut scene, &assets);
    let mut added = Vec::new();
    for (mesh, entry) in known.entries_mut() {
        let LodMeshEntry::Preparing(task, _) = entry else {
            continue;
        };
        // Polls without waiting.
        let Some(result) = block_on(poll_once(task)) else {
            continue;
        };
        *entry = match result {
            Ok(prepared) => {
                events.write(FieldLodEvent::Ready {
                    mesh,
                    path: asset_path(&assets, mesh),
                    kind: prepared.kind,
                    origin: prepared.origin,
                });
                let lod = add_mesh(prepared, &mut scene, &mut meshes, &uploads);
                added.push((mesh, lod.clone()));
                LodMeshEntry::Ready(lod)
            }
            Err(error) => {
                events.write(FieldLodEvent::failed(&assets, mesh, error.clone()));
                LodMeshEntry::Plain(Some(error))
            }
        };
    }
    for (mesh, lod) in added {
        known.measuring.add(mesh, &lod);
    }
    known.end_of_collection();
}

/// Adds a mesh to the scene, and sends its meshes to the GPU.
fn add_mesh(
    prepared: PreparedMesh,
    scene: &mut LodScene,
    meshes: &mut Assets<Mesh>,
    uploads: &UploadQueue,
) -> Arc<LodMesh> {
    let (resident, uploaded) = uploads.send(prepared.meshes, meshes);
    Arc::new(LodMesh {
        id: scene.scene.add_table(prepared.table),
        kind: prepared.kind,
        rig: prepared.rig,
        pieces: prepared.pieces,
        meshes: Mutex::new(resident),
        units: prepared.units,
        is_stored: prepared.is_stored,
        triangles_full: prepared.triangles_full,
        is_measured: prepared.is_measured,
        kept: prepared.kept,
        uploaded,
    })
}
