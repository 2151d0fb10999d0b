//! The materials that bakes read.

use bevy::ecs::query::QueryData;
use bevy::pbr::{ExtendedMaterial, MaterialExtension};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;

use crate::scene::lod_mesh::LodWaiting;

/// What a bake reads as the colour and the opacity of an entity whose own material has a type that it does not know.
/// Nothing is drawn with it. [`FieldLodAppExt::bake_extended_material`](crate::FieldLodAppExt::bake_extended_material)
/// inserts it for extended materials.
#[derive(Component, Clone, Debug)]
pub struct BakeMaterial(pub Handle<StandardMaterial>);

/// The material of an entity for its bake.
#[derive(QueryData)]
pub(crate) struct MaterialToBake {
    own: Option<&'static MeshMaterial3d<StandardMaterial>>,
    told: Option<&'static BakeMaterial>,
}

impl MaterialToBakeItem<'_, '_> {
    pub(crate) fn id(&self) -> Option<AssetId<StandardMaterial>> {
        let told = self.told.map(|material| material.0.id());
        told.or_else(|| self.own.map(|material| material.id()))
    }
}

type Extended<E> = ExtendedMaterial<StandardMaterial, E>;

/// An entity with an extended material.
type WithExtended<E> = (Entity, &'static MeshMaterial3d<Extended<E>>);
/// It waits for levels, and its material was not read.
type IsUnread = (With<LodWaiting>, Without<BakeMaterial>);

/// Tells bakes the base of extended materials. Without the plugins of the materials, there are none.
pub(crate) fn read_extended_materials<E: MaterialExtension>(
    unread: Query<WithExtended<E>, IsUnread>,
    materials: Option<Res<Assets<Extended<E>>>>,
    bases: Option<ResMut<Assets<StandardMaterial>>>,
    mut known: Local<HashMap<AssetId<Extended<E>>, AssetId<StandardMaterial>>>,
    mut commands: Commands,
) {
    let (Some(materials), Some(mut bases)) = (materials, bases) else {
        return;
    };
    for (entity, material) in &unread {
        let Some(own) = materials.get(material) else {
            continue;
        };
        // The entities keep the base alive, not this map: it holds textures.
        let base = known.get(&material.id());
        let base = base.and_then(|base| bases.get_strong_handle(*base));
        let base = base.unwrap_or_else(|| bases.add(own.base.clone()));
        known.insert(material.id(), base.id());
        commands.entity(entity).try_insert(BakeMaterial(base));
    }
}
