//! Large meshes are drawn as units: entities that are spawned when a view first draws them and despawned
//! when none has for a while.

use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::{NoAutoAabb, NoCpuCulling};
use bevy::pbr::PreviousGlobalTransform;
use bevy::prelude::*;

use crate::api::config::FieldLodConfig;
use crate::api::systems::FieldLodSystems;
use crate::cards::dress_unit;
use crate::draw::inherit::InheritedComponents;
use crate::scene::lod_scene::LodScene;

/// An entity that draws one unit, as a child of the mesh entity whose surface it is part of.
#[derive(Component, Clone, Copy, Debug, Reflect)]
#[reflect(Component, Clone)]
#[require(NoAutoAabb)]
pub struct LodUnit {
    /// The level of detail; 0 is the finest.
    pub level: u32,
    /// The entity whose surface it is part of.
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

/// A unit that is about to be spawned.
struct UnitSpawn {
    record: u32,
    /// Its index among the pieces of the mesh.
    piece: u32,
    mesh: Handle<Mesh>,
    aabb: Aabb,
    unit: LodUnit,
}

/// Spawns the units that views draw and that have no entity yet.
pub(crate) fn spawn_units(world: &mut World) {
    let spawns = take_unit_spawns(&mut world.resource_mut::<LodScene>());
    world.resource_scope(|world, mut inherited: Mut<InheritedComponents>| {
        inherited.update(world);
        for spawn in spawns {
            let (record, object, piece) = (spawn.record, spawn.unit.object, spawn.piece);
            // A record may be listed twice: for a unit that was despawned, and for that which it was
            // given to when the object went too.
            if world
                .resource::<LodScene>()
                .records
                .entity(record)
                .is_some()
            {
                continue;
            }
            let Some(unit) = spawn_unit(world, spawn) else {
                continue;
            };
            inherited.copy(world, object, unit);
            dress_unit(world, object, unit, piece);
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
            piece: unit,
            mesh: instance.mesh.mesh_of_unit(unit)?,
            aabb: piece.aabb(),
            unit: LodUnit {
                level: piece.level,
                object: instance.entity,
            },
        })
    };
    records.filter_map(unit_spawn).collect()
}

/// Spawns a unit where its object is, as Bevy has already propagated transforms and visibility.
fn spawn_unit(world: &mut World, spawn: UnitSpawn) -> Option<Entity> {
    let object = world.get_entity(spawn.unit.object).ok()?;
    let transform = object.get::<GlobalTransform>().copied();
    let visibility = object.get::<InheritedVisibility>().copied();
    let last_transform = object.get::<PreviousGlobalTransform>().cloned();
    let is_culled_on_gpu = object.contains::<NoCpuCulling>();
    let unit = world.spawn((
        spawn.unit,
        Mesh3d(spawn.mesh),
        spawn.aabb,
        transform.unwrap_or_default(),
        visibility.unwrap_or_default(),
        ChildOf(spawn.unit.object),
    ));
    let unit = unit.id();
    if is_culled_on_gpu {
        world.entity_mut(unit).insert(NoCpuCulling);
    }
    // It moves with its object from its first frame on.
    if let Some(last_transform) = last_transform {
        world.entity_mut(unit).insert(last_transform);
    }
    Some(unit)
}

/// Despawns at most this many units in a frame: after a fast turn, thousands may fall idle together.
const MOST_DESPAWNED: usize = 256;

/// Despawns units that no view has drawn for a while.
fn despawn_idle_units(
    mut scene: ResMut<LodScene>,
    config: Res<FieldLodConfig>,
    mut commands: Commands,
) {
    for unit in scene.take_idle_units(config.idle_frames, MOST_DESPAWNED) {
        commands.entity(unit).try_despawn();
    }
}

/// Despawns the copies of units that come with a clone of their object or with a saved scene: the copy of
/// the object gets units of its own.
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

/// Spawns a unit again that someone else despawned.
fn respawn_lost_unit(removal: On<Remove, LodUnit>, mut scene: ResMut<LodScene>) {
    let record = scene.records.forget_entity(removal.entity);
    scene.units_to_spawn.extend(record);
}
