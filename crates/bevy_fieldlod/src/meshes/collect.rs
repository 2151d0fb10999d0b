//! Collects what background tasks have prepared.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use bevy::prelude::*;
use bevy::tasks::{block_on, poll_once};

use super::lookup::{LodMeshEntry, LodMeshes};
use super::prepare::PreparedMesh;
use crate::config::LodKind;
use crate::events::{FieldLodEvent, asset_name, asset_path};
use crate::lod_mesh::{LodMesh, LodPiece};
use crate::lod_scene::LodScene;
use crate::upload::UploadQueue;

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
    for (key, entry) in &mut known.entries {
        let LodMeshEntry::Preparing(task, _) = entry else {
            continue;
        };
        // Asked without waiting: a task that is not done yet is asked again in the next frame.
        let Some(result) = block_on(poll_once(task)) else {
            continue;
        };
        match result {
            Ok(prepared) => {
                events.write(FieldLodEvent::Ready {
                    mesh: key.mesh,
                    path: asset_path(&assets, key.mesh),
                    kind: prepared.kind,
                    origin: prepared.origin,
                });
                if !prepared.is_measured {
                    let name = asset_name(&assets, key.mesh.untyped());
                    scene.unmeasured.push(name);
                }
                let lod = add_mesh(prepared, &mut scene, &mut meshes);
                if lod.kind == LodKind::WholeMesh {
                    let levels = lod.piece_meshes().map(|level| (level, key.mesh));
                    known.source_of_level.extend(levels);
                }
                uploads.push(lod.clone());
                *entry = LodMeshEntry::Ready(lod);
            }
            Err(error) => {
                events.write(FieldLodEvent::failed(&assets, key.mesh, error.clone()));
                *entry = LodMeshEntry::Plain(Some(error));
            }
        }
    }
    known.count_in_preparation();
    // Files may change until the next mesh asks for them.
    if known.in_preparation.meshes == 0 {
        known.sidecars.clear();
    }
}

/// Adds a mesh to the scene, and what draws its units to the assets.
fn add_mesh(
    prepared: PreparedMesh,
    scene: &mut LodScene,
    meshes: &mut Assets<Mesh>,
) -> Arc<LodMesh> {
    let pieces = prepared.pieces.into_iter().map(|(piece, mesh)| LodPiece {
        mesh: mesh.map(|mesh| meshes.add(mesh)),
        ..piece
    });
    Arc::new(LodMesh {
        id: scene.scene.add_table(prepared.table),
        kind: prepared.kind,
        pieces: pieces.collect(),
        triangles_full: prepared.triangles_full,
        aabb: prepared.aabb,
        uv_per_area: prepared.uv_per_area,
        uploaded: AtomicBool::new(false),
    })
}
