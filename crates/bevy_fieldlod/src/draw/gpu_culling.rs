//! Leaves frustum culling to the GPU if Bevy's GPU preprocessing can do it, so that the main world visits changed
//! objects only.
//!
//! Bevy excludes entities with [`NoCpuCulling`] from all lists in the main world. The render world keeps a list per
//! view, which changes only with its entities. `gpu_lists` removes the entities that a view does not draw.
//!
//! The CPU culls skinned and morphed meshes: Bevy moves their boxes with their joints, and animates visible ones only.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bevy::camera::visibility::NoCpuCulling;
use bevy::pbr::RenderMeshInstances;
use bevy::prelude::*;
use bevy::render::batching::gpu_preprocessing::{GpuPreprocessingMode, GpuPreprocessingSupport};
use bevy::render::view::NoIndirectDrawing;
use bevy::render::{RenderApp, RenderStartup};

use crate::api::config::FieldLodAppConfig;
use crate::api::systems::FieldLodSystems;
use crate::draw::units::LodUnit;
use crate::scene::lod_mesh::LodObject;
use crate::scene::view_cut::ViewCut;

/// Whether objects and units are culled on the GPU alone.
#[derive(Resource, Default)]
pub(crate) struct GpuCulling {
    pub(crate) is_on: bool,
    /// Whether the device supports it. The render world sets it.
    is_supported: Arc<AtomicBool>,
}

/// Detects whether the GPU can cull, and switches between GPU and CPU culling.
pub(crate) fn plugin(app: &mut App) {
    let culling = GpuCulling::default();
    let is_supported = culling.is_supported.clone();
    // Without a renderer there are only the lists of the main world.
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        let note_support = move |support: Res<GpuPreprocessingSupport>,
                                 instances: Res<RenderMeshInstances>| {
            let has_culling = support.max_supported_mode == GpuPreprocessingMode::Culling;
            let is_built_there = matches!(*instances, RenderMeshInstances::GpuBuilding(_));
            is_supported.store(has_culling && is_built_there, Ordering::Release);
        };
        render_app.add_systems(RenderStartup, note_support);
    }
    app.insert_resource(culling).add_systems(
        PostUpdate,
        switch_gpu_culling.in_set(FieldLodSystems::Track),
    );
}

/// Switches between GPU and CPU culling when the cameras or the configuration change.
fn switch_gpu_culling(
    mut culling: ResMut<GpuCulling>,
    config: Res<FieldLodAppConfig>,
    cameras: Query<Has<NoIndirectDrawing>, With<ViewCut>>,
    drawn: Query<(Entity, Option<&LodObject>), Or<(With<LodObject>, With<LodUnit>)>>,
    mut commands: Commands,
) {
    // Bevy prepares GPU culling only while a camera uses it.
    let is_wanted = config.advanced.gpu_culling && culling.is_supported.load(Ordering::Acquire);
    let all_cull = cameras.iter().all(|has_no_culling| !has_no_culling);
    let is_on = is_wanted && all_cull && (culling.is_on || !cameras.is_empty());
    if is_on == culling.is_on {
        return;
    }
    culling.is_on = is_on;
    for (entity, object) in &drawn {
        // The CPU culls characters.
        if object.is_some_and(|object| object.mesh.rig.is_some()) {
            continue;
        }
        let mut commands = commands.entity(entity);
        if is_on {
            commands.try_insert(NoCpuCulling);
        } else {
            commands.try_remove::<NoCpuCulling>();
        }
    }
}
