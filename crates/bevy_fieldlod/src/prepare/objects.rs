//! Gives levels of detail to the mesh entities that wait for them.

use std::cell::OnceCell;

use bevy::camera::visibility::{NoAutoAabb, NoCpuCulling};
use bevy::mesh::morph::MeshMorphWeights;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::pbr::Lightmap;
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;

use super::lookup::{LodMeshEntry, LodMeshLookup, LodMeshes};
use crate::api::config::LodKind;
use crate::api::events::{LodFailed, LodReady, asset_name};
use crate::api::stats::FieldLodProgress;
use crate::cards::LodCards;
use crate::draw::gpu_culling::GpuCulling;
use crate::scene::lod_mesh::{
    LodClusters, LodObject, LodPlain, LodSimplified, LodSource, LodState, LodWaiting,
};

/// Leaves skinned and morphed meshes as they are.
pub(super) fn skip_unsupported_objects(
    mut commands: Commands,
    waiting: Query<(Entity, &Mesh3d, Has<SkinnedMesh>, Has<MeshMorphWeights>), Added<LodWaiting>>,
    mut logged: Local<HashSet<AssetId<Mesh>>>,
    assets: Res<AssetServer>,
) {
    for (entity, mesh, skinned, morphed) in &waiting {
        let reason = match (skinned, morphed) {
            (true, _) => "it is skinned",
            (_, true) => "it has morph targets",
            _ => continue,
        };
        // Its other instances, and a scene that is spawned again, need no second line.
        if logged.insert(mesh.id()) {
            let name = asset_name(&assets, mesh.id().untyped());
            info!("{name} is drawn as it is: {reason}");
        }
        let mut commands = commands.entity(entity);
        commands
            .try_remove::<LodWaiting>()
            .try_insert((LodPlain, LodState::Plain));
    }
}

/// Looks up the levels of detail of waiting entities, and makes objects of those whose levels the GPU
/// has.
pub(super) fn give_levels_to_objects(
    mut commands: Commands,
    waiting: Query<(
        Entity,
        &Mesh3d,
        &LodWaiting,
        Has<NoAutoAabb>,
        Option<&MeshMaterial3d<StandardMaterial>>,
        Has<Lightmap>,
    )>,
    ready: Query<(&LodSource, &MeshMaterial3d<StandardMaterial>)>,
    mut lookup: LodMeshLookup,
    culling: Res<GpuCulling>,
) {
    lookup.try_again();
    // Only what is baked together asks for those of other meshes. Of each mesh, that of the first entity.
    let materials: OnceCell<HashMap<AssetId<Mesh>, AssetId<StandardMaterial>>> = OnceCell::new();
    let all_materials = || {
        let waiting = waiting.iter().filter_map(|(_, mesh, _, _, material, _)| {
            let material: &MeshMaterial3d<StandardMaterial> = material?;
            Some((mesh.id(), material.id()))
        });
        let ready = ready
            .iter()
            .map(|(source, material)| (source.mesh.id(), material.id()));
        let mut first = HashMap::new();
        for (mesh, material) in waiting.chain(ready) {
            first.entry(mesh).or_insert(material);
        }
        first
    };
    for (entity, mesh, wanted, has_no_auto_aabb, material, has_lightmap) in &waiting {
        let mut commands = commands.entity(entity);
        let own = material.map(|material| material.id());
        let material_of = |other: AssetId<Mesh>| match other == mesh.id() {
            true => own,
            false => materials.get_or_init(all_materials).get(&other).copied(),
        };
        match lookup.find(mesh.id(), &wanted.auto_lod, !has_lightmap, &material_of) {
            Some(LodMeshEntry::Plain(error)) => {
                commands
                    .try_insert((LodPlain, LodState::Plain))
                    .try_remove::<LodWaiting>();
                if let Some(error) = error.clone() {
                    commands.trigger(|entity| LodFailed { entity, error });
                }
            }
            Some(LodMeshEntry::Ready(lod)) if lod.is_uploaded() => {
                // A box around all levels. Bevy would change it with each, and read meshes that only
                // the GPU has.
                let keeps_aabb = lod.kind == LodKind::WholeMesh && !has_no_auto_aabb;
                if let Some(aabb) = lod.aabb.filter(|_| keeps_aabb) {
                    commands.try_insert((NoAutoAabb, aabb));
                }
                let object = LodObject {
                    mesh: lod.clone(),
                    auto_lod: wanted.auto_lod.clone(),
                };
                let source = LodSource {
                    mesh: mesh.0.clone(),
                    keeps_aabb,
                };
                if culling.is_on {
                    commands.try_insert(NoCpuCulling);
                }
                if lod.kind == LodKind::Clusters {
                    commands.try_insert(LodClusters);
                }
                if lod.cards.is_some() {
                    commands.try_insert(LodCards::new(lod));
                }
                if let Some(mesh) = lod.simplified.clone() {
                    commands.try_insert(LodSimplified { mesh });
                }
                let kind = lod.kind;
                commands
                    .try_insert((source, object, LodState::Ready(kind)))
                    .try_remove::<LodWaiting>()
                    .trigger(|entity| LodReady { entity, kind });
            }
            _ => {}
        }
    }
}

/// Counts how far the entities have come.
pub(super) fn update_progress(
    waiting: Query<(), With<LodWaiting>>,
    objects: Query<(), With<LodObject>>,
    plain: Query<(), With<LodPlain>>,
    known: Res<LodMeshes>,
    mut progress: ResMut<FieldLodProgress>,
) {
    progress.set_if_neq(FieldLodProgress {
        waiting: waiting.iter().len() as u32,
        baking: known.in_preparation.meshes,
        ready: objects.iter().len() as u32,
        plain: plain.iter().len() as u32,
    });
}
