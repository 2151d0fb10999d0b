//! Turns waiting mesh entities into objects with levels of detail.

use std::cell::OnceCell;
use std::sync::Arc;

use bevy::asset::AssetPath;
use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::NoCpuCulling;
use bevy::ecs::system::SystemParam;
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;
use bevy::world_serialization::{WorldAssetRoot, WorldInstance, WorldInstanceSpawner};

use super::lookup::{Found, LodMeshEntry, LodMeshLookup, LodMeshes};
use crate::api::bake_material::MaterialToBake;
use crate::api::config::LodKind;
use crate::api::events::{LodError, LodFailed, LodReady, asset_path};
use crate::api::stats::FieldLodProgress;
use crate::assets::standalone::AwaitsFile;
use crate::draw::drawn_meshes::DrawnMeshes;
use crate::draw::gpu_culling::GpuCulling;
use crate::prepare::track::AutoLodLookup;
use crate::scene::lod_mesh::{LodMesh, LodObject, LodState, LodWaiting};

/// Logs meshes without levels of detail: each faulty mesh, one for each asset without baked levels, and of those of a
/// kind without levels one for each reason.
#[derive(SystemParam)]
pub(super) struct FailureLog<'w, 's> {
    reasons: Local<'s, HashSet<String>>,
    files: Local<'s, HashSet<AssetPath<'static>>>,
    faulty: Local<'s, HashSet<AssetId<Mesh>>>,
    assets: Res<'w, AssetServer>,
    names: Query<'w, 's, &'static Name>,
    parents: Query<'w, 's, &'static ChildOf>,
}

impl FailureLog<'_, '_> {
    fn add(&mut self, entity: Entity, mesh: AssetId<Mesh>, error: &LodError) {
        let path = self.assets.get_path(mesh);
        if let (LodError::BakeDisabled, Some(path)) = (error, path) {
            // A scene may have hundreds of meshes. Its `.fieldlod` file is missing, or baked from another version.
            let path = path.without_label().into_owned();
            if self.files.insert(path.clone()) {
                error!("could not prepare {path}: {error}; drawing its source meshes");
            }
        } else if !error.is_unsupported() {
            // A scene may have thousands of entities with the mesh.
            if self.faulty.insert(mesh) {
                let name = self.name_of(entity, mesh);
                error!("could not prepare {name}: {error}; drawing the source mesh");
            }
        } else if self.reasons.insert(error.to_string()) {
            let name = self.name_of(entity, mesh);
            info!(
                "{name} cannot have levels of detail: {error}; drawing the source mesh. Other meshes with the same \
                 reason are not logged"
            );
        }
    }

    /// The path of a mesh, and the nearest name at or above its entity.
    fn name_of(&self, entity: Entity, mesh: AssetId<Mesh>) -> String {
        let mut lineage = std::iter::once(entity).chain(self.parents.iter_ancestors(entity));
        let name = lineage.find_map(|entity| self.names.get(entity).ok());
        match (asset_path(&self.assets, mesh), name) {
            (Some(path), Some(name)) => format!("{name} ({path})"),
            (Some(path), None) => path,
            (None, Some(name)) => format!("the mesh of {name}"),
            (None, None) => format!("the mesh of entity {entity}"),
        }
    }
}

/// A mesh entity that waits for its levels.
type Waiting = (Entity, &'static Mesh3d, &'static LodWaiting, MaterialToBake);

/// Orders waiting entities, since their tasks start in this order.
#[derive(SystemParam)]
pub(super) struct StartOrder<'w, 's> {
    places: Query<'w, 's, (Ref<'static, GlobalTransform>, Option<&'static Aabb>)>,
    cameras: Query<'w, 's, &'static GlobalTransform, With<Camera3d>>,
}

