//! Finds entities that changed in what their units inherit, and renews those units.

use bevy::camera::visibility::{NoFrustumCulling, RenderLayers, VisibilityRange};
use bevy::ecs::change_detection::Tick;
use bevy::ecs::component::ComponentId;
use bevy::ecs::lifecycle::RemovedComponents;
use bevy::ecs::resource::IsResource;
use bevy::ecs::system::{SystemChangeTick, SystemParam};
use bevy::light::{NotShadowCaster, NotShadowReceiver, TransmittedShadowReceiver};
use bevy::mesh::MeshTag;
use bevy::pbr::Lightmap;
use bevy::pbr::wireframe::{
    NoWireframe, Wireframe, WireframeColor, WireframeLineWidth, WireframeTopology,
};
use bevy::prelude::*;
use bevy::render::batching::NoAutomaticBatching;

use super::components::InheritedComponents;
use crate::cards::{LodCards, dress_unit};
use crate::scene::lod_mesh::LodObject;
use crate::scene::lod_scene::LodScene;

/// Objects that may have units, which are their children.
type HasUnits = (With<LodObject>, With<Children>);

/// Entities on which a component changed that units inherit.
#[derive(SystemParam)]
pub(crate) struct Changes<'w, 's, C: Component> {
    changed: Query<'w, 's, Entity, (HasUnits, Changed<C>)>,
    removed: RemovedComponents<'w, 's, C>,
}

impl<C: Component> Changes<'_, '_, C> {
    fn add_to(&mut self, objects: &mut Vec<Entity>) {
        objects.extend(self.changed.iter().chain(self.removed.read()));
    }
}

/// Objects without a [`StandardMaterial`].
type OtherMaterials = (
    HasUnits,
    Without<MeshMaterial3d<StandardMaterial>>,
    Without<IsResource>,
);

/// Renews the units of objects that changed in what their units inherit.
///
/// Bevy can look for changes of known types quickly. The types of a game's own materials are not
/// known here, so that entities with none but such are asked one by one.
pub(crate) fn renew_units(
    mut commands: Commands,
    inherited: Res<InheritedComponents>,
    // One by one: a filter of all of them would be asked for every object.
    mut changes: (
        Changes<MeshMaterial3d<StandardMaterial>>,
        Changes<RenderLayers>,
        Changes<NotShadowCaster>,
        Changes<NotShadowReceiver>,
        Changes<TransmittedShadowReceiver>,
        Changes<NoFrustumCulling>,
        Changes<Lightmap>,
        Changes<MeshTag>,
        Changes<VisibilityRange>,
        Changes<NoAutomaticBatching>,
        Changes<Wireframe>,
        Changes<NoWireframe>,
        Changes<WireframeColor>,
        Changes<WireframeLineWidth>,
        Changes<WireframeTopology>,
        Changes<LodCards>,
    ),
    others: Query<EntityRef, OtherMaterials>,
    ticks: SystemChangeTick,
) {
    // Components of known types.
    let mut objects = Vec::new();
    changes.0.add_to(&mut objects);
    changes.1.add_to(&mut objects);
    changes.2.add_to(&mut objects);
    changes.3.add_to(&mut objects);
    changes.4.add_to(&mut objects);
    changes.5.add_to(&mut objects);
    changes.6.add_to(&mut objects);
    changes.7.add_to(&mut objects);
    changes.8.add_to(&mut objects);
    changes.9.add_to(&mut objects);
    changes.10.add_to(&mut objects);
    changes.11.add_to(&mut objects);
    changes.12.add_to(&mut objects);
    changes.13.add_to(&mut objects);
    changes.14.add_to(&mut objects);
    changes.15.add_to(&mut objects);
    // Materials of unknown types.
    let is_new = |tick: Tick| tick.is_newer_than(ticks.last_run(), ticks.this_run());
    for entity in &others {
        let has_changed = |&id: &ComponentId| {
            let ticks = entity.get_change_ticks_by_id(id);
            ticks.is_some_and(|ticks| is_new(ticks.changed))
        };
        if inherited.materials().iter().any(has_changed) {
            objects.push(entity.id());
        }
    }
    // Copying needs the whole world, so that it is left to a command.
    if !objects.is_empty() {
        commands.queue(move |world: &mut World| renew_units_of(world, &objects));
    }
}

/// Renews the units of objects on which a component of a game's own has changed.
pub(super) fn renew_units_for<C: Component>(mut commands: Commands, mut changes: Changes<C>) {
    let mut objects = Vec::new();
    changes.add_to(&mut objects);
    if !objects.is_empty() {
        commands.queue(move |world: &mut World| renew_units_of(world, &objects));
    }
}

fn renew_units_of(world: &mut World, objects: &[Entity]) {
    world.resource_scope(|world, mut inherited: Mut<InheritedComponents>| {
        inherited.update(world);
        for &object in objects {
            for (piece, unit) in units_of(world.resource::<LodScene>(), object) {
                inherited.renew(world, object, unit);
                dress_unit(world, object, unit, piece);
            }
        }
    });
}

/// The entities that draw the units of an object, each with its index among the pieces of the mesh.
fn units_of(scene: &LodScene, object: Entity) -> Vec<(u32, Entity)> {
    let units = scene.instance_of(object).map(|instance| &instance.units);
    let units = units.into_iter().flatten();
    let spawned = units.filter_map(|&(piece, record)| Some((piece, scene.records.entity(record)?)));
    spawned.collect()
}
