//! Prepares the coarsest level of meshes of `.fieldpages` files, which is always resident.

use std::sync::{Arc, OnceLock};

use bevy::prelude::*;
use fieldlod_select::GroupTable;

use super::mesh_in_pages::MeshInPages;
use super::streams::PageStreams;
use crate::api::config::LodKind;
use crate::api::events::{FieldLodEvent, LodError, LodOrigin, asset_name};
use crate::assets::baked_lods::BakedLods;
use crate::assets::standalone::{AwaitsFile, LodMesh3d, StandaloneMesh, StandaloneMeshes};
use crate::prepare::{LodMeshes, PreparedMesh, piece_of};
use crate::scene::lod_scene::LodScene;

/// Makes the meshes of entities whose `.fieldpages` file is loaded.
pub(super) fn make_meshes(
    waiting: Query<&LodMesh3d, With<AwaitsFile>>,
    files: Res<Assets<BakedLods>>,
    mut known: ResMut<StandaloneMeshes>,
    mut lods: ResMut<LodMeshes>,
    mut streams: ResMut<PageStreams>,
    mut meshes: ResMut<Assets<Mesh>>,
    assets: Res<AssetServer>,
) {
    for wanted in &waiting {
        let file = files.get(&wanted.file);
        let Some(pages) = file.and_then(|file| file.pages.as_ref()) else {
            continue;
        };
        if known.0.contains_key(&wanted.key()) {
            continue;
        }
        let name = asset_name(&assets, wanted.file.id());
        let found = MeshInPages::find(pages, wanted, &name);
        let made = found.and_then(|mesh| {
            let coarsest = mesh.coarsest()?;
            let source = meshes.add(coarsest);
            streams.sources.insert(source.id(), mesh.clone());
            let provider =
                move || -> bevy::tasks::BoxedFuture<'static, _> { Box::pin(prepare(mesh.clone())) };
            lods.set_provider(source.id(), Arc::new(provider));
            Ok(StandaloneMesh { source, lods: None })
        });
        known.insert(wanted, made);
    }
}

/// Prepares the first page of a mesh.
async fn prepare(mesh: MeshInPages) -> Result<PreparedMesh, LodError> {
    let hierarchy = &mesh.paged().graph;
    let units = hierarchy.units.iter();
    let mut pieces: Vec<_> = units
        .map(|unit| piece_of(hierarchy, unit, OnceLock::new()))
        .collect();
    let mut meshes = Vec::new();
    for unit in mesh.first_page()? {
        pieces[unit.index as usize].aabb = OnceLock::from(unit.aabb);
        meshes.push((unit.index, unit.mesh));
    }
    Ok(PreparedMesh {
        kind: LodKind::Clusters,
        rig: None,
        origin: LodOrigin::File,
        is_stored: true,
        table: GroupTable::new(hierarchy),
        pieces,
        meshes,
        units: None,
        triangles_full: hierarchy.source_triangle_count() as u32,
        is_measured: hierarchy.is_measured(),
        kept: None,
    })
}

/// Streams the pages of meshes whose first page is in the scene.
pub(super) fn stream_ready_meshes(
    mut events: MessageReader<FieldLodEvent>,
    lods: Res<LodMeshes>,
    mut streams: ResMut<PageStreams>,
    mut scene: ResMut<LodScene>,
) {
    for event in events.read() {
        if let FieldLodEvent::Ready { mesh, .. } = event
            && let Some(source) = streams.sources.get(mesh).cloned()
            && let Some(lod) = lods.ready(*mesh).next()
        {
            streams.add(lod, source, &mut scene);
        }
    }
}

/// Drops the data of source meshes that were removed.
pub(super) fn remove_sources(
    mut events: MessageReader<AssetEvent<Mesh>>,
    mut streams: ResMut<PageStreams>,
) {
    for event in events.read() {
        if let AssetEvent::Removed { id } = event {
            streams.sources.remove(id);
        }
    }
}
