//! Removes the source meshes of units from the GPU while no view draws them, and uploads them again.
//!
//! Bevy keeps a mesh on the GPU while any handle refers to it. Once all entities with a source are drawn as units, this
//! module reports the source to Bevy's render world as removed. In the frame in which the source is drawn again, the
//! module reports it as added, with the data from main memory.
//!
//! The users of meshes are searched only after a change that may affect the result, so most frames cost nothing.

use std::sync::Mutex;

use bevy::asset::{AssetId, RenderAssetUsages};
use bevy::platform::collections::HashSet;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::{AssetExtractionSystems, ExtractedAssets};
use bevy::render::{Extract, ExtractSchedule, RenderApp};

use crate::api::config::FieldLodAppConfig;
use crate::api::systems::FieldLodSystems;
use crate::compat::{OnAdd, OnDiscard, OnRemove};
use crate::draw::drawn_meshes::DrawnMeshes;
use crate::draw::units::LodUnit;
use crate::lock;
use crate::scene::lod_mesh::LodObject;
use crate::scene::view_cut::{ViewCut, ViewState};

/// Source meshes that are not on the GPU.
#[derive(Resource, Default)]
pub(crate) struct ReleasedSources {
    released: HashSet<AssetId<Mesh>>,
    /// Sources of units that stay on the GPU, because other entities draw them.
    shared: HashSet<AssetId<Mesh>>,
    /// Whether an entity with one of these meshes was added, changed or removed.
    is_stale: bool,
    /// Whether a view draws sources.
    any_view_draws_sources: bool,
    /// Changes for the render world: a mesh, and whether it must be on the GPU.
    changes: Mutex<Vec<(AssetId<Mesh>, bool)>>,
}

impl ReleasedSources {
    /// Records that an entity starts or stops drawing a mesh itself.
    pub(crate) fn note_user(&mut self, mesh: AssetId<Mesh>) {
        self.is_stale |= self.contains(mesh);
    }

    /// Whether a mesh is not on the GPU.
    pub(crate) fn is_released(&self, mesh: AssetId<Mesh>) -> bool {
        self.released.contains(&mesh)
    }

    /// Records that a mesh was loaded again, unchanged. Bevy uploads it, and it is released again.
    pub(crate) fn note_reloaded(&self, mesh: AssetId<Mesh>) {
        if self.is_released(mesh) {
            lock(&self.changes).push((mesh, false));
        }
    }

    fn contains(&self, mesh: AssetId<Mesh>) -> bool {
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
        change_render_assets.after(AssetExtractionSystems),
    );
    app.add_observer(note_new_object)
        .add_observer(note_removed_object)
        .add_observer(note_lost_mesh::<Mesh2d>)
        .add_observer(note_lost_mesh::<Mesh3d>)
        .add_systems(
            PostUpdate,
            release_sources
                .run_if(may_release)
                // After the spawn of units that replace a source: until then, the source is drawn.
                .after(FieldLodSystems::Spawn)
                .in_set(FieldLodSystems::Filter),
        );
}

fn note_new_object(
    new: OnAdd<LodObject>,
    objects: Query<&LodObject>,
    mut sources: ResMut<ReleasedSources>,
) {
    sources.is_stale |= objects.get(new.entity).is_ok_and(LodObject::has_units);
}

fn note_removed_object(
    removed: OnRemove<LodObject>,
    objects: Query<&LodObject>,
    mut sources: ResMut<ReleasedSources>,
) {
    sources.is_stale |= objects.get(removed.entity).is_ok_and(LodObject::has_units);
}

fn note_lost_mesh<M: Component>(
    lost: OnDiscard<M>,
    meshes: Query<&M>,
    mut sources: ResMut<ReleasedSources>,
) where
    for<'a> &'a M: Into<AssetId<Mesh>>,
{
    if let Ok(mesh) = meshes.get(lost.entity) {
        sources.note_user(mesh.into());
    }
}

/// Whether the set of released sources may have to change.
fn may_release(
    sources: Res<ReleasedSources>,
    views: Query<&ViewCut>,
    flat: Query<&Mesh2d, Changed<Mesh2d>>,
    config: Res<FieldLodAppConfig>,
) -> bool {
    // No observer runs when a handle is replaced in place. `track_objects` reports changes of `Mesh3d`.
    sources.is_stale
        || config.is_changed()
        || sources.any_view_draws_sources != any_draws_sources(&views)
        || flat.iter().any(|mesh| sources.contains(mesh.id()))
}

fn any_draws_sources(views: &Query<&ViewCut>) -> bool {
    views.iter().any(|cut| cut.state == ViewState::FullDetail)
}

/// Updates the sets of released and shared sources.
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
    let (mut unused, mut shared) = (HashSet::new(), HashSet::new());
    if !config.advanced.sources_on_gpu && !sources.any_view_draws_sources {
        let has_units = |object: &Option<&LodObject>| object.is_some_and(LodObject::has_units);
        let clustered = drawn.iter().filter(|(.., object)| has_units(object));
        unused.extend(clustered.map(|(_, mesh, _)| mesh.id()));
        // A source that is not in main memory could not be uploaded again.
        let is_in_main_memory = |mesh: &AssetId<Mesh>| {
            let usage = meshes.get(*mesh).map(|mesh| mesh.asset_usage);
            usage == Some(RenderAssetUsages::default())
        };
        unused.retain(is_in_main_memory);
        // The finest level of a whole mesh is its source, which a view may need in any frame.
        let others = drawn.iter().filter(|(.., object)| !has_units(object));
        let others = others.map(|(_, mesh, _)| mesh.id());
        for mesh in others.chain(flat.iter().map(|mesh| mesh.id())) {
            shared.extend(unused.take(&mesh));
        }
    }
    let released = unused.difference(&sources.released);
    let returned: HashSet<_> = sources.released.difference(&unused).copied().collect();
    let changes = released.map(|mesh| (*mesh, false));
    lock(&sources.changes).extend(changes.chain(returned.iter().map(|mesh| (*mesh, true))));
    (sources.released, sources.shared) = (unused, shared);
    if returned.is_empty() {
        return;
    }
    // Bevy caches where a mesh lies in the buffers of the GPU. A returned mesh may lie elsewhere.
    for (entity, mesh, _) in &drawn {
        if returned.contains(&mesh.id()) {
            drawn_meshes.extract_again(entity);
        }
    }
}

/// Makes Bevy free the buffers of released meshes, and upload returned ones.
fn change_render_assets(
    sources: Extract<Res<ReleasedSources>>,
    meshes: Extract<Res<Assets<Mesh>>>,
    mut extracted: ResMut<ExtractedAssets<RenderMesh>>,
) {
    for (id, is_wanted) in lock(&sources.changes).drain(..) {
        let extracted = &mut *extracted;
        if !is_wanted {
            // A mesh may be added or edited, and released, in the same frame.
            extracted.extracted.retain(|(of, _)| *of != id);
            extracted.added.remove(&id);
            extracted.removed.insert(id);
        } else if let Some(mesh) = meshes.get(id)
            // Bevy may have extracted the mesh in this frame already.
            && extracted.added.insert(id)
        {
            extracted.extracted.push((id, mesh.clone()));
        }
    }
}
