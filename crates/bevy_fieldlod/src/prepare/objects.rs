//! Turns waiting mesh entities into objects with levels of detail.

use std::cell::OnceCell;
use std::sync::Arc;

use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::NoCpuCulling;
use bevy::ecs::system::SystemParam;
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;

use super::lookup::{LodMeshEntry, LodMeshLookup, LodMeshes};
use crate::api::config::LodKind;
use crate::api::events::{LodError, LodFailed, LodReady, asset_name};
use crate::api::stats::FieldLodProgress;
use crate::draw::drawn_meshes::DrawnMeshes;
use crate::draw::gpu_culling::GpuCulling;
use crate::scene::lod_mesh::{LodMesh, LodObject, LodState, LodWaiting};

/// Logs meshes that cannot have levels of detail: one mesh for each reason.
#[derive(SystemParam)]
pub(super) struct UnsupportedLog<'w, 's> {
    logged: Local<'s, HashSet<String>>,
    assets: Res<'w, AssetServer>,
    names: Query<'w, 's, &'static Name>,
}

impl UnsupportedLog<'_, '_> {
    fn add(&mut self, entity: Entity, mesh: AssetId<Mesh>, reason: String) {
        // A scene may have thousands of such meshes.
        if self.logged.contains(&reason) {
            return;
        }
        let asset = asset_name(&self.assets, mesh);
        let name = self.names.get(entity);
        let name = name.map_or(asset.clone(), |name| format!("{name} ({asset})"));
        info!(
            "{name} cannot have levels of detail: {reason}; drawing the source mesh. Other meshes with the same reason \
             are not logged"
        );
        self.logged.insert(reason);
    }
}

type Material = MeshMaterial3d<StandardMaterial>;

/// A mesh entity that waits for its levels.
type Waiting = (
    Entity,
    &'static Mesh3d,
    &'static LodWaiting,
    Option<&'static Material>,
);

/// Orders waiting entities, since their tasks start in this order.
#[derive(SystemParam)]
pub(super) struct StartOrder<'w, 's> {
    waiting: Query<'w, 's, Placed, With<LodWaiting>>,
    cameras: Query<'w, 's, &'static GlobalTransform, With<Camera3d>>,
}

/// A waiting entity, and its place.
type Placed = (Entity, Ref<'static, GlobalTransform>, Option<&'static Aabb>);

impl StartOrder<'_, '_> {
    /// The waiting entities, the largest on a screen first, and whether the task of each may start. The size of a new
    /// entity is not known in its first frame. It gets levels that are ready; its task starts in the next frame.
    fn entities(&self) -> Vec<(Entity, bool)> {
        let waiting = self.waiting.iter();
        let mut sizes: Vec<(f32, Entity, bool)> = waiting
            .map(|(entity, place, aabb)| {
                // Without a camera, as on a server, no order is better than another.
                let may_start = !place.is_added() || self.cameras.is_empty();
                let size = if may_start {
                    self.size(&place, aabb)
                } else {
                    0.0
                };
                (size, entity, may_start)
            })
            .collect();
        // The order of entities breaks ties, so that starts do not depend on the storage of components.
        sizes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let sorted = sizes.into_iter();
        sorted
            .map(|(_, entity, may_start)| (entity, may_start))
            .collect()
    }

    /// The radius over the distance, for the nearest camera.
    fn size(&self, transform: &GlobalTransform, aabb: Option<&Aabb>) -> f32 {
        let aabb = aabb.copied().unwrap_or_default();
        let radius = transform.radius_vec3a(aabb.half_extents);
        let center = transform.transform_point(aabb.center.into());
        let distances = self.cameras.iter();
        let distances = distances.map(|pose| pose.translation().distance(center));
        radius
            / distances
                .fold(f32::INFINITY, f32::min)
                .max(f32::MIN_POSITIVE)
    }
}

/// Looks up the levels of waiting entities, and inserts those that are ready.
pub(super) fn give_levels_to_objects(
    mut commands: Commands,
    waiting: Query<Waiting>,
    order: StartOrder,
    ready: Query<(&Mesh3d, &Material), With<LodObject>>,
    mut lookup: LodMeshLookup,
    culling: Res<GpuCulling>,
    drawn: Res<DrawnMeshes>,
    mut log: UnsupportedLog,
) {
    lookup.begin_frame();
    // Only bakes of several primitives need the materials of other entities.
    let materials = OnceCell::new();
    let all_materials = || first_materials(&waiting, &ready);
    for (entity, may_start) in order.entities() {
        let Ok((_, mesh, wanted, material)) = waiting.get(entity) else {
            continue;
        };
        let own = material.map(|material| material.id());
        let material_of = |other: AssetId<Mesh>| {
            if other == mesh.id() {
                own
            } else {
                materials.get_or_init(all_materials).get(&other).copied()
            }
        };
        let mut commands = commands.entity(entity);
        match lookup.find(mesh.id(), &wanted.auto_lod, may_start, &material_of) {
            Some(LodMeshEntry::Plain(error)) => {
                if let Some(error) = error.as_ref().filter(|error| error.is_unsupported()) {
                    log.add(entity, mesh.id(), error.to_string());
                }
                leave_plain(&mut commands, error.clone());
            }
            Some(LodMeshEntry::Ready(lod)) if lod.is_uploaded() => {
                // The CPU culls characters, because Bevy animates visible ones only.
                if culling.is_on && lod.rig.is_none() {
                    commands.try_insert(NoCpuCulling);
                }
                let finest = lod.mesh_at(0).filter(|_| lod.kind == LodKind::WholeMesh);
                if finest.is_some() {
                    // The source is in main memory only, so that a copy of it is the finest level.
                    drawn.set(entity, finest);
                }
                give_levels(&mut commands, lod, mesh, wanted);
            }
            _ => {}
        }
    }
}

/// The material of the first entity with each mesh.
fn first_materials(
    waiting: &Query<Waiting>,
    ready: &Query<(&Mesh3d, &Material), With<LodObject>>,
) -> HashMap<AssetId<Mesh>, AssetId<StandardMaterial>> {
    let waiting = waiting.iter();
    let waiting = waiting.filter_map(|(_, mesh, _, material)| Some((mesh.id(), material?.id())));
    let ready = ready.iter();
    let ready = ready.map(|(mesh, material)| (mesh.id(), material.id()));
    let mut first = HashMap::new();
    for (mesh, material) in waiting.chain(ready) {
        first.entry(mesh).or_insert(material);
    }
    first
}

/// Marks an entity whose source mesh is drawn.
fn leave_plain(commands: &mut EntityCommands, error: Option<LodError>) {
    commands
        .try_insert(LodState::Plain)
        .try_remove::<LodWaiting>();
    if let Some(error) = error {
        commands.trigger(|entity| LodFailed { entity, error });
    }
}

/// Makes an entity an object with levels of detail.
fn give_levels(
    commands: &mut EntityCommands,
    lod: &Arc<LodMesh>,
    mesh: &Mesh3d,
    wanted: &LodWaiting,
) {
    let kind = lod.kind;
    let object = LodObject {
        mesh: lod.clone(),
        source: mesh.id(),
        auto_lod: wanted.auto_lod.clone(),
    };
    commands
        .try_insert((object, LodState::Ready(kind)))
        .try_remove::<LodWaiting>()
        .trigger(|entity| LodReady { entity, kind });
}

/// Counts mesh entities by their state.
pub(super) fn update_progress(
    waiting: Query<(), With<LodWaiting>>,
    objects: Query<(), With<LodObject>>,
    plain: Query<(), (With<LodState>, Without<LodWaiting>, Without<LodObject>)>,
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
