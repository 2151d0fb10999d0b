//! What changes in what views draw, told to the render world where the GPU culls.

use std::sync::{Mutex, PoisonError};

use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::{NoCpuCulling, RenderLayers};
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::sync_world::MainEntity;

use crate::api::systems::FieldLodSystems;
use crate::draw::casters::{CascadeCasters, CasterChange};
use crate::draw::cpu_lists::{ShadowCasters, shared_shadow_cut};
use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::{ViewCut, ViewState};

/// What changed in what views draw.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ListChange {
    /// From now on an entity is drawn by those views alone that mark it; others, by those that do not.
    Add(MainEntity),
    /// An entity is gone, or has no levels any more.
    Remove(MainEntity),
    /// A view begins or ends to mark an entity.
    Mark {
        view: MainEntity,
        entity: MainEntity,
        is_marked: bool,
    },
    /// A cascade draws something otherwise than its camera, or does no longer.
    Caster(CasterChange),
    /// An entity is on other layers, or casts shadows no longer or again.
    Touch(MainEntity),
    /// A view is gone.
    RemoveView(MainEntity),
    /// The view whose cut the shadow maps of point and spot lights draw.
    ShareShadows(Option<MainEntity>),
}

/// The changes on their way to the render world.
#[derive(Resource, Default)]
pub(crate) struct ListChanges(Mutex<Vec<ListChange>>);

impl ListChanges {
    fn extend(&self, changes: impl IntoIterator<Item = ListChange>) {
        let mut queue = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        queue.extend(changes);
    }

    pub(crate) fn take(&self) -> Vec<ListChange> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Notes changes in each frame, if there is a renderer.
pub(crate) fn plugin(app: &mut App) {
    if app.get_sub_app(RenderApp).is_none() {
        return;
    }
    app.init_resource::<ListChanges>()
        .add_observer(note_removed_view)
        .add_systems(
            PostUpdate,
            (
                note_changes,
                note_shadow_view,
                note_changed::<RenderLayers>,
                note_changed::<NotShadowCaster>,
            )
                .in_set(FieldLodSystems::Filter),
        );
}

/// Notes which units and sources came, went, and are drawn by other views than before.
fn note_changes(
    mut scene: ResMut<LodScene>,
    mut views: Query<(Entity, &mut ViewCut)>,
    mut casters: ResMut<CascadeCasters>,
    changes: Res<ListChanges>,
) {
    let scene = scene.bypass_change_detection();
    let (placed, dropped) = scene.records.take_moves();
    let mut all: Vec<ListChange> = dropped
        .into_iter()
        .map(|entity| ListChange::Remove(entity.into()))
        .collect();
    let placed: Vec<(u32, Entity)> = placed
        .into_iter()
        .filter_map(|record| Some((record, scene.records.entity(record)?)))
        .collect();
    all.extend(
        placed
            .iter()
            .map(|&(_, entity)| ListChange::Add(entity.into())),
    );
    for (view, mut cut) in &mut views {
        let cut = cut.bypass_change_detection();
        let mark = |entity: Entity, is_marked: bool| ListChange::Mark {
            view: view.into(),
            entity: entity.into(),
            is_marked,
        };
        // What came, and what the cut has changed in what was there.
        let changed = cut.visibility.take_changed();
        let changed = changed
            .into_iter()
            .filter_map(|record| Some((record, scene.records.entity(record)?)));
        // Sources are drawn by views without a cut.
        let sees_sources = cut.state == ViewState::FullDetail;
        let sources = (std::mem::replace(&mut cut.lists_sources, sees_sources) != sees_sources)
            .then(|| scene.sources());
        for (record, entity) in changed.chain(placed.iter().copied()) {
            let is_source = sees_sources && scene.records.is_source(record);
            all.push(mark(entity, is_source || cut.visibility.contains(record)));
        }
        let sources = sources.into_iter().flatten();
        all.extend(sources.map(|entity| mark(entity, sees_sources)));
    }
    let casters = casters.bypass_change_detection();
    let casters = casters.take_changes(&scene.records, &placed);
    all.extend(casters.into_iter().map(ListChange::Caster));
    if !all.is_empty() {
        changes.extend(all);
    }
}

/// Notes whose cut the shadow maps draw that all cameras share.
fn note_shadow_view(
    cameras: ShadowCasters,
    mut shadow_view: Local<Option<Entity>>,
    changes: Res<ListChanges>,
) {
    let shared = shared_shadow_cut(&cameras).map(|(entity, _)| entity);
    if *shadow_view != shared {
        *shadow_view = shared;
        changes.extend([ListChange::ShareShadows(shared.map(MainEntity::from))]);
    }
}

/// Notes what is on other layers than before, or casts shadows no longer or again: Bevy takes no notice of
/// that by itself.
fn note_changed<C: Component>(
    changed: Query<Entity, (With<NoCpuCulling>, Changed<C>)>,
    mut removed: RemovedComponents<C>,
    mut drawn: Query<&mut Aabb, With<NoCpuCulling>>,
    changes: Res<ListChanges>,
) {
    for entity in changed.iter().chain(removed.read()) {
        if let Ok(mut aabb) = drawn.get_mut(entity) {
            // Extracts it again.
            aabb.set_changed();
            changes.extend([ListChange::Touch(entity.into())]);
        }
    }
}

fn note_removed_view(removal: On<Remove, ViewCut>, changes: Res<ListChanges>) {
    changes.extend([ListChange::RemoveView(removal.entity.into())]);
}
