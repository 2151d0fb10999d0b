//! The edit of the lists of visible entities.
//!
//! Bevy's culling fills, for each camera and each shadow view, a list of the entities to draw. The
//! source meshes and the units of all views' cuts are in them, as far as the frustum reaches; here
//! every list keeps only what its camera's cut draws. Shadow views use the cut of the camera they are
//! for: a cut of their own would let a surface shade itself.

use std::any::TypeId;

use bevy::camera::visibility::{
    CascadesVisibleEntities, CubemapVisibleEntities, VisibleEntities, VisibleMeshEntities,
};
use bevy::camera::{Camera, RenderTarget, ShadowLodOrigin};
use bevy::light::{DirectionalLight, PointLight, SpotLight};
use bevy::prelude::*;

use crate::FieldLodViewStats;
use crate::slots::{Slot, SlotKind};
use crate::views::{ViewCuts, ViewState};
use crate::world::LodWorld;

impl ViewCuts {
    /// Whether this view draws the entity of a slot.
    fn draws(&self, number: u32, slot: &Slot) -> bool {
        match slot.kind {
            SlotKind::Free | SlotKind::Whole => true,
            SlotKind::Source => self.state != ViewState::Cuts,
            SlotKind::Unit => self.marks.draws(number),
        }
    }
}

/// Takes out of every camera's list what its cut does not draw, and counts the rest.
pub(crate) fn filter_cameras(
    mut cameras: Query<(
        &Camera,
        &mut VisibleEntities,
        &ViewCuts,
        &mut FieldLodViewStats,
    )>,
    world: Res<LodWorld>,
) {
    for (camera, mut visible, view, mut stats) in &mut cameras {
        if !camera.is_active {
            continue;
        }
        let (mut drawn, mut full, mut units) = (0, 0, 0);
        let mut count = |entity: Entity| {
            let Some((number, slot)) = world.slots.of(entity) else {
                return true;
            };
            full += u64::from(slot.triangles_full);
            let is_drawn = view.draws(number, slot);
            if is_drawn {
                drawn += u64::from(slot.triangles);
                units += u32::from(slot.kind != SlotKind::Source);
            }
            is_drawn
        };
        if world.has_clusters() {
            visible
                .get_mut(TypeId::of::<Mesh3d>())
                .retain(|&entity| count(entity));
        } else {
            for &entity in visible
                .bypass_change_detection()
                .get(TypeId::of::<Mesh3d>())
            {
                count(entity);
            }
        }
        stats.triangles_drawn = drawn;
        stats.triangles_full = full;
        stats.units_drawn = units;
    }
}

type ShadowViews<'w, 's> = Query<
    'w,
    's,
    (
        Entity,
        &'static Camera,
        &'static ViewCuts,
        &'static RenderTarget,
        Has<ShadowLodOrigin>,
    ),
>;

/// Takes out of every shadow view's list what the cut of its camera does not draw.
pub(crate) fn filter_shadows(
    mut directional: Query<&mut CascadesVisibleEntities, With<DirectionalLight>>,
    mut point: Query<&mut CubemapVisibleEntities, With<PointLight>>,
    mut spot: Query<&mut VisibleMeshEntities, With<SpotLight>>,
    cameras: ShadowViews,
    world: Res<LodWorld>,
) {
    let filter = |list: &mut VisibleMeshEntities, view: &ViewCuts| {
        list.entities.retain(|&entity| {
            let slot = world.slots.of(entity);
            slot.is_none_or(|(number, slot)| view.draws(number, slot))
        });
    };
    for mut light in &mut directional {
        for (&camera, cascades) in &mut light.entities {
            if let Ok((_, _, view, _, _)) = cameras.get(camera) {
                cascades.iter_mut().for_each(|list| filter(list, view));
            }
        }
    }
    let Some(view) = shared_shadow_view(&cameras) else {
        return;
    };
    for mut light in &mut point {
        light.iter_mut().for_each(|list| filter(list, view));
    }
    for mut list in &mut spot {
        filter(&mut list, view);
    }
}

/// The view whose cut the shadows of point and spot lights use, which all cameras share: the marked
/// one, else one that draws to a window, else any, as Bevy chooses for its visibility ranges.
fn shared_shadow_view<'a>(cameras: &'a ShadowViews) -> Option<&'a ViewCuts> {
    cameras
        .iter()
        .filter(|(_, camera, view, _, _)| camera.is_active && view.state != ViewState::Idle)
        .min_by_key(|(entity, _, _, target, is_origin)| {
            let to_window = matches!(target, RenderTarget::Window(_));
            (!is_origin, !to_window, *entity)
        })
        .map(|(_, _, view, _, _)| view)
}
