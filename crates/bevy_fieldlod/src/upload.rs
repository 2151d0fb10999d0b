//! Notes when the GPU has the pieces of meshes, so that a cut is never drawn with pieces missing.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use bevy::asset::AssetId;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy::render::{Render, RenderApp, RenderSystems};

use crate::lod_mesh::LodMesh;

/// The meshes on their way to the GPU: one queue, shared by the main and the render world.
#[derive(Resource, Clone, Default)]
pub(crate) struct UploadQueue {
    /// `None` without a renderer, where there is nothing to wait for.
    waiting: Option<Arc<Mutex<Vec<Arc<LodMesh>>>>>,
}

impl UploadQueue {
    /// Lets a mesh be noted once the GPU has all its pieces.
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

/// Looks in the render world, if there is one, for what has been uploaded.
pub(crate) fn plugin(app: &mut App) {
    let mut queue = UploadQueue::default();
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        queue.waiting = Some(Arc::default());
        render_app.insert_resource(queue.clone()).add_systems(
            Render,
            note_uploaded_meshes
                .after(RenderSystems::PrepareAssets)
                .in_set(RenderSystems::Prepare),
        );
    }
    app.insert_resource(queue);
}

fn note_uploaded_meshes(queue: Res<UploadQueue>, meshes: Res<RenderAssets<RenderMesh>>) {
    let Some(waiting) = &queue.waiting else {
        return;
    };
    // A mesh leaves the queue as soon as the GPU has its last piece.
    let is_uploaded = |handle: &Handle<Mesh>| meshes.get(AssetId::from(handle)).is_some();
    let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
    waiting.retain(|lod| {
        let mut pieces = lod.pieces.iter().filter_map(|piece| piece.mesh.as_ref());
        let is_complete = pieces.all(is_uploaded);
        if is_complete {
            lod.uploaded.store(true, Ordering::Release);
        }
        !is_complete
    });
}
