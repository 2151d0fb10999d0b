//! Finds objects on which an inherited component changed or was removed, and copies the components to their units
//! again.

use bevy::ecs::change_detection::Tick;
use bevy::ecs::component::ComponentId;
use bevy::ecs::lifecycle::{RemovedComponentMessages, RemovedComponents};
use bevy::ecs::resource::IsResource;
use bevy::ecs::system::SystemChangeTick;
use bevy::prelude::*;

use super::components::InheritedComponents;
use crate::scene::lod_mesh::LodObject;
use crate::scene::lod_scene::LodScene;

/// Objects that may have units, which are their children.
type HasUnits = (With<LodObject>, With<Children>);

/// Objects without a [`StandardMaterial`]. In Bevy, resources are entities too: `EntityRef` alone would conflict with
/// all systems that write resources.
type OtherMaterials = (
    HasUnits,
    Without<MeshMaterial3d<StandardMaterial>>,
    Without<IsResource>,
);

/// Renews the units of objects on which `C` was changed or removed.
pub(super) fn renew_units_of_changed<C: Component>(
    changed: Query<Entity, (HasUnits, Changed<C>)>,
    mut removed: RemovedComponents<C>,
    commands: Commands,
) {
    renew(changed.iter().chain(removed.read()).collect(), commands);
}

/// Renews the units of objects on which a material of a game's own type was changed or removed.
///
/// The types are not known at compile time, so each object without a standard material is checked by component id.
pub(super) fn renew_units_of_other_materials(
    inherited: Res<InheritedComponents>,
    others: Query<EntityRef, OtherMaterials>,
    removed: &RemovedComponentMessages,
    ticks: SystemChangeTick,
    commands: Commands,
) {
    // `Changed` needs the type of the component.
    let is_new = |tick: Tick| tick.is_newer_than(ticks.last_run(), ticks.this_run());
    let has_changed = |entity: &EntityRef| {
        inherited.materials().iter().any(|&id: &ComponentId| {
            let ticks = entity.get_change_ticks_by_id(id);
            ticks.is_some_and(|ticks| is_new(ticks.changed))
        })
    };
    let changed = others.iter().filter(has_changed);
    let mut changed: Vec<Entity> = changed.map(|entity| entity.id()).collect();
    let materials = inherited.materials().iter();
    for removals in materials.filter_map(|&id| removed.get(id)) {
        // It reads the removals of the last two frames.
        let mut cursor = removals.get_cursor();
        let removals = cursor.read(removals).cloned().map(Entity::from);
        changed.extend(removals.filter(|&entity| others.contains(entity)));
    }
    renew(changed, commands);
}

/// Renews the units of objects in a command, because copying components needs the whole world.
fn renew(objects: Vec<Entity>, mut commands: Commands) {
    if !objects.is_empty() {
        commands.queue(move |world: &mut World| renew_units_of(world, &objects));
    }
}

fn renew_units_of(world: &mut World, objects: &[Entity]) {
    world.resource_scope(|world, mut inherited: Mut<InheritedComponents>| {
        inherited.update(world);
        for &object in objects {
            let scene = world.resource::<LodScene>();
            let instance = scene.instance_of(object).into_iter();
            let units = instance.flat_map(|instance| scene.units_of(instance));
            for (unit, _) in units.collect::<Vec<_>>() {
                inherited.renew(world, object, unit);
            }
        }
    });
}
