//! Takes the source meshes of units off the GPU while no view draws them, and puts them back.
//!
//! Bevy keeps a mesh on the GPU as long as anything refers to it. Here the render world is told that a mesh was removed
//! as soon as all entities that have it are drawn as units, and that it was added, with what main memory has of it,
//! in the frame in which an entity or a view wants the source again.

use std::sync::{Mutex, PoisonError};

use bevy::asset::{AssetId, RenderAssetUsages};
use bevy::platform::collections::HashSet;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::{AssetExtractionSystems, ExtractedAssets};
use bevy::render::{Extract, ExtractSchedule, RenderApp};

use crate::config::FieldLodConfig;
use crate::lod_mesh::LodClusters;
use crate::systems::FieldLodSystems;
use crate::units::LodUnit;
use crate::view_cut::{ViewCut, ViewState};

/// Source meshes that the GPU does not have.
#[derive(Resource, Default)]
struct ReleasedSources {
    released: HashSet<AssetId<Mesh>>,
    /// What the render world has not heard of yet: whether the GPU is to have a mesh.
    changes: Mutex<Vec<(AssetId<Mesh>, bool)>>,
}

/// Releases sources, if there is a renderer.
pub(crate) fn plugin(app: &mut App) {
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app.add_systems(
        ExtractSchedule,
        tell_render_assets.after(AssetExtractionSystems),
    );
    let is_wanted = |config: Res<FieldLodConfig>, sources: Res<ReleasedSources>| {
        config.releases_sources() || !sources.released.is_empty()
    };
    app.init_resource::<ReleasedSources>().add_systems(
        PostUpdate,
        release_sources
            .run_if(is_wanted)
            .after(FieldLodSystems::Spawn)
            .in_set(FieldLodSystems::Filter),
    );
}

impl FieldLodConfig {
    /// Where units come a few at a time, sources are drawn while others are awaited.
    fn releases_sources(&self) -> bool {
        !self.sources_on_gpu && self.units_per_frame.is_none()
    }
}

/// Decides which sources the GPU is to have.
fn release_sources(
    mut sources: ResMut<ReleasedSources>,
    mut drawn: Query<(&mut Mesh3d, Has<LodClusters>), Without<LodUnit>>,
    views: Query<&ViewCut>,
    meshes: Res<Assets<Mesh>>,
    config: Res<FieldLodConfig>,
) {
    let sees_sources = views.iter().any(|cut| cut.state == ViewState::FullDetail);
    let mut spare = HashSet::new();
    if config.releases_sources() && !sees_sources {
        let clustered = drawn.iter().filter(|(_, is_cut)| *is_cut);
        spare.extend(clustered.map(|(mesh, _)| mesh.id()));
        // It comes back from main memory.
        let is_kept = |mesh: &AssetId<Mesh>| {
            let usage = meshes.get(*mesh).map(|mesh| mesh.asset_usage);
            usage == Some(RenderAssetUsages::default())
        };
        spare.retain(is_kept);
        for (mesh, _) in drawn.iter().filter(|(_, is_cut)| !is_cut) {
            spare.remove(&mesh.id());
        }
    }
    let ReleasedSources { released, changes } = sources.bypass_change_detection();
    if *released == spare {
        return;
    }
    let changes = changes.get_mut().unwrap_or_else(PoisonError::into_inner);
    changes.extend(spare.difference(released).map(|mesh| (*mesh, false)));
    let back: HashSet<AssetId<Mesh>> = released.difference(&spare).copied().collect();
    changes.extend(back.iter().map(|mesh| (*mesh, true)));
    *released = spare;
    // Where the mesh lies has to be looked up anew.
    for (mut mesh, _) in &mut drawn {
        if back.contains(&mesh.id()) {
            mesh.set_changed();
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
