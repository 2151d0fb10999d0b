//! Collects what background tasks have prepared.

use std::sync::Arc;

use bevy::prelude::*;
use bevy::tasks::{block_on, poll_once};

use super::job::PreparedMesh;
use super::lookup::{LodMeshEntry, LodMeshes};
use crate::api::config::LodKind;
use crate::api::events::{FieldLodEvent, asset_name, asset_path};
use crate::draw::upload::PiecesToSend;
use crate::pages::PageStreams;
use crate::scene::lod_mesh::{LodMesh, LodPiece};
use crate::scene::lod_scene::LodScene;

/// Collects the meshes whose tasks have ended.
pub(super) fn collect_prepared_meshes(
    known: ResMut<LodMeshes>,
    mut scene: ResMut<LodScene>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut to_send: ResMut<PiecesToSend>,
    mut streams: ResMut<PageStreams>,
    mut images: Option<ResMut<Assets<Image>>>,
    assets: Res<AssetServer>,
    mut events: MessageWriter<FieldLodEvent>,
) {
    let known = known.into_inner();
    let mut levels_of = Vec::new();
    for (mesh, entry) in known.entries_mut() {
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
                    mesh,
                    path: asset_path(&assets, mesh),
                    kind: prepared.kind,
                    origin: prepared.origin,
                });
                if !prepared.is_measured {
                    let name = asset_name(&assets, mesh.untyped());
                    scene.unmeasured.push(name);
                }
                let in_pages = prepared.in_pages.clone();
                let lod = add_mesh(
                    prepared,
                    &mut scene,
                    &mut meshes,
                    images.as_deref_mut(),
                    &mut to_send,
                );
                if lod.kind == LodKind::WholeMesh {
                    levels_of.extend(lod.piece_meshes().map(|level| (level, mesh)));
                }
                if let Some(in_pages) = in_pages {
                    streams.add(&lod, in_pages, &mut scene);
                }
                *entry = LodMeshEntry::Ready(lod);
            }
            Err(error) => {
                events.write(FieldLodEvent::failed(&assets, mesh, error.clone()));
                *entry = LodMeshEntry::Plain(Some(error));
            }
        }
    }
    known.source_of_level.extend(levels_of);
    known.count_in_preparation();
    // Files may change until the next mesh asks for them.
    if known.in_preparation.meshes == 0 {
        known.sidecars.clear();
        #[cfg(feature = "bake")]
        known.together.clear();
        #[cfg(feature = "bake")]
        known.surfaces.clear();
    }
}

/// Adds a mesh to the scene, and lets what draws its units be sent.
fn add_mesh(
    prepared: PreparedMesh,
    scene: &mut LodScene,
    meshes: &mut Assets<Mesh>,
    images: Option<&mut Assets<Image>>,
    to_send: &mut PiecesToSend,
) -> Arc<LodMesh> {
    let mut sent = Vec::new();
    let mut reserve = |mesh: Mesh| {
        let handle = meshes.reserve_handle();
        sent.push((handle.clone(), mesh));
        handle
    };
    let pieces = prepared.pieces.into_iter().map(|(piece, mesh)| LodPiece {
        mesh: mesh.map(&mut reserve),
        ..piece
    });
    let pieces = pieces.collect();
    let lod = LodMesh {
        id: scene.scene.add_table(prepared.table),
        kind: prepared.kind,
        pieces,
        triangles_full: prepared.triangles_full,
        aabb: prepared.aabb,
        uv_per_area: prepared.uv_per_area,
        simplified: prepared.simplified.map(|mesh| meshes.add(mesh)),
        uploaded: to_send.push(sent),
        in_pages: default(),
        cards: prepared
            .picture
            .zip(images)
            .map(|(picture, images)| picture.add_to(images)),
    };
    Arc::new(lod)
}
