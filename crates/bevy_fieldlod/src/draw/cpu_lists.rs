//! Filters the lists of visible entities.
//!
//! Bevy's culling fills, for each camera and each shadow view, a list of the entities to draw: the source
//! meshes and the units of all views' cuts, as far as the frustum reaches. Here every list keeps only
//! what its camera's cut draws. Shadow views use the cut of the camera they are for: a cut of their own
//! would let a surface shade itself.

use std::any::TypeId;

use bevy::camera::visibility::{
    CascadesVisibleEntities, CubemapVisibleEntities, VisibleEntities, VisibleMeshEntities,
};
use bevy::camera::{Camera, RenderTarget, ShadowLodOrigin};
use bevy::light::{DirectionalLight, PointLight, SpotLight};
use bevy::prelude::*;

use crate::api::stats::FieldLodViewStats;
use crate::api::systems::FieldLodSystems;
use crate::draw::gpu_culling::GpuCulling;
use crate::scene::draw_records::{DrawKind, DrawRecord};
use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::{ViewCut, ViewState};

/// Filters after Bevy's culling, where anything is cut into units.
pub(crate) fn plugin(app: &mut App) {
    let filters = |scene: Res<LodScene>| scene.is_filtered();
    let systems = (filter_visible_entities, filter_shadow_views.run_if(filters))
        .distributive_run_if(is_culled_on_cpu);
    app.add_systems(PostUpdate, systems.in_set(FieldLodSystems::Filter));
}

fn is_culled_on_cpu(culling: Res<GpuCulling>) -> bool {
    !culling.is_on
}

/// Whether a view draws the entity of a record.
pub(crate) fn is_drawn(cut: &ViewCut, index: u32, record: &DrawRecord) -> bool {
    match record.kind {
        DrawKind::Free => true,
        DrawKind::WholeMesh => !cut.visibility.contains(index),
        // Also while a cut waits for its first units.
        DrawKind::Source => cut.state != ViewState::Cut || cut.visibility.contains(index),
        DrawKind::Unit { .. } => cut.visibility.contains(index),
    }
}

/// Removes from every camera's list what its cut does not draw, and counts the rest.
fn filter_visible_entities(
    mut cameras: Query<(
        &Camera,
        &mut VisibleEntities,
        &ViewCut,
        &mut FieldLodViewStats,
    )>,
    scene: Res<LodScene>,
) {
    for (camera, mut visible, cut, mut stats) in &mut cameras {
        if !camera.is_active {
            continue;
        }
        // One pass over the list filters and counts.
        let (mut drawn, mut full, mut units) = (0, 0, 0);
        let mut keep_and_count = |entity: Entity| {
            let Some((index, record)) = scene.records.find(entity) else {
                return true;
            };
            full += u64::from(record.triangles_full);
            let is_drawn = is_drawn(cut, index, record);
            if is_drawn {
                drawn += u64::from(record.triangles);
                units += u32::from(record.kind != DrawKind::Source);
            }
            is_drawn
        };
        let meshes = TypeId::of::<Mesh3d>();
        if scene.is_filtered() {
            let visible = visible.get_mut(meshes);
            visible.retain(|&entity| keep_and_count(entity));
        } else {
            // All whole meshes are drawn: the list stays as it is, and unchanged.
            for &entity in visible.bypass_change_detection().get(meshes) {
                keep_and_count(entity);
            }
        }
        stats.triangles_drawn = drawn;
        stats.triangles_full = full;
        stats.units_drawn = units;
    }
}

pub(crate) type ShadowCasters<'w, 's> = Query<
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

/// Removes from every shadow view's list what the cut of its camera does not draw.
fn filter_shadow_views(
    mut directional: Query<&mut CascadesVisibleEntities, With<DirectionalLight>>,
    mut point: Query<&mut CubemapVisibleEntities, With<PointLight>>,
    mut spot: Query<&mut VisibleMeshEntities, With<SpotLight>>,
    cameras: ShadowCasters,
    scene: Res<LodScene>,
) {
    let filter = |list: &mut VisibleMeshEntities, cut: &ViewCut| {
        list.entities.retain(|&entity| {
            let record = scene.records.find(entity);
            record.is_none_or(|(index, record)| is_drawn(cut, index, record))
        });
    };
    // Each camera has its own cascades of a directional light.
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

/// The cut that the shadows of point and spot lights use: that of the marked camera, else of one that
/// draws to a window, else of any, as Bevy chooses for its visibility ranges.
pub(crate) fn shared_shadow_cut<'a>(cameras: &'a ShadowCasters) -> Option<(Entity, &'a ViewCut)> {
    cameras
        .iter()
        .filter(|(_, camera, cut, _, _)| camera.is_active && cut.state != ViewState::Inactive)
        .min_by_key(|(entity, _, _, target, is_origin)| {
            let to_window = matches!(target, RenderTarget::Window(_));
            (!is_origin, !to_window, *entity)
        })
        .map(|(entity, _, cut, _, _)| (entity, cut))
}
