//! Filters the lists of visible entities, where the CPU culls.
//!
//! For each camera and each shadow view, Bevy's culling fills a list with all source meshes and units that intersect
//! the frustum. This module removes the entities that the cut of the camera does not draw. Shadow views use the cut of
//! their camera: with a cut of their own, a surface could shade itself.

use std::any::TypeId;

use bevy::camera::visibility::{
    CascadesVisibleEntities, CubemapVisibleEntities, VisibleEntities, VisibleMeshEntities,
};
use bevy::camera::{Camera, RenderTarget, ShadowLodOrigin};
use bevy::light::{DirectionalLight, PointLight, SpotLight};
use bevy::prelude::*;

use crate::api::systems::FieldLodSystems;
use crate::draw::gpu_culling::GpuCulling;
use crate::scene::draw_records::{DrawKind, DrawRecord};
use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::{ViewCut, ViewState};

/// Filters after Bevy's culling.
pub(crate) fn plugin(app: &mut App) {
    let filters =
        |scene: Res<LodScene>, culling: Res<GpuCulling>| scene.has_units() && !culling.is_on;
    let systems = (filter_visible_entities, filter_shadow_views).distributive_run_if(filters);
    app.add_systems(PostUpdate, systems.in_set(FieldLodSystems::Filter));
}

/// Whether a view draws the entity of a record.
pub(crate) fn is_drawn(cut: &ViewCut, index: u32, record: &DrawRecord) -> bool {
    match record.kind {
        DrawKind::Free | DrawKind::WholeMesh => true,
        DrawKind::Source => cut.state != ViewState::Cut,
        DrawKind::Unit { .. } => cut.visibility.contains(index),
    }
}

/// Removes from every camera's list the entities that its cut does not draw.
fn filter_visible_entities(
    mut cameras: Query<(&Camera, &mut VisibleEntities, &ViewCut)>,
    scene: Res<LodScene>,
) {
    for (camera, mut visible, cut) in &mut cameras {
        if camera.is_active {
            filter(visible.get_mut(TypeId::of::<Mesh3d>()), cut, &scene);
        }
    }
}

/// Removes from a list the entities that a cut does not draw.
fn filter(entities: &mut Vec<Entity>, cut: &ViewCut, scene: &LodScene) {
    entities.retain(|&entity| {
        let record = scene.records.find(entity);
        record.is_none_or(|(index, record)| is_drawn(cut, index, record))
    });
}

pub(crate) type ShadowCameras<'w, 's> = Query<
    'w,
    's,
    (
        Entity,
        &'static Camera,
        &'static ViewCut,
        &'static RenderTarget,
        Has<ShadowLodOrigin>,
    ),
>;

/// Removes from every shadow view's list the entities that the cut of its camera does not draw.
fn filter_shadow_views(
    mut directional: Query<&mut CascadesVisibleEntities, With<DirectionalLight>>,
    mut point: Query<&mut CubemapVisibleEntities, With<PointLight>>,
    mut spot: Query<&mut VisibleMeshEntities, With<SpotLight>>,
    cameras: ShadowCameras,
    scene: Res<LodScene>,
) {
    let filter = |list: &mut VisibleMeshEntities, cut: &ViewCut| {
        filter(&mut list.entities, cut, &scene);
    };
    // A directional light has cascades per camera.
    for mut light in &mut directional {
        for (&camera, cascades) in &mut light.entities {
            if let Ok((_, _, cut, _, _)) = cameras.get(camera) {
                cascades.iter_mut().for_each(|list| filter(list, cut));
            }
        }
    }
    // All cameras share the shadow maps of point and spot lights.
    let Some((_, cut)) = shared_shadow_cut(&cameras) else {
        return;
    };
    for mut light in &mut point {
        light.iter_mut().for_each(|list| filter(list, cut));
    }
    for mut list in &mut spot {
        filter(&mut list, cut);
    }
}

/// The cut for the shadows of point and spot lights. The first choice is the camera with [`ShadowLodOrigin`], then a
/// camera that draws to a window, then any camera. Bevy chooses the origin of its visibility ranges in the same order.
pub(crate) fn shared_shadow_cut<'a>(cameras: &'a ShadowCameras) -> Option<(Entity, &'a ViewCut)> {
    cameras
        .iter()
        .filter(|(_, camera, cut, _, _)| camera.is_active && cut.state != ViewState::Inactive)
        .min_by_key(|(entity, _, _, target, is_origin)| {
            let to_window = matches!(target, RenderTarget::Window(_));
            // The least entity, like Bevy.
            (!is_origin, !to_window, *entity)
        })
        .map(|(entity, _, cut, _, _)| (entity, cut))
}
