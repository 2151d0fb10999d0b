//! Notes when the GPU has the pieces of meshes, so that a cut is never drawn with pieces missing.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bevy::asset::AssetId;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy::render::{Render, RenderApp, RenderStartup, RenderSystems};

use crate::lod_mesh::LodMesh;

/// The meshes on their way to the GPU: one queue, shared by the main and the render world.
#[derive(Resource, Clone, Default)]
pub(crate) struct UploadQueue {
    /// `None` without a renderer, where there is nothing to wait for.
    waiting: Option<Arc<Mutex<Vec<Arc<LodMesh>>>>>,
    /// Whether there is another device than that which the pieces were sent to.
    is_lost: Arc<AtomicBool>,
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

    /// Whether the GPU has lost all pieces since this was last asked.
    pub(crate) fn take_lost(&self) -> bool {
        self.is_lost.swap(false, Ordering::AcqRel)
    }
}

/// Looks in the render world, if there is one, for what has been uploaded.
pub(crate) fn plugin(app: &mut App) {
    let mut queue = UploadQueue::default();
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        queue.waiting = Some(Arc::default());
        render_app.insert_resource(queue.clone());
        render_app.add_systems(RenderStartup, note_new_device);
        render_app.add_systems(
            Render,
            note_uploaded_meshes
                .after(RenderSystems::PrepareAssets)
                .in_set(RenderSystems::Prepare),
        );
    }
    app.insert_resource(queue);
}

/// Notes a device after the first: Bevy makes one where that was lost, and a game wants to go on.
fn note_new_device(queue: Res<UploadQueue>, mut devices: Local<u32>) {
    *devices += 1;
    if *devices > 1 {
        queue.is_lost.store(true, Ordering::Release);
    }
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
