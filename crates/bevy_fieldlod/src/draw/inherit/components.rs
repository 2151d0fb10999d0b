//! The components that units inherit, and how they are copied.

use bevy::camera::visibility::{NoFrustumCulling, RenderLayers, VisibilityRange};
use bevy::ecs::component::ComponentId;
use bevy::ecs::entity::EntityCloner;
use bevy::ecs::reflect::AppTypeRegistry;
use bevy::light::{NotShadowCaster, NotShadowReceiver, TransmittedShadowReceiver};
use bevy::mesh::MeshTag;
use bevy::pbr::Lightmap;
use bevy::pbr::wireframe::{
    NoWireframe, Wireframe, WireframeColor, WireframeLineWidth, WireframeTopology,
};
use bevy::prelude::*;
use bevy::render::batching::NoAutomaticBatching;

/// Materials of every type are components of one generic type; its name begins with this.
const MATERIAL: &str = "bevy_pbr::mesh_material::MeshMaterial3d<";

/// The components that units inherit.
#[derive(Resource, Default)]
pub(crate) struct InheritedComponents {
    all: Vec<ComponentId>,
    materials: Vec<ComponentId>,
    /// Those that a game has added.
    added: Vec<ComponentId>,
    /// How many types of components there were when this was last updated.
    known: usize,
}

impl InheritedComponents {
    /// Adds a component of a game's own.
    pub(super) fn add(&mut self, component: ComponentId) {
        self.added.push(component);
        self.known = 0;
    }

    /// Materials of all types but that of the debug view.
    pub(super) fn materials(&self) -> &[ComponentId] {
        &self.materials
    }

    /// Looks for types of materials that have come since.
    pub(crate) fn update(&mut self, world: &mut World) {
        // The world has no more types of components than when this was last updated.
        if self.known == world.components().len() && self.known > 0 {
            return;
        }
        self.materials = material_types(world);
        self.all = vec![
            world.register_component::<RenderLayers>(),
            world.register_component::<NotShadowCaster>(),
            world.register_component::<NotShadowReceiver>(),
            world.register_component::<TransmittedShadowReceiver>(),
            world.register_component::<NoFrustumCulling>(),
            world.register_component::<Lightmap>(),
            world.register_component::<MeshTag>(),
            world.register_component::<VisibilityRange>(),
            world.register_component::<NoAutomaticBatching>(),
            world.register_component::<Wireframe>(),
            world.register_component::<NoWireframe>(),
            world.register_component::<WireframeColor>(),
            world.register_component::<WireframeLineWidth>(),
            world.register_component::<WireframeTopology>(),
        ];
        self.all.extend(&self.added);
        self.all.extend(&self.materials);
        self.known = world.components().len();
    }

    /// Copies those that `object` has to `unit`.
    pub(crate) fn copy(&self, world: &mut World, object: Entity, unit: Entity) {
        clone_components(world, &self.all, object, unit, false);
    }

    /// Removes from `unit` those that `object` has not, and copies those that it has.
    pub(crate) fn renew(&self, world: &mut World, object: Entity, unit: Entity) {
        let (Ok(object_ref), Ok(unit_ref)) = (world.get_entity(object), world.get_entity(unit))
        else {
            return;
        };
        // What the object has lost, the unit loses too.
        let is_lost = |&&id: &&ComponentId| unit_ref.contains_id(id) && !object_ref.contains_id(id);
        let lost: Vec<ComponentId> = self.all.iter().filter(is_lost).copied().collect();
        world.entity_mut(unit).remove_by_ids(&lost);
        self.copy(world, object, unit);
    }

    /// Whether an entity has a material of a game's, of any type.
    #[cfg(feature = "debug")]
    pub(crate) fn has_material(&self, entity: &EntityRef) -> bool {
        self.materials.iter().any(|&id| entity.contains_id(id))
    }

    /// Removes all materials.
    #[cfg(feature = "debug")]
    pub(crate) fn remove_materials(&self, world: &mut World, entity: Entity) {
        world.entity_mut(entity).remove_by_ids(&self.materials);
    }

    /// Moves all materials from one entity to another, and its tag if that is wanted.
    #[cfg(feature = "debug")]
    pub(crate) fn move_materials(&self, world: &mut World, from: Entity, to: Entity, tag: bool) {
        let mut components = self.materials.clone();
        components.extend(world.component_id::<MeshTag>().filter(|_| tag));
        clone_components(world, &components, from, to, true);
    }
}

/// Copies or moves those of `components` that `from` has.
fn clone_components(
    world: &mut World,
    components: &[ComponentId],
    from: Entity,
    to: Entity,
    moves: bool,
) {
    let Ok(source) = world.get_entity(from) else {
        return;
    };
    let mut present = components.to_vec();
    present.retain(|&id| source.contains_id(id));
    if present.is_empty() {
        return;
    }
    EntityCloner::build_opt_in(world)
        .move_components(moves)
        .without_required_components(|cloner| {
            cloner.allow_by_ids(present);
        })
        .clone_entity(from, to);
}

fn material_types(world: &World) -> Vec<ComponentId> {
    let Some(registry) = world.get_resource::<AppTypeRegistry>() else {
        return Vec::new();
    };
    let registry = registry.read();
    let materials = registry.iter().filter(|registration| {
        let path = registration.type_info().type_path();
        // The debug view puts its own material on and takes it off by itself.
        path.starts_with(MATERIAL) && !path.contains("LodDebugMaterial")
    });
    materials
        .filter_map(|registration| world.components().get_id(registration.type_id()))
        .collect()
}
