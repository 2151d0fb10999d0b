//! Each view draws its own cut: selection, and the edit of the lists of visible entities.
//!
//! Bevy's culling fills, for each camera and each shadow cascade, a list of the entities to draw.
//! All units and the source mesh are in them, as far as the frustum reaches; here every list keeps
//! only what the camera's cut draws. Shadow views use the cut of the camera they are for: a cut of
//! their own would let a surface shade itself.

use std::any::TypeId;
use std::time::Instant;

use bevy::camera::visibility::{
    CascadesVisibleEntities, CubemapVisibleEntities, VisibleEntities, VisibleMeshEntities,
};
use bevy::camera::{Camera, RenderTarget, ShadowLodOrigin};
use bevy::ecs::entity::EntityHashMap;
use bevy::light::{DirectionalLight, PointLight, SpotLight};
use bevy::prelude::*;
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{Cut, View, select};

use crate::objects::LodObject;
use crate::{LodDebug, LodView, LodViewStats};

/// Numbers every entity that this plugin draws: an object's slot is its source mesh, the following
/// ones its units.
#[derive(Resource, Default)]
pub(crate) struct Slots {
    /// By entity index; `NO_SLOT` for all other entities.
    slot_of_entity: Vec<u32>,
    first_slot: EntityHashMap<u32>,
    triangles: Vec<u32>,
    is_source: Vec<bool>,
}

const NO_SLOT: u32 = u32::MAX;

impl Slots {
    fn add(&mut self, entity: Entity, triangles: u32, is_source: bool) {
        let index = entity.index_u32() as usize;
        if self.slot_of_entity.len() <= index {
            self.slot_of_entity.resize(index + 1, NO_SLOT);
        }
        self.slot_of_entity[index] = self.triangles.len() as u32;
        self.triangles.push(triangles);
        self.is_source.push(is_source);
    }

    fn get(&self, entity: Entity) -> Option<usize> {
        let slot = self.slot_of_entity.get(entity.index_u32() as usize)?;
        (*slot != NO_SLOT).then_some(*slot as usize)
    }
}

/// The cuts of one camera.
#[derive(Component, Default)]
pub(crate) struct ViewCuts {
    cuts: EntityHashMap<Cut>,
    /// By slot: whether this view draws it.
    drawn: Vec<bool>,
}

/// Numbers the slots anew. Runs when objects came or went.
pub(crate) fn number_slots(objects: Query<(Entity, &LodObject)>, mut slots: ResMut<Slots>) {
    *slots = Slots::default();
    for (entity, object) in &objects {
        let first_slot = slots.triangles.len() as u32;
        slots.first_slot.insert(entity, first_slot);
        let hierarchy = &object.mesh.hierarchy;
        slots.add(entity, hierarchy.source_triangle_count() as u32, true);
        for (&unit_entity, unit) in object.units.iter().zip(&hierarchy.units) {
            slots.add(unit_entity, unit.triangle_count, false);
        }
    }
}

/// Gives every 3D view the components that hold its cuts and its numbers.
pub(crate) fn add_view_components(
    mut commands: Commands,
    cameras: Query<Entity, (With<Camera>, With<VisibleEntities>, Without<ViewCuts>)>,
) {
    for camera in &cameras {
        commands
            .entity(camera)
            .insert((ViewCuts::default(), LodViewStats::default()));
    }
}

/// Selects the cut of every object in every active view.
pub(crate) fn select_cuts(
    mut cameras: Query<(
        &Camera,
        &GlobalTransform,
        Option<&LodView>,
        &mut ViewCuts,
        &mut LodViewStats,
    )>,
    objects: Query<(Entity, &GlobalTransform, &LodObject)>,
    slots: Res<Slots>,
    debug: Res<LodDebug>,
) {
    for (camera, pose, lod_view, mut cuts, mut stats) in &mut cameras {
        if !camera.is_active {
            continue;
        }
        let start = Instant::now();
        let lod_view = lod_view.copied().unwrap_or_default();
        let ViewCuts { cuts, drawn } = &mut *cuts;
        cuts.retain(|object, _| slots.first_slot.contains_key(object));
        drawn.clear();
        drawn.resize(slots.triangles.len(), false);
        let view = (!lod_view.full_detail)
            .then(|| view_of(camera, pose))
            .flatten();
        for (entity, transform, object) in &objects {
            let Some(&first_slot) = slots.first_slot.get(&entity) else {
                continue;
            };
            let first_slot = first_slot as usize;
            let (Some(view), true) = (view, object.mesh.is_uploaded()) else {
                drawn[first_slot] = true;
                continue;
            };
            let cut = cuts.entry(entity).or_default();
            let hierarchy = &object.mesh.hierarchy;
            if !debug.freeze || !is_cut_of(cut, hierarchy) {
                select(
                    hierarchy,
                    &transform.affine(),
                    &view,
                    &lod_view.settings(),
                    cut,
                );
            }
            for &unit in cut.units() {
                drawn[first_slot + 1 + unit as usize] = true;
            }
        }
        stats.selection_time = start.elapsed();
    }
}

