//! Exchanges the materials of what is drawn, and puts them back.

use bevy::mesh::MeshTag;
use bevy::prelude::*;

use super::surface::{LodSurfaceMaterial, Surfaces, tag};
use crate::FieldLodDebug;
use crate::inherit::Inheritance;
use crate::units::LodUnit;
use crate::world::{Drawn, LodWorld};

/// An entity that is painted.
#[derive(Component)]
pub(crate) struct Painted {
    /// An entity that keeps what a chain wore itself; units get theirs from their object.
    wardrobe: Option<Entity>,
}

/// Whether anything is painted or should be.
pub(crate) fn is_wanted(
    debug: Res<FieldLodDebug>,
    surfaces: Res<Surfaces>,
    painted: Query<(), With<Painted>>,
) -> bool {
    surfaces.wanted(&debug).is_some() || !painted.is_empty()
}

/// Paints, or puts everything back.
pub(crate) fn paint(world: &mut World) {
    let debug = *world.resource::<FieldLodDebug>();
    let wanted = world.resource::<Surfaces>().wanted(&debug).cloned();
    let drawn: Vec<(Entity, u32, f32)> = world.resource::<LodWorld>().drawn_errors().collect();
    world.resource_scope(|world, mut inheritance: Mut<Inheritance>| {
        inheritance.update(world);
        if let Some(material) = &wanted {
            for (entity, level, error) in drawn {
                paint_one(world, &inheritance, entity, material, (level, error));
            }
        }
        let mut painted = world.query::<(Entity, &Painted)>();
        let painted: Vec<(Entity, Option<Entity>)> = painted
            .iter(world)
            .map(|(entity, painted)| (entity, painted.wardrobe))
            .collect();
        for (entity, wardrobe) in painted {
            let drawn = world.resource::<LodWorld>().slots.of(entity).is_some();
            if wanted.is_none() || !drawn {
                put_back(world, &inheritance, entity, wardrobe);
            }
        }
    });
}

fn paint_one(
    world: &mut World,
    inheritance: &Inheritance,
    entity: Entity,
    material: &Handle<LodSurfaceMaterial>,
    (level, error_in_local): (u32, f32),
) {
    let Ok(there) = world.get_entity(entity) else {
        return;
    };
    let scale = there.get::<GlobalTransform>().map(|place| {
        let scale = place.scale().abs();
        scale.max_element()
    });
    let tag = MeshTag(tag(level, error_in_local * scale.unwrap_or(1.0)));
    let worn = there.get::<MeshMaterial3d<LodSurfaceMaterial>>();
    let is_painted = worn.is_some_and(|worn| worn.id() == material.id())
        && there.get::<MeshTag>() == Some(&tag)
        && !inheritance.wears_material(&there);
    if is_painted {
        return;
    }
    let is_unit = there.contains::<LodUnit>();
    let mut wardrobe = there.get::<Painted>().and_then(|painted| painted.wardrobe);
    let was_painted = there.contains::<Painted>();
    if !is_unit {
        let wardrobe = *wardrobe.get_or_insert_with(|| world.spawn_empty().id());
        inheritance.move_materials(world, entity, wardrobe, !was_painted);
    } else {
        inheritance.strip_materials(world, entity);
    }
    world
        .entity_mut(entity)
        .insert((MeshMaterial3d(material.clone()), tag, Painted { wardrobe }));
}

fn put_back(
    world: &mut World,
    inheritance: &Inheritance,
    entity: Entity,
    wardrobe: Option<Entity>,
) {
    world
        .entity_mut(entity)
        .remove::<(MeshMaterial3d<LodSurfaceMaterial>, MeshTag, Painted)>();
    if let Some(wardrobe) = wardrobe {
        inheritance.move_materials(world, wardrobe, entity, true);
        world.despawn(wardrobe);
    } else if let Some(object) = world.get::<LodUnit>(entity).map(|unit| unit.object) {
        inheritance.renew(world, object, entity);
    }
}

impl LodWorld {
    /// Everything that can be drawn, with its level.
    pub(crate) fn drawn_levels(&self) -> impl Iterator<Item = (Entity, u32)> {
        self.drawn_errors()
            .map(|(entity, level, _)| (entity, level))
    }

    /// Everything that can be drawn, with its level and its error in local units.
    fn drawn_errors(&self) -> impl Iterator<Item = (Entity, u32, f32)> {
        self.instances().flat_map(|instance| {
            let (own, units) = match &instance.drawn {
                Drawn::Chain { level } => (Some((instance.entity, *level)), &[][..]),
                Drawn::Units(units) => (None, &units[..]),
            };
            let units = units
                .iter()
                .filter_map(|&(unit, slot)| Some((self.slots.entity(slot)?, unit)));
            own.into_iter().chain(units).map(|(entity, piece)| {
                let piece = &instance.mesh.pieces[piece as usize];
                (entity, piece.level, piece.error_in_local)
            })
        })
    }
}
