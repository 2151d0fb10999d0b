//! Gives entities, and the units that cast their shadows, the materials of cards.

use bevy::ecs::lifecycle::RemovedComponents;
use bevy::pbr::Lightmap;
use bevy::prelude::*;

use super::materials::CardMaterials;
use super::warm_up::WarmUps;
use super::{LodCards, MaterialOf};
use crate::scene::changed::ChangedOn;
use crate::scene::lod_mesh::{LodObject, LodSource};
use crate::scene::lod_scene::LodScene;

/// Lets entities that have levels of cards be drawn as such as soon as that is possible, and as long.
pub(super) fn dress_objects(
    changed: ChangedOn<MaterialOf, With<LodCards>>,
    mut lost: RemovedComponents<MaterialOf>,
    mut entities: Query<(
        Option<&MaterialOf>,
        Has<Lightmap>,
        &LodSource,
        &mut LodCards,
        &mut Mesh3d,
    )>,
    mut cards: ResMut<CardMaterials>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut warm_ups: WarmUps,
    mut scene: ResMut<LodScene>,
) {
    changed.add_to(&mut cards.to_dress);
    cards.to_dress.extend(lost.read());
    for entity in cards.take_entities(&warm_ups) {
        let Ok((material, has_lightmap, source, mut own, mut mesh)) = entities.get_mut(entity)
        else {
            continue;
        };
        // A lightmap is laid out for the surface: cards have no place on it.
        let material = material.filter(|_| !has_lightmap);
        let wanted = material.and_then(|material| {
            let start = |handle: &_| warm_ups.start(entity, handle);
            cards.find(entity, &own.mesh, material.id(), &mut materials, start)
        });
        if own.material == wanted {
            continue;
        }
        if wanted.is_none()
            && let Some(level) = own.mesh.level_of_cards(mesh.id())
        {
            let stand_in = own.mesh.piece_at(level, false);
            mesh.0 = own.mesh.mesh_at(stand_in, source).clone();
            scene.set_piece_of(entity, stand_in);
        }
        own.material = wanted;
        scene.choose_again(entity);
    }
}

/// Gives a unit its material if it draws cards: one of a prop that casts its shadow. `piece` is its index among those
/// of the mesh.
pub(crate) fn dress_unit(world: &mut World, object: Entity, unit: Entity, piece: u32) {
    let levels = world.get::<LodObject>(object).map(|object| &object.mesh);
    let levels = levels.and_then(|mesh| mesh.cards.as_ref());
    if levels.is_some_and(|levels| levels.levels().contains(&piece)) {
        let cards = world.get::<LodCards>(object);
        if let Some(material) = cards.and_then(|cards| cards.material.clone()) {
            world.entity_mut(unit).insert(MeshMaterial3d(material));
        }
    }
}
