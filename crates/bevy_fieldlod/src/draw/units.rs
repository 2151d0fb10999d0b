//! Spawns the entity of a unit when a view first draws it, and despawns it when no view has drawn it for a while.

use std::sync::Arc;

use bevy::asset::AssetId;
use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::{NoAutoAabb, NoCpuCulling};
use bevy::pbr::PreviousGlobalTransform;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::tasks::{ComputeTaskPool, ParallelSlice, TaskPool};
use fieldlod_select::MeshId;

use crate::api::systems::FieldLodSystems;
use crate::compat::OnRemove;
use crate::draw::inherit::InheritedComponents;
use crate::lock;
use crate::scene::lod_mesh::{LodMesh, LodObject};
use crate::scene::lod_scene::LodScene;
use crate::scene::unit_mesh::UnitMeshes;

/// An entity that draws one unit of a large mesh. It is a child of the mesh entity.
#[derive(Component, Clone, Copy, Debug, Reflect)]
#[reflect(Component, Clone)]
#[require(NoAutoAabb)]
pub struct LodUnit {
    /// The level of detail; 0 is the finest.
    pub level: u32,
    /// The mesh entity.
    pub object: Entity,
}

/// Spawns and despawns units as the cuts of views change.
pub(crate) fn plugin(app: &mut App) {
    let any_to_spawn = |scene: Res<LodScene>| !scene.units_to_spawn.is_empty();
    let any_idle = |scene: Res<LodScene>| !scene.idle_units.is_empty();
    let systems = (
        spawn_units.run_if(any_to_spawn),
        despawn_idle_units.run_if(any_idle),
    );
    app.add_observer(respawn_lost_unit).add_systems(
        PostUpdate,
        (
            despawn_copied_units.in_set(FieldLodSystems::Track),
            systems.chain().in_set(FieldLodSystems::Spawn),
        ),
    );
}

/// A unit to spawn.
struct UnitSpawn {
    record: u32,
    lod: Arc<LodMesh>,
    index: u32,
    /// `None` if it is to be made.
    mesh: Option<Handle<Mesh>>,
    aabb: Aabb,
    unit: LodUnit,
}

/// Spawns the units that views draw and that have no entity yet.
pub(crate) fn spawn_units(world: &mut World) {
    let mut spawns = take_unit_spawns(&mut world.resource_mut::<LodScene>());
    make_meshes(world, &mut spawns);
    draw_sources_of_missing_units(world, &spawns);
    world.resource_scope(|world, mut inherited: Mut<InheritedComponents>| {
        inherited.update(world);
        for spawn in spawns {
            let (record, object) = (spawn.record, spawn.unit.object);
            // A record may be listed twice: for a despawned unit, and for the unit that reuses the record.
            let records = &world.resource::<LodScene>().records;
            if records.entity(record).is_some() || records.unit(record).is_none() {
                continue;
            }
            // Its mesh could not be made, or its object was despawned in this frame.
            let Some(unit) = spawn_unit(world, spawn) else {
                continue;
            };
            inherited.copy(world, object, unit);
            let mut scene = world.resource_mut::<LodScene>();
            scene.records.set_entity(record, unit);
        }
    });
}

fn take_unit_spawns(scene: &mut LodScene) -> Vec<UnitSpawn> {
    let records = std::mem::take(&mut scene.units_to_spawn).into_iter();
    let unit_spawn = |record: u32| {
        let (instance, unit) = scene.records.unit(record)?;
        let instance = scene.instance(instance)?;
        let piece = &instance.mesh.pieces[unit as usize];
        Some(UnitSpawn {
            record,
            lod: instance.mesh.clone(),
            index: unit,
            mesh: instance.mesh.mesh_of_unit(unit),
            aabb: piece.aabb(),
            unit: LodUnit {
                level: piece.level,
                object: instance.entity,
            },
        })
    };
    records.filter_map(unit_spawn).collect()
}

