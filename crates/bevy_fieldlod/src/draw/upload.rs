//! Sends the pieces of meshes to the GPU and notes when it has them, so that a cut is never drawn with pieces
//! missing.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bevy::asset::AssetId;
use bevy::mesh::Indices;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy::render::{Render, RenderApp, RenderStartup, RenderSystems};

use crate::api::config::FieldLodConfig;

/// Pieces on their way to the GPU: one queue, shared by the main and the render world.
#[derive(Resource, Clone, Default)]
pub(crate) struct UploadQueue {
    /// `None` without a renderer, where there is nothing to wait for.
    waiting: Option<Arc<Mutex<Vec<SentPieces>>>>,
    /// Whether there is another device than that which the pieces were sent to.
    is_lost: Arc<AtomicBool>,
}

/// Pieces that are used together.
#[derive(Default)]
struct SentPieces {
    pieces: Vec<Handle<Mesh>>,
    uploaded: Arc<AtomicBool>,
}

impl UploadQueue {
    /// Lets pieces be noted once the GPU has all of them.
    fn push(&self, sent: SentPieces) {
        match &self.waiting {
            Some(queue) => queue
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(sent),
            None => sent.uploaded.store(true, Ordering::Release),
        }
    }

    /// Whether the GPU has lost all pieces since this was last asked.
    pub(crate) fn take_lost(&self) -> bool {
        self.is_lost.swap(false, Ordering::AcqRel)
    }
}

/// Pieces that are to be sent to the GPU.
#[derive(Resource, Default)]
pub(crate) struct PiecesToSend(VecDeque<(Vec<(Handle<Mesh>, Mesh)>, SentPieces)>);

impl PiecesToSend {
    /// Sends pieces as soon as those before them are sent. What is returned becomes true once the GPU has all of
    /// them.
    pub(crate) fn push(&mut self, pieces: Vec<(Handle<Mesh>, Mesh)>) -> Arc<AtomicBool> {
        let uploaded = Arc::<AtomicBool>::default();
        let sent = SentPieces {
            pieces: Vec::with_capacity(pieces.len()),
            uploaded: uploaded.clone(),
        };
        self.0.push_back((pieces, sent));
        uploaded
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
        && let Some((pieces, done)) = to_send.0.front_mut()
    {
        let Some((handle, mesh)) = pieces.pop() else {
            uploads.push(std::mem::take(done));
            to_send.0.pop_front();
            continue;
        };
        sent += size_of_mesh(&mesh);
        if let Err(error) = meshes.insert(&handle, mesh) {
            error!("a piece cannot be drawn: {error}");
        }
        done.pieces.push(handle);
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
    // They leave the queue as soon as the GPU has the last of them.
    let is_uploaded = |handle: &Handle<Mesh>| meshes.get(AssetId::from(handle)).is_some();
    let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
    waiting.retain(|sent| {
        let is_complete = sent.pieces.iter().all(is_uploaded);
        if is_complete {
            sent.uploaded.store(true, Ordering::Release);
        }
        !is_complete
    });
}
