//! The components that units inherit, and how they are copied.

use bevy::ecs::component::ComponentId;
use bevy::ecs::entity::EntityCloner;
use bevy::ecs::reflect::AppTypeRegistry;
#[cfg(feature = "debug")]
use bevy::mesh::MeshTag;
use bevy::prelude::*;

/// The beginning of the type paths of all materials, which are components of one generic type.
const MATERIAL: &str = "bevy_pbr::mesh_material::MeshMaterial3d<";

/// The components that units inherit.
#[derive(Resource, Default)]
pub(crate) struct InheritedComponents {
    all: Vec<ComponentId>,
    materials: Vec<ComponentId>,
    /// Components other than materials.
    added: Vec<ComponentId>,
    /// The number of component types in the world at the last update.
    known: usize,
}

impl InheritedComponents {
    /// Adds a component.
    pub(super) fn add(&mut self, component: ComponentId) {
        self.added.push(component);
        // The next update includes it, even if no component type is new.
        self.known = 0;
    }

    /// Materials of all types, except that of the debug view.
    pub(super) fn materials(&self) -> &[ComponentId] {
        &self.materials
    }

    /// Looks for material types that were registered since the last update.
    pub(crate) fn update(&mut self, world: &mut World) {
        // Component types are only ever added.
        if self.known == world.components().len() && self.known > 0 {
            return;
        }
        self.materials = material_types(world);
        self.all = self.added.clone();
        self.all.extend(&self.materials);
        self.known = world.components().len();
    }

    /// Copies the inherited components of `object` to `unit`.
    pub(crate) fn copy(&self, world: &mut World, object: Entity, unit: Entity) {
        clone_components(world, &self.all, object, unit, false);
    }

    /// Copies the inherited components of `object` to `unit`, and removes those that `object` lacks.
    pub(crate) fn renew(&self, world: &mut World, object: Entity, unit: Entity) {
        let (Ok(object_ref), Ok(unit_ref)) = (world.get_entity(object), world.get_entity(unit))
        else {
            return;
        };
        let is_lost = |&&id: &&ComponentId| unit_ref.contains_id(id) && !object_ref.contains_id(id);
        let lost: Vec<ComponentId> = self.all.iter().filter(is_lost).copied().collect();
        world.entity_mut(unit).remove_by_ids(&lost);
        self.copy(world, object, unit);
    }

    /// Whether an entity has a material other than that of the debug view.
    #[cfg(feature = "debug")]
    pub(crate) fn has_material(&self, entity: &EntityRef) -> bool {
        self.materials.iter().any(|&id| entity.contains_id(id))
    }

    /// Removes all materials.
    #[cfg(feature = "debug")]
    pub(crate) fn remove_materials(&self, world: &mut World, entity: Entity) {
        world.entity_mut(entity).remove_by_ids(&self.materials);
    }

    /// Moves all materials from one entity to another, and the mesh tag if `tag` is set.
    #[cfg(feature = "debug")]
    pub(crate) fn move_materials(&self, world: &mut World, from: Entity, to: Entity, tag: bool) {
        let mut components = self.materials.clone();
        components.extend(world.component_id::<MeshTag>().filter(|_| tag));
        clone_components(world, &components, from, to, true);
    }
}

/// Copies or moves the given components of `from` to another entity.
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
        // Units have their own values of some required components, such as the transform.
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
        // The debug view inserts and removes its own material.
        path.starts_with(MATERIAL) && !path.contains("LodDebugMaterial")
    });
    materials
        .filter_map(|registration| world.components().get_id(registration.type_id()))
        .collect()
}
