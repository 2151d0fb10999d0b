//! Plants far away are drawn as cards: with pictures of them, in a material beside their own.
//!
//! An entity keeps its material. Only the renderer is told to take another while the mesh that is drawn is one of
//! cards: a [`StandardMaterial`] like the entity's own, but for what the pictures hold. Of materials that pictures
//! cannot stand for, and of other types, entities are drawn with triangles: at a level that errs no more than the cards.

pub(crate) mod card_levels;
mod dress;
mod material;
mod materials;
mod warm_up;

use std::sync::Arc;

use bevy::asset::AssetId;
use bevy::pbr::{
    Lightmap, MaterialExtractionSystems, MeshExtractionSystems, RenderMaterialInstances,
};
use bevy::prelude::*;
use bevy::render::sync_world::MainEntity;
use bevy::render::{Extract, ExtractSchedule, RenderApp};

use crate::api::systems::FieldLodSystems;
use crate::scene::lod_mesh::LodMesh;
use dress::dress_objects;
pub(crate) use dress::dress_unit;
pub(crate) use material::{may_be_cards, stand_for};
use materials::{CardMaterials, follow_changes};

type MaterialOf = MeshMaterial3d<StandardMaterial>;

/// An entity whose coarsest levels are cards.
#[derive(Component)]
pub(crate) struct LodCards {
    mesh: Arc<LodMesh>,
    /// What they are drawn with; `None` as long as they cannot be drawn.
    material: Option<Handle<StandardMaterial>>,
}

impl LodCards {
    pub(crate) fn new(mesh: &Arc<LodMesh>) -> Self {
        Self {
            mesh: mesh.clone(),
            material: None,
        }
    }

    /// Whether an entity may be drawn as cards.
    pub(crate) fn can_be_drawn(cards: Option<&Self>) -> bool {
        cards.is_some_and(|cards| cards.material.is_some())
    }

    /// The material that draws a mesh, if it is not the entity's own.
    fn material_of(&self, mesh: AssetId<Mesh>) -> Option<&Handle<StandardMaterial>> {
        let is_cards = self.mesh.level_of_cards(mesh).is_some();
        self.material.as_ref().filter(|_| is_cards)
    }
}

/// Gives entities the materials of cards.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct DressObjects;

/// Gives entities the materials of cards, and lets the renderer use them.
pub(crate) fn plugin(app: &mut App) {
    app.init_resource::<CardMaterials>()
        .add_systems(
            PostUpdate,
            (
                follow_changes,
                dress_objects.in_set(DressObjects),
                note_other_materials,
            )
                .chain()
                .run_if(resource_exists::<Assets<StandardMaterial>>)
                .in_set(FieldLodSystems::Inherit),
        )
        .add_observer(note_cards)
        .add_observer(note_lightmap)
        .add_observer(note_lost_lightmap)
        .add_observer(undress);
    warm_up::plugin(app);
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        render_app.add_systems(
            ExtractSchedule,
            draw_with_own_material
                .after(MaterialExtractionSystems)
                .before(MeshExtractionSystems),
        );
    }
}

fn note_cards(added: On<Insert, LodCards>, mut materials: ResMut<CardMaterials>) {
    materials.to_dress.push(added.entity);
}

fn note_lightmap(added: On<Insert, Lightmap>, mut materials: ResMut<CardMaterials>) {
    materials.to_dress.push(added.entity);
}

fn note_lost_lightmap(lost: On<Remove, Lightmap>, mut materials: ResMut<CardMaterials>) {
    materials.to_dress.push(lost.entity);
}

/// Lets the renderer draw what has no levels of cards any more with its own material.
fn undress(
    removed: On<Remove, LodCards>,
    mut materials: Query<&mut MaterialOf>,
    mut cards: ResMut<CardMaterials>,
) {
    cards.may_have_lost_meshes = true;
    if let Ok(mut material) = materials.get_mut(removed.entity) {
        material.set_changed();
    }
}

/// Lets Bevy, which knows nothing of their material, bin anew what is drawn as cards of another one.
fn note_other_materials(mut changed: Query<(&LodCards, &mut Mesh3d), Changed<LodCards>>) {
    for (cards, mut mesh) in &mut changed {
        if cards.mesh.level_of_cards(mesh.id()).is_some() {
            mesh.set_changed();
        }
    }
}

/// What may be drawn with another material than in the last frame, or was just extracted with its own.
type MayDrawAnew = Or<(
    Changed<LodCards>,
    Changed<Mesh3d>,
    Changed<ViewVisibility>,
    Changed<MaterialOf>,
)>;

/// Tells the renderer which material each entity is drawn with that may be cards.
fn draw_with_own_material(
    mut drawn: ResMut<RenderMaterialInstances>,
    objects: Extract<Query<(Entity, &MaterialOf, &Mesh3d, &LodCards), MayDrawAnew>>,
) {
    for (entity, own, mesh, cards) in &objects {
        // Bevy has just put it there, if it is visible.
        if let Some(instance) = drawn.instances.get_mut(&MainEntity::from(entity)) {
            let material = cards.material_of(mesh.id()).unwrap_or(&own.0);
            instance.asset_id = material.id().untyped();
        }
    }
}
