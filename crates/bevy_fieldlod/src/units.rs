//! The entities that draw units: spawned when a view first wants them, despawned when none has for
//! a while.

use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::NoAutoAabb;
use bevy::prelude::*;

use crate::FieldLodConfig;
use crate::inherit::Inheritance;
use crate::world::LodWorld;

/// An entity that draws one unit, as a child of the mesh entity whose surface it is part of.
#[derive(Component, Clone, Copy, Debug, Reflect)]
#[reflect(Component, Clone)]
pub struct LodUnit {
    /// 0 is the finest.
    pub level: u32,
    /// The entity whose surface it is part of.
    pub object: Entity,
}

/// Despawns at most this many in a frame: after a fast turn, thousands may fall idle together.
const MOST_DESPAWNED: usize = 256;

/// Whether there are units to spawn.
pub(crate) fn any_wanted(world: Res<LodWorld>) -> bool {
    !world.wanted.is_empty()
}

/// Whether units were spawned in this frame.
#[cfg(feature = "debug")]
pub(crate) fn any_born(units: Query<(), Added<LodUnit>>) -> bool {
    !units.is_empty()
}

/// A unit that is about to be spawned.
struct Birth {
    slot: u32,
    object: Entity,
    mesh: Handle<Mesh>,
    aabb: Aabb,
    level: u32,
}

/// Spawns the units that views want. It runs between Bevy's propagation of transforms and its
/// culling, so that they are drawn in the same frame, where their objects are.
pub(crate) fn spawn_units(world: &mut World) {
    let births = take_births(&mut world.resource_mut::<LodWorld>());
    world.resource_scope(|world, mut inheritance: Mut<Inheritance>| {
        inheritance.update(world);
        for birth in births {
            let (slot, object) = (birth.slot, birth.object);
            let Some(unit) = spawn_unit(world, birth) else {
                continue;
            };
            inheritance.give(world, object, unit);
            let mut lod = world.resource_mut::<LodWorld>();
            lod.slots.give_entity(slot, unit);
        }
    });
}

fn spawn_unit(world: &mut World, birth: Birth) -> Option<Entity> {
    let object = world.get_entity(birth.object).ok()?;
    let place = object.get::<GlobalTransform>().copied();
    let inherited = object.get::<InheritedVisibility>().copied();
    let unit = world.spawn((
        Mesh3d(birth.mesh),
        Transform::IDENTITY,
        place.unwrap_or_default(),
        inherited.unwrap_or_default(),
        birth.aabb,
        NoAutoAabb,
        ChildOf(birth.object),
        LodUnit {
            level: birth.level,
            object: birth.object,
        },
    ));
    Some(unit.id())
}

fn take_births(lod: &mut LodWorld) -> Vec<Birth> {
    let wanted = std::mem::take(&mut lod.wanted);
    let birth = |slot: u32| {
        let (instance, unit) = lod.slots.unit(slot)?;
        let instance = lod.instance(instance)?;
        let piece = &instance.mesh.pieces[unit as usize];
        Some(Birth {
            slot,
            object: instance.entity,
            mesh: piece.mesh.clone()?,
            aabb: piece.aabb,
            level: piece.level,
        })
    };
    wanted.into_iter().filter_map(birth).collect()
}

/// Despawns units that no view has wanted for a while.
pub(crate) fn despawn_idle(
    mut world: ResMut<LodWorld>,
    config: Res<FieldLodConfig>,
    mut commands: Commands,
) {
    for unit in world.take_idle(config.idle_frames, MOST_DESPAWNED) {
        commands.entity(unit).try_despawn();
    }
}

/// Spawns a unit again that someone else despawned.
pub(crate) fn replace_lost(removal: On<Remove, LodUnit>, mut world: ResMut<LodWorld>) {
    world.lose_unit(removal.entity);
}