/// Makes the meshes of units that no entity draws. The renderer extracts and uploads them in this frame.
fn make_meshes(world: &mut World, spawns: &mut [UnitSpawn]) {
    let mut wanted = HashMap::new();
    for spawn in spawns.iter().filter(|spawn| spawn.mesh.is_none()) {
        if let (Some(units), Some(object)) =
            (&spawn.lod.units, world.get::<LodObject>(spawn.unit.object))
        {
            // Once for all objects with the mesh.
            wanted.insert((spawn.lod.id, spawn.index), (units, object.source));
        }
    }
    if wanted.is_empty() {
        return;
    }
    let mut meshes = world.resource_mut::<Assets<Mesh>>();
    let mut handles = HashMap::new();
    // A mesh that another entity still draws is used again.
    wanted.retain(|&(lod, unit), (units, _)| {
        let made = lock(&units.made).get(&unit).copied();
        let handle = made.and_then(|mesh| meshes.get_strong_handle(mesh));
        let is_missing = handle.is_none();
        handles.extend(handle.map(|handle| ((lod, unit), handle)));
        is_missing
    });
    let wanted: Vec<_> = wanted.into_iter().collect();
    let pool = ComputeTaskPool::get_or_init(TaskPool::default);
    // After a jump of the camera, thousands of meshes are needed in one frame.
    let new = wanted.par_splat_map(pool, None, |_, wanted| {
        let make =
            |((_, unit), (units, source)): &((MeshId, u32), (&UnitMeshes, AssetId<Mesh>))| {
                units.make(meshes.get(*source)?, *unit)
            };
        wanted.iter().map(make).collect::<Vec<_>>()
    });
    for ((key, (units, _)), mesh) in wanted.iter().zip(new.into_iter().flatten()) {
        if let Some(mesh) = mesh {
            let handle = meshes.add(mesh);
            lock(&units.made).insert(key.1, handle.id());
            handles.insert(*key, handle);
        }
    }
    for spawn in spawns.iter_mut().filter(|spawn| spawn.mesh.is_none()) {
        spawn.mesh = handles.get(&(spawn.lod.id, spawn.index)).cloned();
    }
}

/// Draws the source of objects with a unit whose mesh could not be made.
///
/// A program has changed or removed the source in this frame, and the event arrives in the next frame. Without the
/// unit, the surface would have a hole until then.
fn draw_sources_of_missing_units(world: &mut World, spawns: &[UnitSpawn]) {
    for spawn in spawns.iter().filter(|spawn| spawn.mesh.is_none()) {
        if let Ok(mut object) = world.get_entity_mut(spawn.unit.object)
            && object.take::<LodObject>().is_some()
            && let Some(mut mesh) = object.get_mut::<Mesh3d>()
        {
            // `track_objects` then gives it levels again.
            mesh.set_changed();
        }
    }
}

/// Spawns a unit with the global transform of its object, because Bevy has already propagated transforms.
fn spawn_unit(world: &mut World, spawn: UnitSpawn) -> Option<Entity> {
    let mesh = spawn.mesh?;
    let object = world.get_entity(spawn.unit.object).ok()?;
    let transform = object.get::<GlobalTransform>().copied();
    let visibility = object.get::<InheritedVisibility>().copied();
    let last_transform = object.get::<PreviousGlobalTransform>().cloned();
    let is_culled_on_gpu = object.contains::<NoCpuCulling>();
    let unit = world.spawn((
        spawn.unit,
        Mesh3d(mesh),
        spawn.aabb,
        transform.unwrap_or_default(),
        visibility.unwrap_or_default(),
        ChildOf(spawn.unit.object),
    ));
    let unit = unit.id();
    // Bevy culls the unit where it culls the object.
    if is_culled_on_gpu {
        world.entity_mut(unit).insert(NoCpuCulling);
    }
    // Motion vectors of the first frame need it.
    if let Some(last_transform) = last_transform {
        world.entity_mut(unit).insert(last_transform);
    }
    Some(unit)
}

/// Frames that the entity of a unit outlives the last view that drew it: a second at 60 frames per second. With fewer,
/// a camera that turns back spawns its units again; with more, more idle entities and meshes exist.
const IDLE_FRAMES: u32 = 60;
/// Largest number of units that are despawned in a frame because of their age. After a fast turn, thousands become idle
/// together. With more, a frame takes longer; with fewer, idle units exist longer.
const MOST_DESPAWNED: usize = 256;
/// Number of idle units, in addition to as many as are drawn, above which the oldest are despawned at once. A camera
/// that flies fast or teleports leaves more units in each frame than [`MOST_DESPAWNED`], and would let entities grow
/// without bound. With fewer, a small scene spawns units again after each turn.
const SPARE_IDLE: usize = 1024;

/// Despawns units that no view has drawn for [`IDLE_FRAMES`], or that are too many.
fn despawn_idle_units(mut scene: ResMut<LodScene>, mut commands: Commands) {
    let (drawn, _) = scene.records.drawn_and_idle();
    let most_idle = drawn + SPARE_IDLE;
    for unit in scene.take_idle_units(IDLE_FRAMES, MOST_DESPAWNED, most_idle) {
        commands.entity(unit).try_despawn();
    }
}

/// Despawns copies of units that were cloned or loaded with their object: the copy of the object gets its own
/// units.
fn despawn_copied_units(
    mut commands: Commands,
    added: Query<Entity, Added<LodUnit>>,
    scene: Res<LodScene>,
) {
    let is_copied = |unit: &Entity| scene.records.find(*unit).is_none();
    for unit in added.iter().filter(is_copied) {
        commands.entity(unit).try_despawn();
    }
}

/// Spawns a unit again that other code despawned.
fn respawn_lost_unit(removal: OnRemove<LodUnit>, mut scene: ResMut<LodScene>) {
    // `None` for units that the plugin despawns: their records were freed before.
    let record = scene.records.detach_entity(removal.entity);
    scene.units_to_spawn.extend(record);
}
