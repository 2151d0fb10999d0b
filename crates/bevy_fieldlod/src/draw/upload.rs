//! Sends the meshes of units and levels to the GPU, and records when it has them. Without the record, a cut could be
//! drawn with meshes missing.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use bevy::asset::AssetId;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy::render::{Render, RenderApp, RenderStartup, RenderSystems};

use crate::lock;

/// Meshes on their way to the GPU. The main and the render world share it.
#[derive(Resource, Clone, Default)]
pub(crate) struct UploadQueue {
    /// `None` without a renderer: meshes then count as uploaded at once.
    waiting: Option<Arc<Mutex<Vec<SentMeshes>>>>,
    /// Whether Bevy has replaced the device that the meshes were sent to.
    is_lost: Arc<AtomicBool>,
}

/// Meshes that are drawn together.
struct SentMeshes {
    meshes: Vec<Handle<Mesh>>,
    uploaded: Arc<AtomicBool>,
}

impl UploadQueue {
    /// Adds the meshes of units to the assets. The flag becomes true once the GPU has all of them.
    pub(crate) fn send(
        &self,
        meshes: impl IntoIterator<Item = (u32, Mesh)>,
        assets: &mut Assets<Mesh>,
    ) -> (HashMap<u32, Handle<Mesh>>, Arc<AtomicBool>) {
        let uploaded = Arc::new(AtomicBool::new(self.waiting.is_none()));
        let meshes = meshes.into_iter();
        let added: HashMap<_, _> = meshes
            .map(|(unit, mesh)| (unit, assets.add(mesh)))
            .collect();
        if let Some(waiting) = &self.waiting {
            lock(waiting).push(SentMeshes {
                meshes: added.values().cloned().collect(),
                uploaded: uploaded.clone(),
            });
        }
        (added, uploaded)
    }

    /// Whether the GPU has lost all meshes since the last call.
    pub(crate) fn take_lost(&self) -> bool {
        self.is_lost.swap(false, Ordering::AcqRel)
    }
}

/// Watches uploads in the render world, if there is one.
pub(crate) fn plugin(app: &mut App) {
    let mut queue = UploadQueue::default();
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        queue.waiting = Some(Arc::default());
        render_app.insert_resource(queue.clone());
        render_app.add_systems(RenderStartup, note_new_device);
        render_app.add_systems(
            Render,
            note_uploaded_meshes
                // In the frame in which Bevy has uploaded them.
                .after(RenderSystems::PrepareAssets)
                .in_set(RenderSystems::Prepare),
        );
    }
    app.insert_resource(queue);
}

/// Records every device after the first: Bevy creates a new one when a device is lost.
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
    let is_uploaded = |handle: &Handle<Mesh>| meshes.get(AssetId::from(handle)).is_some();
    lock(waiting).retain(|sent| {
        let is_complete = sent.meshes.iter().all(is_uploaded);
        if is_complete {
            // With pipelined rendering, the main world runs at the same time, and sees it in its next frame.
            sent.uploaded.store(true, Ordering::Release);
        }
        !is_complete
    });
}