/// Whether `cut` may be drawn with `hierarchy`: an object's mesh may have been exchanged, or the cut
/// not been selected yet.
fn is_cut_of(cut: &Cut, hierarchy: &Hierarchy) -> bool {
    let has_unit = |&unit: &u32| (unit as usize) < hierarchy.units.len();
    cut.refined().len() == hierarchy.groups.len() && cut.units().last().is_some_and(has_unit)
}

/// The view of a camera; `None` while it has no viewport, and for projections that the field has no
/// formula for.
fn view_of(camera: &Camera, pose: &GlobalTransform) -> Option<View> {
    let viewport_px = camera.physical_viewport_size()?.as_vec2();
    match camera_field::Camera::from_projection(&camera.clip_from_view(), viewport_px) {
        Ok(intrinsics) => Some(View::new(intrinsics, &pose.affine())),
        Err(fault) => {
            warn_once!("a camera draws full detail: {fault}");
            None
        }
    }
}

/// Takes out of every camera's list what its cut does not draw, and counts the rest.
pub(crate) fn filter_cameras(
    mut cameras: Query<(&Camera, &mut VisibleEntities, &ViewCuts, &mut LodViewStats)>,
    slots: Res<Slots>,
) {
    for (camera, mut visible, view, mut stats) in &mut cameras {
        if !camera.is_active {
            continue;
        }
        let (mut drawn, mut full, mut units) = (0, 0, 0);
        visible.get_mut(TypeId::of::<Mesh3d>()).retain(|&entity| {
            let Some(slot) = slots.get(entity) else {
                return true;
            };
            let triangles = u64::from(slots.triangles[slot]);
            let is_drawn = view.drawn[slot];
            if slots.is_source[slot] {
                full += triangles;
            } else {
                units += u32::from(is_drawn);
            }
            drawn += if is_drawn { triangles } else { 0 };
            is_drawn
        });
        stats.triangles_drawn = drawn;
        stats.triangles_full = full;
        stats.units_drawn = units;
    }
}

/// Takes out of every shadow view's list what the cut of its camera does not draw.
pub(crate) fn filter_shadows(
    mut directional: Query<&mut CascadesVisibleEntities, With<DirectionalLight>>,
    mut point: Query<&mut CubemapVisibleEntities, With<PointLight>>,
    mut spot: Query<&mut VisibleMeshEntities, With<SpotLight>>,
    cameras: Query<(
        Entity,
        &Camera,
        &ViewCuts,
        &RenderTarget,
        Has<ShadowLodOrigin>,
    )>,
    slots: Res<Slots>,
) {
    let filter = |list: &mut VisibleMeshEntities, view: &ViewCuts| {
        let is_drawn = |&entity: &Entity| {
            slots
                .get(entity)
                .is_none_or(|slot| view.drawn.get(slot) != Some(&false))
        };
        list.entities.retain(is_drawn);
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
fn shared_shadow_view<'a>(
    cameras: &'a Query<(
        Entity,
        &Camera,
        &ViewCuts,
        &RenderTarget,
        Has<ShadowLodOrigin>,
    )>,
) -> Option<&'a ViewCuts> {
    cameras
        .iter()
        .filter(|(_, camera, view, _, _)| camera.is_active && !view.drawn.is_empty())
        .min_by_key(|(entity, _, _, target, is_origin)| {
            let to_window = matches!(target, RenderTarget::Window(_));
            (!is_origin, !to_window, *entity)
        })
        .map(|(_, _, view, _, _)| view)
}
