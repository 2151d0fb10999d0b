//! Swaps the materials of what is drawn for the debug view's, and restores them.

use bevy::mesh::MeshTag;
use bevy::prelude::*;

use super::material::{DebugMaterials, LodDebugMaterial, mesh_tag};
use crate::debug_options::FieldLodDebug;
use crate::inherit::InheritedComponents;
use crate::lod_mesh::LodPiece;
use crate::lod_scene::{DrawnAs, LodScene};
use crate::units::LodUnit;

/// An entity that is painted.
#[derive(Component)]
pub(super) struct Painted {
    /// An entity that keeps the materials of a whole mesh meanwhile; units inherit theirs.
    saved_materials: Option<Entity>,
}

/// Whether anything is painted or should be.
pub(super) fn is_wanted(
    debug: Res<FieldLodDebug>,
    materials: Res<DebugMaterials>,
    painted: Query<(), With<Painted>>,
) -> bool {
    materials.wanted(&debug).is_some() || !painted.is_empty()
}

/// Paints all that is drawn, or restores it.
pub(super) fn paint_units(world: &mut World) {
    let debug = *world.resource::<FieldLodDebug>();
    let wanted = world.resource::<DebugMaterials>().wanted(&debug).cloned();
    let scene = world.resource::<LodScene>();
    let of_piece =
        |(entity, piece): (Entity, &LodPiece)| (entity, piece.level, piece.error_in_local);
    let drawn: Vec<(Entity, u32, f32)> = scene.drawn_pieces().map(of_piece).collect();
    // Paint what is drawn.
    world.resource_scope(|world, mut inherited: Mut<InheritedComponents>| {
        inherited.update(world);
        if let Some(material) = &wanted {
            for (entity, level, error) in drawn {
                paint(world, &inherited, entity, material, (level, error));
            }
        }
        // What is drawn no longer, or not to be painted any more, gets its own materials back.
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

/// Paints one entity that is drawn at a level, with an error in local units.
fn paint(
    world: &mut World,
    inherited: &InheritedComponents,
    entity: Entity,
    material: &Handle<LodDebugMaterial>,
    (level, error_in_local): (u32, f32),
) {
    let Ok(there) = world.get_entity(entity) else {
        return;
    };
    // Errors are in local units, what the shader shows in those of the world.
    let transform = there.get::<GlobalTransform>();
    let scale = transform.map_or(1.0, |transform| transform.scale().abs().max_element());
    let tag = MeshTag(mesh_tag(level, error_in_local * scale));
    // A material that changed under the paint must go again.
    let current = there.get::<MeshMaterial3d<LodDebugMaterial>>();
    let is_painted = current.is_some_and(|current| current.id() == material.id())
        && there.get::<MeshTag>() == Some(&tag)
        && !inherited.has_material(&there);
    if is_painted {
        return;
    }
    let is_unit = there.contains::<LodUnit>();
    let painted = there.get::<Painted>();
    let saved = painted.and_then(|painted| painted.saved_materials);
    let is_first = painted.is_none();
    // A whole mesh keeps its materials aside; a unit inherits them again.
    let saved_materials = if is_unit {
        inherited.remove_materials(world, entity);
        None
    } else {
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

/// Gives an entity its own materials and tag back.
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
    /// Everything that can be drawn, with its mesh.
    pub(super) fn drawn_pieces(&self) -> impl Iterator<Item = (Entity, &LodPiece)> {
        self.instances().flat_map(|instance| {
            let (whole_mesh, units) = match &instance.drawn_as {
                DrawnAs::WholeMesh { level } => (Some((instance.entity, *level)), &[][..]),
                DrawnAs::Units(units) => (None, &units[..]),
            };
            let spawned = units
                .iter()
                .filter_map(|&(unit, record)| Some((self.records.entity(record)?, unit)));
            let pieces = &instance.mesh.pieces;
            let drawn = whole_mesh.into_iter().chain(spawned);
            drawn.map(|(entity, piece)| (entity, &pieces[piece as usize]))
        })
    }
}
