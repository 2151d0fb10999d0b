//! Measures the deviations of levels that were baked without them.
//!
//! Deviations take half or more of the bake of most static meshes, and only cameras with a guarantee read them. So bakes
//! at run time measure none until there is such a camera. Meshes that are ready by then are baked again in the
//! background. The levels are the same, so that other cameras see no change.

pub(super) mod measuring;

use bevy::asset::AssetId;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;

use super::lookup::{LodMeshEntry, LodMeshLookup, LodMeshes, NotStarted};
use crate::api::bake_material::MaterialToBake;
use crate::api::settings::FieldLodCamera;
use crate::scene::lod_mesh::LodObject;
use crate::scene::lod_scene::LodScene;
use measuring::{MeasureTask, warn_of_unmeasured};

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
    objects: Query<(&LodObject, MaterialToBake)>,
    mut lookup: LodMeshLookup,
    mut scene: ResMut<LodScene>,
) {
    let (mut users, mut materials) = (HashMap::new(), HashMap::new());
    for (object, material) in &objects {
        users.entry(object.mesh.id).or_insert(&object.auto_lod);
        if let Some(material) = material.id() {
            materials.entry(object.source).or_insert(material);
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
