//! Notes when the GPU has the pieces of meshes, so that a cut is never drawn with pieces missing.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bevy::asset::AssetId;
use bevy::mesh::Indices;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy::render::{Render, RenderApp, RenderStartup, RenderSystems};

use crate::config::FieldLodConfig;
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

/// Pieces that are to be sent to the GPU, mesh by mesh.
#[derive(Resource, Default)]
pub(crate) struct PiecesToSend(VecDeque<(Arc<LodMesh>, Vec<(AssetId<Mesh>, Mesh)>)>);

impl PiecesToSend {
    /// Sends the pieces of a mesh as soon as those before it are sent.
    pub(crate) fn push(&mut self, lod: Arc<LodMesh>, pieces: Vec<(AssetId<Mesh>, Mesh)>) {
        self.0.push_back((lod, pieces));
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Sends as many pieces as may be sent in a frame: Bevy takes all that is among the assets at once.
pub(crate) fn send_pieces(
    mut to_send: ResMut<PiecesToSend>,
    mut meshes: ResMut<Assets<Mesh>>,
    uploads: Res<UploadQueue>,
    config: Res<FieldLodConfig>,
) {
    let most = config.upload_bytes_per_frame.unwrap_or(usize::MAX);
    let mut sent = 0;
    while sent < most
        && let Some((lod, pieces)) = to_send.0.front_mut()
    {
        let Some((id, mesh)) = pieces.pop() else {
            uploads.push(lod.clone());
            to_send.0.pop_front();
            continue;
        };
        sent += size_of_mesh(&mesh);
        // Its handle is that of a piece, which the queue keeps.
        if let Err(error) = meshes.insert(id, mesh) {
            error!("a piece cannot be drawn: {error}");
        }
    }
}

fn size_of_mesh(mesh: &Mesh) -> usize {
    let indices = mesh.indices().map_or(0, |indices| match indices {
        Indices::U16(indices) => size_of_val(indices.as_slice()),
        Indices::U32(indices) => size_of_val(indices.as_slice()),
    });
    mesh.get_vertex_size() as usize * mesh.count_vertices() + indices
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
    app.insert_resource(queue).init_resource::<PiecesToSend>();
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
