//! Counts what views draw where the GPU culls, and no list of the main world tells it.

use bevy::camera::primitives::{Aabb, Frustum};
use bevy::camera::visibility::RenderLayers;
use bevy::prelude::*;
use fieldlod_select::InstanceId;

use crate::api::stats::FieldLodViewStats;
use crate::api::systems::FieldLodSystems;
use crate::draw::gpu_culling::GpuCulling;
use crate::scene::lod_scene::{FIRST_LAYER, LodInstance, LodScene};
use crate::scene::view_cut::{ViewCut, ViewState, layer_bits};

/// Counts after levels and units have been chosen.
pub(crate) fn plugin(app: &mut App) {
    let is_culled_on_gpu = |culling: Res<GpuCulling>| culling.is_on;
    let systems = count_drawn.run_if(is_culled_on_gpu);
    app.add_systems(PostUpdate, systems.in_set(FieldLodSystems::Filter));
}

/// Counts what is in the frustum of each camera, where it or the scene has changed.
fn count_drawn(
    mut cameras: Query<(
        &Camera,
        Ref<Frustum>,
        Option<&RenderLayers>,
        &mut ViewCut,
        &mut FieldLodViewStats,
    )>,
    scene: Res<LodScene>,
) {
    for (camera, frustum, layers, mut cut, mut stats) in &mut cameras {
        let layers = layer_bits(layers);
        let counted = Some([scene.revision, cut.visibility.revision, layers]);
        if !camera.is_active || (cut.counted == counted && !frustum.is_changed()) {
            continue;
        }
        cut.counted = counted;
        let mut count = Count::default();
        let planes = frustum.half_spaces.map(|half_space| half_space.normal_d());
        // What is drawn by all views on the first layer alike is summed up, and what is hidden is nothing.
        let sums = layers & FIRST_LAYER != 0 && cut.state == ViewState::Cut && !scene.culls;
        let mut visit = |id: InstanceId, is_within: bool| {
            if let Some(instance) = scene.instance(id.index() as u32) {
                let frustum = (!is_within).then_some(&*frustum);
                count.add(instance, &cut, &scene, frustum);
            }
        };
        // All but the far one, as Bevy culls.
        let planes = &planes[..5];
        let within = scene.scene.tally_within(planes, layers, sums, &mut visit);
        let [full, drawn, units] = within.sums;
        stats.triangles_full = full + count.full;
        stats.triangles_drawn = drawn + count.drawn;
        stats.units_drawn = units as u32 + count.units;
    }
}

/// What a view draws.
#[derive(Default)]
struct Count {
    drawn: u64,
    full: u64,
    units: u32,
}

impl Count {
    /// Counts an instance, as far as it is in the frustum; `None` if it is as a whole.
    fn add(
        &mut self,
        instance: &LodInstance,
        cut: &ViewCut,
        scene: &LodScene,
        frustum: Option<&Frustum>,
    ) {
        let world_from_local = scene.scene.placement(instance.id);
        let is_seen = |aabb: &Aabb| {
            frustum
                .is_none_or(|frustum| frustum.intersects_obb(aabb, &world_from_local, true, false))
        };
        let mesh = &instance.mesh;
        if !mesh.aabb.as_ref().is_none_or(is_seen) {
            return;
        }
        self.full += u64::from(mesh.triangles_full);
        let is_marked = cut.visibility.contains(instance.record);
        match instance.piece {
            Some(piece) if !is_marked => {
                self.drawn += u64::from(mesh.pieces[piece as usize].triangles);
                self.units += 1;
            }
            Some(_) => {}
            None if is_marked || cut.state != ViewState::Cut => {
                self.drawn += u64::from(mesh.triangles_full);
            }
            None => {
                for &(unit, record) in &instance.units {
                    let piece = &mesh.pieces[unit as usize];
                    if cut.visibility.contains(record) && is_seen(&piece.aabb()) {
                        self.drawn += u64::from(piece.triangles);
                        self.units += 1;
                    }
                }
            }
        }
    }
}
