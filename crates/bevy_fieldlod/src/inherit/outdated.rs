//! Which units no longer have what their object has.

use bevy::camera::visibility::{NoFrustumCulling, RenderLayers};
use bevy::ecs::change_detection::Tick;
use bevy::ecs::component::ComponentId;
use bevy::ecs::lifecycle::RemovedComponents;
use bevy::ecs::resource::IsResource;
use bevy::ecs::system::{SystemChangeTick, SystemParam};
use bevy::light::{NotShadowCaster, NotShadowReceiver, TransmittedShadowReceiver};
use bevy::mesh::MeshTag;
use bevy::pbr::Lightmap;
use bevy::prelude::*;

use super::Inheritance;
use crate::objects::LodObject;
use crate::world::{Drawn, LodWorld};

/// Objects whose units must be renewed.
#[derive(Resource, Default)]
pub(crate) struct Outdated(Vec<Entity>);

/// What happened to a component that units take over.
#[derive(SystemParam)]
pub(crate) struct Edits<'w, 's, C: Component> {
    changed: Query<'w, 's, Entity, (With<LodObject>, Changed<C>)>,
    removed: RemovedComponents<'w, 's, C>,
}

impl<C: Component> Edits<'_, '_, C> {
    fn add_to(&mut self, outdated: &mut Outdated) {
        outdated
            .0
            .extend(self.changed.iter().chain(self.removed.read()));
    }
}

/// Objects without a [`StandardMaterial`].
type Others = (
    With<LodObject>,
    Without<MeshMaterial3d<StandardMaterial>>,
    Without<IsResource>,
);

/// Finds objects that changed in what their units take over.
///
/// Bevy can look for changes of known types quickly. The types of a game's own materials are not
/// known here, so that entities with none but such are asked one by one.
pub(crate) fn find_outdated(
    mut outdated: ResMut<Outdated>,
    inheritance: Res<Inheritance>,
    // One by one: a filter of all of them would be asked for every object.
    mut edits: (
        Edits<MeshMaterial3d<StandardMaterial>>,
        Edits<RenderLayers>,
        Edits<NotShadowCaster>,
        Edits<NotShadowReceiver>,
        Edits<TransmittedShadowReceiver>,
        Edits<NoFrustumCulling>,
        Edits<Lightmap>,
        Edits<MeshTag>,
    ),
    others: Query<EntityRef, Others>,
    ticks: SystemChangeTick,
) {
    edits.0.add_to(&mut outdated);
    edits.1.add_to(&mut outdated);
    edits.2.add_to(&mut outdated);
    edits.3.add_to(&mut outdated);
    edits.4.add_to(&mut outdated);
    edits.5.add_to(&mut outdated);
    edits.6.add_to(&mut outdated);
    edits.7.add_to(&mut outdated);
    let is_new = |tick: Tick| tick.is_newer_than(ticks.last_run(), ticks.this_run());
    for entity in &others {
        let changed = |&id: &ComponentId| {
            let ticks = entity.get_change_ticks_by_id(id);
            ticks.is_some_and(|ticks| is_new(ticks.changed))
        };
        if inheritance.materials.iter().any(changed) {
            outdated.0.push(entity.id());
        }
    }
}

/// Whether units must be renewed.
pub(crate) fn any_outdated(outdated: Res<Outdated>) -> bool {
    !outdated.0.is_empty()
}

/// Renews the units of objects that changed.
pub(crate) fn renew_units(world: &mut World) {
    let objects = std::mem::take(&mut world.resource_mut::<Outdated>().0);
    world.resource_scope(|world, mut inheritance: Mut<Inheritance>| {
        inheritance.update(world);
        for object in objects {
            for unit in units_of(world.resource::<LodWorld>(), object) {
                inheritance.renew(world, object, unit);
            }
        }
    });
}

/// The entities that draw the units of an object.
fn units_of(lod: &LodWorld, object: Entity) -> Vec<Entity> {
    match lod.instance_of(object).map(|instance| &instance.drawn) {
        Some(Drawn::Units(units)) => {
            let slots = units.iter().map(|&(_, slot)| slot);
            slots.filter_map(|slot| lod.slots.entity(slot)).collect()
        }
        _ => Vec::new(),
    }
}