impl StartOrder<'_, '_> {
    /// Sorts entities, the largest on a screen first, and drops new ones: their size is not known in their first frame.
    fn sort(&self, entities: &mut Vec<Entity>) {
        let mut sizes: Vec<(f32, Entity)> = Vec::with_capacity(entities.len());
        for &entity in entities.iter() {
            // Without a camera, as on a server, no order is better than another.
            if self.cameras.is_empty() {
                sizes.push((0.0, entity));
            } else if let Ok((place, aabb)) = self.places.get(entity)
                && !place.is_added()
            {
                sizes.push((self.size(&place, aabb), entity));
            }
        }
        // The order of entities breaks ties, so that starts do not depend on the storage of components.
        sizes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        entities.clear();
        entities.extend(sizes.into_iter().map(|(_, entity)| entity));
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

/// Gives entities the levels that were found for them.
#[derive(SystemParam)]
pub(super) struct Giver<'w, 's> {
    commands: Commands<'w, 's>,
    culling: Res<'w, GpuCulling>,
    drawn: Res<'w, DrawnMeshes>,
    log: FailureLog<'w, 's>,
}

impl Giver<'_, '_> {
    /// Ends the wait of an entity if the preparation of its mesh has ended.
    fn give(&mut self, entity: Entity, mesh: &Mesh3d, wanted: &LodWaiting, entry: &LodMeshEntry) {
        let mut commands = self.commands.entity(entity);
        match entry {
            LodMeshEntry::Plain(error) => {
                if let Some(error) = error {
                    self.log.add(entity, mesh.id(), error);
                }
                leave_plain(&mut commands, error.clone());
            }
            LodMeshEntry::Ready(lod) if lod.is_uploaded() => {
                // The CPU culls characters, because Bevy animates visible ones only.
                if self.culling.is_on && lod.rig.is_none() {
                    commands.try_insert(NoCpuCulling);
                }
                let finest = lod.mesh_at(0).filter(|_| lod.kind == LodKind::WholeMesh);
                if finest.is_some() {
                    // The source is in main memory only, so that a copy of it is the finest level.
                    self.drawn.set(entity, finest);
                }
                give_levels(&mut commands, lod, mesh, wanted);
            }
            _ => {}
        }
    }
}

/// Looks up the levels of waiting entities, inserts those that are ready, and starts the preparation of others.
pub(super) fn give_levels_to_objects(
    waiting: Query<Waiting>,
    order: StartOrder,
    ready: Query<(&Mesh3d, MaterialToBake), With<LodObject>>,
    mut lookup: LodMeshLookup,
    mut giver: Giver,
) {
    lookup.begin_frame();
    let mut startable = Vec::new();
    for (entity, mesh, wanted, _) in &waiting {
        match lookup.find(mesh.id(), &wanted.auto_lod) {
            Found::Entry(entry) => giver.give(entity, mesh, wanted, entry),
            Found::Startable => startable.push(entity),
            Found::Unready => {}
        }
    }
    // Thousands of entities may wait for the tasks of others.
    if startable.is_empty() {
        return;
    }
    order.sort(&mut startable);
    // Only bakes of several primitives need the materials of other entities.
    let materials = OnceCell::new();
    let all_materials = || first_materials(&waiting, &ready);
    for (entity, mesh, wanted, material) in
        startable.iter().filter_map(|&one| waiting.get(one).ok())
    {
        let own = material.id();
        let material_of = |other: AssetId<Mesh>| {
            if other == mesh.id() {
                own
            } else {
                materials.get_or_init(all_materials).get(&other).copied()
            }
        };
        lookup.start(mesh.id(), &wanted.auto_lod, &material_of);
        // Some meshes need no task.
        if let Found::Entry(entry) = lookup.find(mesh.id(), &wanted.auto_lod) {
            giver.give(entity, mesh, wanted, entry);
        }
    }
}

/// The material of the first entity with each mesh.
fn first_materials(
    waiting: &Query<Waiting>,
    ready: &Query<(&Mesh3d, MaterialToBake), With<LodObject>>,
) -> HashMap<AssetId<Mesh>, AssetId<StandardMaterial>> {
    let waiting = waiting.iter();
    let waiting = waiting.filter_map(|(_, mesh, _, material)| Some((mesh.id(), material.id()?)));
    let ready = ready.iter();
    let ready = ready.filter_map(|(mesh, material)| Some((mesh.id(), material.id()?)));
    let mut first = HashMap::new();
    for (mesh, material) in waiting.chain(ready) {
        first.entry(mesh).or_insert(material);
    }
    first
}

/// Marks an entity whose source mesh is drawn.
fn leave_plain(commands: &mut EntityCommands, error: Option<LodError>) {
    let state = error.as_ref().map_or(LodState::Plain, |_| LodState::Failed);
    commands.try_insert(state).try_remove::<LodWaiting>();
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

/// Scenes and files that may be being loaded. Their mesh entities do not exist before.
#[derive(SystemParam)]
pub(super) struct Scenes<'w, 's> {
    roots: Query<
        'w,
        's,
        (
            Entity,
            &'static WorldAssetRoot,
            Option<&'static WorldInstance>,
        ),
    >,
    files: Query<'w, 's, (), With<AwaitsFile>>,
    auto_lods: AutoLodLookup<'w, 's>,
    spawner: Option<Res<'w, WorldInstanceSpawner>>,
    assets: Res<'w, AssetServer>,
}

impl Scenes<'_, '_> {
    /// The number of those that are being loaded, and of all.
    fn count(&self) -> (u32, u32) {
        let is_loading =
            |(root, scene, instance): (Entity, &WorldAssetRoot, Option<&WorldInstance>)| {
                let instance = instance.zip(self.spawner.as_ref());
                !instance.is_some_and(|(one, spawner)| spawner.instance_is_ready(**one))
                    && !self.assets.load_state(&scene.0).is_failed()
                    && self.auto_lods.find(root).is_some()
            };
        let loading = self.roots.iter().filter(|root| is_loading(*root)).count();
        let [files, roots] = [self.files.iter().len(), self.roots.iter().len()];
        ((files + loading) as u32, (files + roots) as u32)
    }
}

/// Counts mesh entities by their state.
pub(super) fn update_progress(
    waiting: Query<(), With<LodWaiting>>,
    objects: Query<(), With<LodObject>>,
    plain: Query<(), (With<LodState>, Without<LodWaiting>, Without<LodObject>)>,
    scenes: Scenes,
    known: Res<LodMeshes>,
    mut progress: ResMut<FieldLodProgress>,
) {
    let (loading, all_scenes) = scenes.count();
    let mut updated = *progress;
    let counts = FieldLodProgress {
        waiting: waiting.iter().len() as u32,
        baking: known.in_preparation.meshes,
        ready: objects.iter().len() as u32,
        plain: plain.iter().len() as u32,
        loading,
        ..default()
    };
    updated.update(counts, all_scenes);
    progress.set_if_neq(updated);
}
