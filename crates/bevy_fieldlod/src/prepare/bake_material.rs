//! The materials that bakes read.

use bevy::ecs::query::QueryData;
use bevy::pbr::{ExtendedMaterial, MaterialExtension};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;

/// What a bake reads as the colour and the opacity of an entity whose own material has a type that it does not know.
/// Nothing is drawn with it. [`FieldLodAppExt::bake_extended_material`](crate::FieldLodAppExt::bake_extended_material)
/// inserts it for extended materials.
#[derive(Component, Clone, Debug)]
pub struct BakeMaterial(pub Handle<StandardMaterial>);

/// The material of an entity for its bake.
#[derive(QueryData)]
pub(super) struct MaterialToBake {
    own: Option<&'static MeshMaterial3d<StandardMaterial>>,
    told: Option<&'static BakeMaterial>,
}

impl MaterialToBakeItem<'_, '_> {
    pub(super) fn id(&self) -> Option<AssetId<StandardMaterial>> {
        let told = self.told.map(|material| material.0.id());
        told.or_else(|| self.own.map(|material| material.id()))
    }
}

type Extended<E> = ExtendedMaterial<StandardMaterial, E>;

/// Entities whose material was not read.
type Unread<E> = (Entity, &'static MeshMaterial3d<Extended<E>>);

/// Tells bakes the base of extended materials.
pub(crate) fn read_extended_materials<E: MaterialExtension>(
    unread: Query<Unread<E>, Without<BakeMaterial>>,
    materials: Res<Assets<Extended<E>>>,
    mut bases: ResMut<Assets<StandardMaterial>>,
    mut known: Local<HashMap<AssetId<Extended<E>>, Handle<StandardMaterial>>>,
    mut commands: Commands,
) {
    for (entity, material) in &unread {
        let Some(own) = materials.get(material) else {
            continue;
        };
        let base = known.entry(material.id());
        let base = base.or_insert_with(|| bases.add(own.base.clone()));
        commands
            .entity(entity)
            .try_insert(BakeMaterial(base.clone()));
    }
}
