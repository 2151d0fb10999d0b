//! Sends changes of what views draw to the render world, where the GPU culls.

use std::sync::Mutex;

use bevy::camera::visibility::{NoCpuCulling, RenderLayers};
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::sync_world::MainEntity;

use crate::api::systems::FieldLodSystems;
use crate::compat::OnRemove;
use crate::draw::cpu_lists::{ShadowCameras, shared_shadow_cut};
use crate::draw::drawn_meshes::DrawnMeshes;
use crate::lock;
use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::{ViewCut, ViewState};

/// A change of what views draw.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ListChange {
    /// Lists an entity: only views that mark it draw it.
    Add(MainEntity),
    /// An entity was despawned or lost its levels.
    Remove(MainEntity),
    /// A view starts or stops marking an entity.
    Mark {
        view: MainEntity,
        entity: MainEntity,
        is_marked: bool,
    },
    /// The layers of an entity, or whether it casts shadows, changed.
    Touch(MainEntity),
    /// A view was removed.
    RemoveView(MainEntity),
    /// The view whose cut is drawn into the shadow maps of point and spot lights.
    ShareShadows(Option<MainEntity>),
}

/// The queue of changes for the render world.
#[derive(Resource, Default)]
pub(crate) struct ListChanges(Mutex<Vec<ListChange>>);

impl ListChanges {
    fn extend(&self, changes: impl IntoIterator<Item = ListChange>) {
        lock(&self.0).extend(changes);
    }

    pub(crate) fn take(&self) -> Vec<ListChange> {
        std::mem::take(&mut *lock(&self.0))
    }
}

/// Records changes in each frame, if there is a renderer.
pub(crate) fn plugin(app: &mut App) {
    if app.get_sub_app(RenderApp).is_none() {
        app.add_systems(PostUpdate, discard_changes.in_set(FieldLodSystems::Filter));
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

/// Discards the changes of the scene and of the cuts: without a renderer, their lists would grow in each frame.
fn discard_changes(mut scene: ResMut<LodScene>, mut views: Query<&mut ViewCut>) {
    scene.records.take_moves();
    for mut cut in &mut views {
        cut.visibility.take_changed();
    }
}

/// Records which units and sources were added, removed, or are drawn by other views.
fn note_changes(
    mut scene: ResMut<LodScene>,
    mut views: Query<(Entity, &mut ViewCut)>,
    changes: Res<ListChanges>,
) {
    let (placed, dropped) = scene.records.take_moves();
    // Removals first: a despawned entity and its record may have been replaced in the same frame.
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
        let mark = |entity: Entity, is_marked: bool| ListChange::Mark {
            view: view.into(),
            entity: entity.into(),
            is_marked,
        };
        // New entities, and changes of the cut.
        let changed = cut.visibility.take_changed();
        let changed = changed
            .into_iter()
            .filter_map(|record| Some((record, scene.records.entity(record)?)));
        // Views without a cut draw sources.
        let draws_sources = cut.state == ViewState::FullDetail;
        let sources = (std::mem::replace(&mut cut.lists_sources, draws_sources) != draws_sources)
            .then(|| scene.sources());
        for (record, entity) in changed.chain(placed.iter().copied()) {
            let is_source = draws_sources && scene.records.is_source(record);
            all.push(mark(entity, is_source || cut.visibility.contains(record)));
        }
        let sources = sources.into_iter().flatten();
        all.extend(sources.map(|entity| mark(entity, draws_sources)));
    }
    if !all.is_empty() {
        changes.extend(all);
    }
}

/// Records the camera whose cut is drawn into the shadow maps that all cameras share.
fn note_shadow_view(
    cameras: ShadowCameras,
    mut shadow_view: Local<Option<Entity>>,
    changes: Res<ListChanges>,
) {
    let shared = shared_shadow_cut(&cameras).map(|(entity, _)| entity);
    if *shadow_view != shared {
        *shadow_view = shared;
        changes.extend([ListChange::ShareShadows(shared.map(MainEntity::from))]);
    }
}

/// Records entities with a changed or removed `C`. Bevy 0.19 does not extract an entity again when its layers change or
/// when it starts or stops casting shadows.
fn note_changed<C: Component>(
    changed: Query<Entity, (With<NoCpuCulling>, Changed<C>)>,
    mut removed: RemovedComponents<C>,
    culled_by_gpu: Query<(), With<NoCpuCulling>>,
    drawn: Res<DrawnMeshes>,
    changes: Res<ListChanges>,
) {
    for entity in changed.iter().chain(removed.read()) {
        if culled_by_gpu.contains(entity) {
            drawn.extract_again(entity);
            changes.extend([ListChange::Touch(entity.into())]);
        }
    }
}

fn note_removed_view(removal: OnRemove<ViewCut>, changes: Res<ListChanges>) {
    changes.extend([ListChange::RemoveView(removal.entity.into())]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::draw_records::DrawKind;

    #[test]
    fn changes_are_discarded_without_a_renderer() {
        let mut app = App::new();
        app.init_resource::<LodScene>().add_plugins(plugin);
        let view = app.world_mut().spawn(ViewCut::default()).id();
        let source = app.world_mut().spawn_empty().id();
        let mut scene = app.world_mut().resource_mut::<LodScene>();
        scene.records.add_entity(source, DrawKind::Source);
        let mut cut = app.world_mut().get_mut::<ViewCut>(view).unwrap();
        cut.visibility.set(7, true);
        app.update();
        let mut cut = app.world_mut().get_mut::<ViewCut>(view).unwrap();
        assert_eq!(cut.visibility.take_changed(), [0; 0]);
        let mut scene = app.world_mut().resource_mut::<LodScene>();
        assert_eq!(scene.records.take_moves(), (vec![], vec![]));
    }
}
