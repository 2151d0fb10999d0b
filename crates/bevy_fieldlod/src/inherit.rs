//! What units take over from the entity whose surface they are part of: its material, whatever that
//! is, and all else that says how it is drawn.

mod outdated;

use bevy::camera::visibility::{NoFrustumCulling, RenderLayers};
use bevy::ecs::component::ComponentId;
use bevy::ecs::entity::EntityCloner;
use bevy::ecs::reflect::AppTypeRegistry;
use bevy::light::{NotShadowCaster, NotShadowReceiver, TransmittedShadowReceiver};
use bevy::mesh::MeshTag;
use bevy::pbr::Lightmap;
use bevy::prelude::*;

pub(crate) use outdated::{Outdated, any_outdated, find_outdated, renew_units};

/// Materials of every type are components of one generic type; its name begins with this.
const MATERIAL: &str = "bevy_pbr::mesh_material::MeshMaterial3d<";

/// The components that units take over.
#[derive(Resource, Default)]
pub(crate) struct Inheritance {
    all: Vec<ComponentId>,
    materials: Vec<ComponentId>,
    /// How many types of components there were when this was last filled.
    known: usize,
}

/// Types of components that a game adds to those that units take over.
#[derive(Resource, Default)]
struct MoreInherited(Vec<ComponentId>);

/// Adds to what units take over from the entity whose surface they are part of.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// /// Read by a renderer extension on every entity that it draws.
/// #[derive(Component, Clone)]
/// struct Outlined;
///
/// let mut app = App::new();
/// app.inherit_in_lod_units::<Outlined>();
/// ```
pub trait FieldLodAppExt {
    /// Units take over `C` when they are spawned: for components that a renderer extension reads on
    /// every entity that it draws. Materials, render layers, lightmaps, mesh tags, and how shadows
    /// are cast and received are taken over anyway.
    fn inherit_in_lod_units<C: Component + Clone>(&mut self) -> &mut Self;
}

impl FieldLodAppExt for App {
    fn inherit_in_lod_units<C: Component + Clone>(&mut self) -> &mut Self {
        let world = self.world_mut();
        let id = world.register_component::<C>();
        world.init_resource::<MoreInherited>();
        world.resource_mut::<MoreInherited>().0.push(id);
        self
    }
}

impl Inheritance {
    /// Looks for types of materials that have come since.
    pub(crate) fn update(&mut self, world: &mut World) {
        if self.known == world.components().len() && self.known > 0 {
            return;
        }
        self.materials = material_types(world);
        let more = world.get_resource::<MoreInherited>();
        self.all = more.map(|more| more.0.clone()).unwrap_or_default();
        self.all.extend([
            world.register_component::<RenderLayers>(),
            world.register_component::<NotShadowCaster>(),
            world.register_component::<NotShadowReceiver>(),
            world.register_component::<TransmittedShadowReceiver>(),
            world.register_component::<NoFrustumCulling>(),
            world.register_component::<Lightmap>(),
            world.register_component::<MeshTag>(),
        ]);
        self.all.extend(&self.materials);
        self.known = world.components().len();
    }

    /// Gives `unit` what `object` has of them.
    pub(crate) fn give(&self, world: &mut World, object: Entity, unit: Entity) {
        let Ok(entity) = world.get_entity(object) else {
            return;
        };
        let archetype = entity.archetype();
        let ids = self.all.iter().copied();
        let present: Vec<ComponentId> = ids.filter(|&id| archetype.contains(id)).collect();
        EntityCloner::build_opt_in(world)
            .without_required_components(|cloner| {
                cloner.allow_by_ids(present);
            })
            .clone_entity(object, unit);
    }

    /// Whether an entity has a material of a game's, of any type.
    #[cfg(feature = "debug")]
    pub(crate) fn wears_material(&self, entity: &EntityRef) -> bool {
        let mut materials = self.materials.iter();
        materials.any(|&id| entity.contains_id(id))
    }

    /// Takes all materials off.
    #[cfg(feature = "debug")]
    pub(crate) fn strip_materials(&self, world: &mut World, entity: Entity) {
        world.entity_mut(entity).remove_by_ids(&self.materials);
    }

    /// Moves all materials from one entity to another, and its tag if that is wanted.
    #[cfg(feature = "debug")]
    pub(crate) fn move_materials(&self, world: &mut World, from: Entity, to: Entity, tag: bool) {
        let Ok(entity) = world.get_entity(from) else {
            return;
        };
        let mut present = self.materials.clone();
        present.extend(world.component_id::<MeshTag>().filter(|_| tag));
        present.retain(|&id| entity.contains_id(id));
        if present.is_empty() {
            return;
        }
        EntityCloner::build_opt_in(world)
            .move_components(true)
            .without_required_components(|cloner| {
                cloner.allow_by_ids(present);
            })
            .clone_entity(from, to);
    }

    /// Takes from `unit` what `object` has not, and gives it what it has.
    pub(crate) fn renew(&self, world: &mut World, object: Entity, unit: Entity) {
        let (Ok(of_object), Ok(of_unit)) = (world.get_entity(object), world.get_entity(unit))
        else {
            return;
        };
        let (of_object, of_unit) = (of_object.archetype(), of_unit.archetype());
        let ids = self.all.iter().copied();
        let lost = ids.filter(|&id| of_unit.contains(id) && !of_object.contains(id));
        let lost: Vec<ComponentId> = lost.collect();
        world.entity_mut(unit).remove_by_ids(&lost);
        self.give(world, object, unit);
    }
}

fn material_types(world: &World) -> Vec<ComponentId> {
    let Some(registry) = world.get_resource::<AppTypeRegistry>() else {
        return Vec::new();
    };
    let registry = registry.read();
    let materials = registry.iter().filter(|registration| {
        let path = registration.type_info().type_path();
        // What `FieldLodDebugPlugin` paints with is put on and taken off by itself.
        path.starts_with(MATERIAL) && !path.contains("LodSurfaceMaterial")
    });
    materials
        .filter_map(|registration| world.components().get_id(registration.type_id()))
        .collect()
}
