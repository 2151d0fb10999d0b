//! Swaps the materials of what is drawn for the debug view's, and restores them.

use bevy::mesh::MeshTag;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use fieldlod_select::{InstanceId, OcclusionBuffer};

use super::material::{DebugMaterials, LodDebugMaterial, mesh_tag};
use crate::api::debug_options::{FieldLodDebug, FieldLodHeatMap};
use crate::draw::inherit::InheritedComponents;
use crate::draw::units::LodUnit;
use crate::scene::lod_mesh::LodPiece;
use crate::scene::lod_scene::{LodInstance, LodScene};
use crate::scene::view_cut::ViewCut;

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
    let drawn = painted_pieces(world, debug.heat_map);
    // Paint what is drawn.
    world.resource_scope(|world, mut inherited: Mut<InheritedComponents>| {
        inherited.update(world);
        if let Some(material) = &wanted {
            for (entity, tag) in drawn {
                paint(world, &inherited, entity, material, tag);
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

/// Everything that can be drawn, with the tag of its paint.
fn painted_pieces(world: &mut World, heat_map: Option<FieldLodHeatMap>) -> Vec<(Entity, MeshTag)> {
    let mut views = world.query::<&ViewCut>();
    let world: &World = world;
    let buffers = views.iter(world).filter_map(|cut| cut.selector.occlusion());
    let buffers: Vec<&OcclusionBuffer> = buffers.collect();
    let scene = world.resource::<LodScene>();
    // The most that is visible of an object from any view.
    let visible_share = |instance: &LodInstance| {
        let shares = buffers.iter().map(|buffer| {
            let of_groups = buffer.visible_shares(&scene.scene, instance.id);
            of_groups.iter().sum::<f32>() / of_groups.len().max(1) as f32
        });
        shares.reduce(f32::max).unwrap_or(1.0)
    };
    let shares_wanted = heat_map == Some(FieldLodHeatMap::VisibleShare);
    let missing = match heat_map {
        Some(FieldLodHeatMap::Missing) => Some(missing_px(views.iter(world), scene)),
        _ => None,
    };
    scene
        .instances()
        .flat_map(|instance| {
            let share = shares_wanted.then(|| visible_share(instance));
            let missing = missing.as_ref();
            scene.pieces_of(instance).map(move |(entity, piece)| {
                // Errors are in local units, what the shader shows in those of the world.
                let transform = world.get::<GlobalTransform>(entity);
                let scale = transform.map_or(1.0, |at| at.scale().abs().max_element());
                let missing = missing.map(|missing| {
                    let px = piece
                        .produced_by
                        .and_then(|group| missing.get(&(instance.id, group)));
                    px.map_or(0.0, |px| px / MOST_MISSING_PX)
                });
                let share = share.or(missing);
                let quantity = share.unwrap_or(piece.error_in_local * scale);
                (entity, MeshTag(mesh_tag(piece.level, quantity)))
            })
        })
        .collect()
}

/// What is painted red.
const MOST_MISSING_PX: f32 = 8.0;

/// The groups that some view would refine and that are not in memory, with the error of what is drawn instead: of
/// each instance, the units that these have produced.
fn missing_px<'a>(
    views: impl Iterator<Item = &'a ViewCut>,
    scene: &LodScene,
) -> HashMap<(InstanceId, u32), f32> {
    let mut missing = HashMap::default();
    for cut in views {
        cut.selector.demand(&scene.scene, |demand| {
            if let Some(px) = demand.missing_px {
                let most: &mut f32 = missing.entry((demand.instance, demand.group)).or_default();
                *most = most.max(px);
            }
        });
    }
    missing
}

/// Paints one entity that is drawn.
fn paint(
    world: &mut World,
    inherited: &InheritedComponents,
    entity: Entity,
    material: &Handle<LodDebugMaterial>,
    tag: MeshTag,
) {
    let Ok(there) = world.get_entity(entity) else {
        return;
    };
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
        self.instances()
            .flat_map(|instance| self.pieces_of(instance))
    }

    /// What can be drawn of an instance.
    fn pieces_of<'a>(
        &'a self,
        instance: &'a LodInstance,
    ) -> impl Iterator<Item = (Entity, &'a LodPiece)> {
        let whole_mesh = instance.piece.map(|piece| (instance.entity, piece));
        let spawned = instance
            .units
            .iter()
            .filter_map(|&(unit, record)| Some((self.records.entity(record)?, unit)));
        let pieces = &instance.mesh.pieces;
        let drawn = whole_mesh.into_iter().chain(spawned);
        drawn.map(|(entity, piece)| (entity, &pieces[piece as usize]))
    }
}
