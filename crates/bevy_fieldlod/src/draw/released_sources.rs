//! Takes the source meshes of units off the GPU while no view draws them, and puts them back.
//!
//! Bevy keeps a mesh on the GPU as long as anything refers to it. Here the render world is told that a mesh was removed
//! as soon as all entities that have it are drawn as units, and that it was added, with what main memory has of it,
//! in the frame in which an entity or a view wants the source again.
//!
//! Who has a mesh is looked up anew where something has come or gone that may: all other frames cost nothing.

use std::sync::{Mutex, PoisonError};

use bevy::asset::{AssetId, RenderAssetUsages};
use bevy::ecs::lifecycle::Discard;
use bevy::platform::collections::HashSet;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::{AssetExtractionSystems, ExtractedAssets};
use bevy::render::{Extract, ExtractSchedule, RenderApp};

use crate::api::config::FieldLodAppConfig;
use crate::api::systems::FieldLodSystems;
use crate::draw::drawn_meshes::DrawnMeshes;
use crate::draw::units::LodUnit;
use crate::scene::lod_mesh::LodObject;
use crate::scene::view_cut::{ViewCut, ViewState};

/// Source meshes that the GPU does not have.
#[derive(Resource, Default)]
pub(crate) struct ReleasedSources {
    released: HashSet<AssetId<Mesh>>,
    /// Those that it has although all of their objects are drawn as units: others draw them as they are.
    shared: HashSet<AssetId<Mesh>>,
    /// Whether something may have come or gone that draws one of those.
    is_stale: bool,
    /// Whether a view draws sources.
    any_view_draws_sources: bool,
    /// What the render world has not heard of yet: whether the GPU is to have a mesh.
    changes: Mutex<Vec<(AssetId<Mesh>, bool)>>,
}

impl ReleasedSources {
    /// Notes that an entity draws a mesh as it is from now on, or does no more.
    pub(crate) fn note(&mut self, mesh: AssetId<Mesh>) {
        self.is_stale |= self.concerns(mesh);
    }

    fn concerns(&self, mesh: AssetId<Mesh>) -> bool {
        self.released.contains(&mesh) || self.shared.contains(&mesh)
    }
}

/// Releases sources, if there is a renderer.
pub(crate) fn plugin(app: &mut App) {
    app.init_resource::<ReleasedSources>();
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app.add_systems(
        ExtractSchedule,
        tell_render_assets.after(AssetExtractionSystems),
    );
    app.add_observer(note_units::<Add>)
        .add_observer(note_units::<Remove>)
        .add_observer(note_lost_mesh::<Mesh2d>)
        .add_observer(note_lost_mesh::<Mesh3d>)
        .add_systems(
            PostUpdate,
            release_sources
                .run_if(may_release)
                .after(FieldLodSystems::Spawn)
                .in_set(FieldLodSystems::Filter),
        );
}

fn note_units<E: EntityEvent>(
    event: On<E, LodObject>,
    objects: Query<&LodObject>,
    mut sources: ResMut<ReleasedSources>,
) {
    let object = objects.get(event.event_target());
    sources.is_stale |= object.is_ok_and(LodObject::has_units);
}

fn note_lost_mesh<M: Component>(
    lost: On<Discard, M>,
    meshes: Query<&M>,
    mut sources: ResMut<ReleasedSources>,
) where
    for<'a> &'a M: Into<AssetId<Mesh>>,
{
    if let Ok(mesh) = meshes.get(lost.entity) {
        sources.note(mesh.into());
    }
}

/// Whether sources may have to leave the GPU or come back.
fn may_release(
    sources: Res<ReleasedSources>,
    views: Query<&ViewCut>,
    flat: Query<&Mesh2d, Changed<Mesh2d>>,
    config: Res<FieldLodAppConfig>,
) -> bool {
    // Flat meshes draw their mesh as it is, and may get another handle in place.
    sources.is_stale
        || config.is_changed()
        || sources.any_view_draws_sources != any_draws_sources(&views)
        || flat.iter().any(|mesh| sources.concerns(mesh.id()))
}

fn any_draws_sources(views: &Query<&ViewCut>) -> bool {
    views.iter().any(|cut| cut.state == ViewState::FullDetail)
}

/// Decides which sources the GPU is to have.
fn release_sources(
    mut sources: ResMut<ReleasedSources>,
    drawn: Query<(Entity, &Mesh3d, Option<&LodObject>), Without<LodUnit>>,
    drawn_meshes: Res<DrawnMeshes>,
    flat: Query<&Mesh2d>,
    views: Query<&ViewCut>,
    meshes: Res<Assets<Mesh>>,
    config: Res<FieldLodAppConfig>,
) {
    let sources = sources.bypass_change_detection();
    sources.is_stale = false;
    sources.any_view_draws_sources = any_draws_sources(&views);
    let (mut spare, mut shared) = (HashSet::new(), HashSet::new());
    if !config.advanced.sources_on_gpu && !sources.any_view_draws_sources {
        let has_units = |object: &Option<&LodObject>| object.is_some_and(LodObject::has_units);
        let clustered = drawn.iter().filter(|(.., object)| has_units(object));
        spare.extend(clustered.map(|(_, mesh, _)| mesh.id()));
        // It comes back from main memory.
        let is_kept = |mesh: &AssetId<Mesh>| {
            let usage = meshes.get(*mesh).map(|mesh| mesh.asset_usage);
            usage == Some(RenderAssetUsages::default())
        };
        spare.retain(is_kept);
        // Whole meshes have it as their finest level, and may draw it in any frame.
        let others = drawn.iter().filter(|(.., object)| !has_units(object));
        let others = others.map(|(_, mesh, _)| mesh.id());
        for mesh in others.chain(flat.iter().map(|mesh| mesh.id())) {
            shared.extend(spare.take(&mesh));
        }
    }
    let ReleasedSources {
        released, changes, ..
    } = &mut *sources;
    let changes = changes.get_mut().unwrap_or_else(PoisonError::into_inner);
    changes.extend(spare.difference(released).map(|mesh| (*mesh, false)));
    let back: HashSet<AssetId<Mesh>> = released.difference(&spare).copied().collect();
    changes.extend(back.iter().map(|mesh| (*mesh, true)));
    (sources.released, sources.shared) = (spare, shared);
    if back.is_empty() {
        return;
    }
    // Bevy caches the place of a mesh in the buffers of the GPU.
    for (entity, mesh, _) in &drawn {
        if back.contains(&mesh.id()) {
            drawn_meshes.extract_again(entity);
        }
    }
}

/// Lets Bevy take meshes off the GPU, and send them there again.
fn tell_render_assets(
    sources: Extract<Res<ReleasedSources>>,
    meshes: Extract<Res<Assets<Mesh>>>,
    mut extracted: ResMut<ExtractedAssets<RenderMesh>>,
) {
    let mut changes = sources
        .changes
        .lock()
        .unwrap_or_else(PoisonError::into_inner);
    for (id, is_wanted) in changes.drain(..) {
        let extracted = &mut *extracted;
        if !is_wanted {
            extracted.extracted.retain(|(of, _)| *of != id);
            extracted.added.remove(&id);
            extracted.removed.insert(id);
        } else if let Some(mesh) = meshes.get(id)
            && extracted.added.insert(id)
        {
            extracted.extracted.push((id, mesh.clone()));
        }
    }
}
