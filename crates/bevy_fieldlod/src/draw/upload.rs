//! Sends the meshes of units and levels to the GPU, and records when it has them. Without the record, a cut could be
//! drawn with meshes missing.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Weak};

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

/// Meshes that are drawn together. The queue keeps none of them alive.
struct SentMeshes {
    meshes: Vec<AssetId<Mesh>>,
    uploaded: Weak<AtomicBool>,
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
                meshes: added.values().map(Handle::id).collect(),
                uploaded: Arc::downgrade(&uploaded),
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
    let is_uploaded = |mesh: &AssetId<Mesh>| meshes.get(*mesh).is_some();
    lock(waiting).retain(|sent| {
        let Some(uploaded) = sent.uploaded.upgrade() else {
            return false;
        };
        let is_complete = sent.meshes.iter().all(is_uploaded);
        if is_complete {
            // With pipelined rendering, the main world runs at the same time, and sees it in its next frame.
            uploaded.store(true, Ordering::Release);
        }
        !is_complete
    });
}

#[cfg(test)]
mod tests {
    use bevy::asset::RenderAssetUsages;
    use bevy::ecs::system::RunSystemOnce;
    use bevy::mesh::PrimitiveTopology;

    use super::*;

    #[test]
    fn queue_keeps_no_mesh_alive() {
        let mut app = App::new();
        app.add_plugins((TaskPoolPlugin::default(), AssetPlugin::default()))
            .init_asset::<Mesh>()
            .init_resource::<RenderAssets<RenderMesh>>()
            .insert_resource(UploadQueue {
                waiting: Some(Arc::default()),
                ..default()
            });
        let queue = app.world().resource::<UploadQueue>().clone();
        let mut assets = app.world_mut().resource_mut::<Assets<Mesh>>();
        let usage = RenderAssetUsages::RENDER_WORLD;
        let mesh = Mesh::new(PrimitiveTopology::TriangleList, usage);
        let (meshes, uploaded) = queue.send([(0, mesh)], &mut assets);
        drop(meshes);
        app.update();
        assert!(app.world().resource::<Assets<Mesh>>().is_empty());
        let count = |app: &mut App| {
            app.world_mut()
                .run_system_once(note_uploaded_meshes)
                .unwrap();
            lock(queue.waiting.as_ref().unwrap()).len()
        };
        assert_eq!(count(&mut app), 1);
        drop(uploaded);
        assert_eq!(count(&mut app), 0);
    }
}
