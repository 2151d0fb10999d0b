//! Replaces the materials of drawn entities by the debug material, and restores them.

use bevy::mesh::MeshTag;
use bevy::prelude::*;

use super::FieldLodDebug;
use super::material::{DebugMaterials, LodDebugMaterial, mesh_tag};
use crate::draw::inherit::InheritedComponents;
use crate::draw::units::LodUnit;
use crate::scene::lod_mesh::LodPiece;
use crate::scene::lod_scene::LodScene;

/// An entity that is painted.
#[derive(Component)]
pub(super) struct Painted {
    /// The entity that stores the materials of a whole mesh. `None` for units, which inherit their materials again.
    saved_materials: Option<Entity>,
}

/// Whether any entity is painted or the options select a material.
pub(super) fn is_wanted(
    debug: Res<FieldLodDebug>,
    materials: Res<DebugMaterials>,
    painted: Query<(), With<Painted>>,
) -> bool {
    materials.wanted(&debug).is_some() || !painted.is_empty()
}

/// Paints drawn entities, or restores them.
pub(super) fn paint_units(world: &mut World) {
    let debug = *world.resource::<FieldLodDebug>();
    let wanted = world.resource::<DebugMaterials>().wanted(&debug).cloned();
    let drawn = painted_pieces(world);
    world.resource_scope(|world, mut inherited: Mut<InheritedComponents>| {
        inherited.update(world);
        if let Some(material) = &wanted {
            for (entity, tag) in drawn {
                paint(world, &inherited, entity, material, tag);
            }
        }
        let mut painted = world.query_filtered::<Entity, With<Painted>>();
        let painted: Vec<Entity> = painted.iter(world).collect();
        for entity in painted {
            let is_drawn = world.resource::<LodScene>().records.find(entity).is_some();
            if wanted.is_none() || !is_drawn {
                restore(world, &inherited, entity);
            }
        }
    });
}

/// Every entity that can be drawn, with the mesh tag that the shader reads.
fn painted_pieces(world: &World) -> Vec<(Entity, MeshTag)> {
    let scene = world.resource::<LodScene>();
    let tagged = scene.drawn_pieces().map(|(entity, piece)| {
        // The shader needs the error in world units.
        let transform = world.get::<GlobalTransform>(entity);
        let scale = transform.map_or(1.0, |at| at.scale().abs().max_element());
        let mut tag = MeshTag::default();
        *tag = mesh_tag(piece.level, piece.error_in_local * scale);
        (entity, tag)
    });
    tagged.collect()
}

/// Paints one entity that is drawn.
fn paint(
    world: &mut World,
    inherited: &InheritedComponents,
    entity: Entity,
    material: &Handle<LodDebugMaterial>,
    tag: MeshTag,
) {
    let Ok(entity_ref) = world.get_entity(entity) else {
        return;
    };
    // A material that a game inserts on a painted entity would be drawn besides the debug material.
    let current = entity_ref.get::<MeshMaterial3d<LodDebugMaterial>>();
    let is_painted = current.is_some_and(|current| current.id() == material.id())
        && entity_ref.get::<MeshTag>() == Some(&tag)
        && !inherited.has_material(&entity_ref);
    if is_painted {
        return;
    }
    let is_unit = entity_ref.contains::<LodUnit>();
    let painted = entity_ref.get::<Painted>();
    let saved = painted.and_then(|painted| painted.saved_materials);
    let is_first = painted.is_none();
    let saved_materials = if is_unit {
        inherited.remove_materials(world, entity);
        None
    } else {
        // Materials are of many types: an entity of their own can hold them all.
        let saved = saved.unwrap_or_else(|| world.spawn_empty().id());
        inherited.move_materials(world, entity, saved, is_first);
        Some(saved)
    };
    world.entity_mut(entity).insert((
        MeshMaterial3d(material.clone()),
        tag,
        Painted { saved_materials },
    ));
}

/// Restores the materials and the tag of an entity.
fn restore(world: &mut World, inherited: &InheritedComponents, entity: Entity) {
    let mut painted = world.entity_mut(entity);
    painted.remove::<(MeshMaterial3d<LodDebugMaterial>, MeshTag)>();
    let saved = painted.take::<Painted>();
    if let Some(saved) = saved.and_then(|painted| painted.saved_materials) {
        inherited.move_materials(world, saved, entity, true);
        world.despawn(saved);
    } else if let Some(object) = world.get::<LodUnit>(entity).map(|unit| unit.object) {
        inherited.renew(world, object, entity);
    }
}

impl LodScene {
    /// Every entity that can be drawn, with its piece.
    pub(super) fn drawn_pieces(&self) -> impl Iterator<Item = (Entity, &LodPiece)> {
        self.instances().flat_map(|instance| {
            let whole_mesh = instance.level.map(|level| (instance.entity, level));
            let drawn = whole_mesh.into_iter().chain(self.units_of(instance));
            drawn.map(|(entity, piece)| (entity, &instance.mesh.pieces[piece as usize]))
        })
    }
}
