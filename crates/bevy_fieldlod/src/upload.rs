//! Tells when the GPU has the pieces of meshes, so that a cut is never drawn with pieces missing.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use bevy::asset::AssetId;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy::render::{Render, RenderApp, RenderSystems};

use crate::library::LodMesh;

/// The meshes on their way to the GPU; one queue, seen by the main and the render world.
#[derive(Resource, Clone, Default)]
pub(crate) struct UploadQueue {
    /// `None` without a renderer: nothing to wait for.
    waiting: Option<Arc<Mutex<Vec<Arc<LodMesh>>>>>,
}

impl UploadQueue {
    pub(crate) fn push(&self, lod: Arc<LodMesh>) {
        match &self.waiting {
            Some(queue) => queue
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(lod),
            None => lod.uploaded.store(true, Ordering::Release),
        }
    }
}

pub(crate) fn plugin(app: &mut App) {
    let mut queue = UploadQueue::default();
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        queue.waiting = Some(Arc::default());
        render_app.insert_resource(queue.clone()).add_systems(
            Render,
            note_uploaded
                .after(RenderSystems::PrepareAssets)
                .in_set(RenderSystems::Prepare),
        );
    }
    app.insert_resource(queue);
}

fn note_uploaded(queue: Res<UploadQueue>, meshes: Res<RenderAssets<RenderMesh>>) {
    let Some(queue) = &queue.waiting else {
        return;
    };
    let has = |handle: &Handle<Mesh>| meshes.get(AssetId::from(handle)).is_some();
    let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
    queue.retain(|lod| {
        let mut pieces = lod.pieces.iter().filter_map(|piece| piece.mesh.as_ref());
        let complete = pieces.all(has);
        if complete {
            lod.uploaded.store(true, Ordering::Release);
        }
        !complete
    });
}
