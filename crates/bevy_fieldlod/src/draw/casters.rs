//! Lets coarser levels of whole meshes cast their shadows where a sun's shadow map is coarser than what the view
//! draws.
//!
//! The shadow maps of a sun, one for each cascade, reach far around the camera, so that what stands near it is drawn
//! again in maps whose texels are much larger than its details. Where a level errs by no more texels than
//! [`FieldLodSettings::shadow_error_texels`], and saves enough triangles, that level casts the shadow: a unit, which
//! cascades alone draw, in place of the object.

use bevy::camera::visibility::RenderLayers;
use bevy::light::{Cascades, NotShadowCaster, SimulationLightSystems};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::render::sync_world::MainEntity;
use bevy::render::view::RetainedViewEntity;
use fieldlod_select::InstanceId;

use crate::api::settings::FieldLodSettings;
use crate::api::systems::FieldLodSystems;
use crate::draw::gpu_culling::GpuCulling;
use crate::draw::whole_meshes::swap_whole_meshes;
use crate::scene::draw_records::DrawRecords;
use crate::scene::lod_mesh::LodObject;
use crate::scene::lod_scene::{LodInstance, LodScene, largest_scale};
use crate::scene::view_cut::{ViewCut, ViewState, layer_bits};

/// An entity of its own has to save this many triangles at least.
const LEAST_SAVED: u32 = 512;

/// What the cascades of all cameras draw in place of whole meshes.
#[derive(Resource, Default)]
pub(crate) struct CascadeCasters {
    cascades: HashMap<RetainedViewEntity, Cascade>,
    removed: Vec<RetainedViewEntity>,
}

/// What one cascade draws in place of whole meshes.
#[derive(Default)]
struct Cascade {
    largest_error_in_world: f32,
    /// By the index of the instance.
    drawn: HashMap<u32, Caster>,
    /// What came, with `true`, and went since the render world was last told.
    changed: Vec<(Caster, bool)>,
}

/// What changed in what cascades draw otherwise than their cameras.
#[derive(Clone, Copy, Debug)]
pub(crate) enum CasterChange {
    /// A cascade begins or ends to draw an entity otherwise: a unit there alone, an object not there.
    Mark {
        cascade: RetainedViewEntity,
        entity: MainEntity,
        is_marked: bool,
    },
    /// A cascade is gone.
    RemoveCascade(RetainedViewEntity),
}

/// A unit that casts the shadow of a whole mesh.
#[derive(Clone, Copy)]
struct Caster {
    instance: InstanceId,
    object: Entity,
    unit: u32,
    record: u32,
}

/// Chooses what casts shadows; nothing without a renderer.
pub(crate) fn plugin(app: &mut App) {
    let systems = choose_casters
        .after(swap_whole_meshes)
        .after(SimulationLightSystems::UpdateDirectionalLightCascades);
    app.init_resource::<CascadeCasters>()
        .add_systems(PostUpdate, systems.in_set(FieldLodSystems::Swap));
}

type Suns<'w, 's> = Query<
    'w,
    's,
    (
        Entity,
        &'static DirectionalLight,
        &'static Cascades,
        &'static InheritedVisibility,
        Option<&'static RenderLayers>,
    ),
>;

type Objects<'w, 's> = Query<'w, 's, &'static LodObject, Without<NotShadowCaster>>;

/// Chooses for every cascade what casts shadows in it, where that or the cascade has changed.
fn choose_casters(
    mut scene: ResMut<LodScene>,
    mut casters: ResMut<CascadeCasters>,
    cameras: Query<(Entity, &ViewCut, Option<&FieldLodSettings>)>,
    suns: Suns,
    objects: Objects,
    culling: Res<GpuCulling>,
) {
    let mut wanted = Vec::new();
    // Elsewhere Bevy's lists would have them in every view.
    if culling.is_on {
        for (camera, cut, settings) in &cameras {
            let texels = settings.copied().unwrap_or_default().texels_of_casters();
            if cut.state == ViewState::Cut && texels > 0.0 {
                add_cascades(camera, cut, texels, &suns, &mut wanted);
            }
        }
    }
    casters.remove_all_but(&wanted, &mut scene);
    let changed = std::mem::take(&mut scene.casters_to_choose);
    for one in wanted {
        let cascade = casters.cascades.entry(one.key).or_default();
        // While a lens zooms, not all are chosen anew in every frame.
        let (now, before) = (one.largest_error_in_world, cascade.largest_error_in_world);
        if now == before || (0.8..1.25).contains(&(now / before)) {
            for &index in &changed {
                cascade.choose(index, &mut scene, one.cut, &objects);
            }
        } else {
            cascade.largest_error_in_world = now;
            for index in scene.indices() {
                cascade.choose(index, &mut scene, one.cut, &objects);
            }
        }
    }
}

/// A cascade in which other levels are to cast shadows.
struct WantedCascade<'a> {
    key: RetainedViewEntity,
    largest_error_in_world: f32,
    /// Of its camera.
    cut: &'a ViewCut,
}

/// Adds the cascades that a camera has of each sun.
fn add_cascades<'a>(
    camera: Entity,
    cut: &'a ViewCut,
    texels: f32,
    suns: &Suns,
    wanted: &mut Vec<WantedCascade<'a>>,
) {
    for (sun, light, cascades, is_shown, layers) in suns {
        let is_seen = is_shown.get() && layer_bits(layers) & cut.layers != 0;
        if !light.shadow_maps_enabled || !is_seen {
            continue;
        }
        let of_camera = cascades.cascades.get(&camera).into_iter().flatten();
        for (cascade, index) in of_camera.zip(0..) {
            wanted.push(WantedCascade {
                key: RetainedViewEntity::new(sun.into(), Some(camera.into()), index),
                largest_error_in_world: texels * cascade.texel_size,
                cut,
            });
        }
    }
}

impl CascadeCasters {
    fn remove_all_but(&mut self, kept: &[WantedCascade], scene: &mut LodScene) {
        let is_gone =
            |key: &RetainedViewEntity, _: &mut Cascade| kept.iter().all(|one| one.key != *key);
        for (key, cascade) in self.cascades.extract_if(is_gone) {
            for caster in cascade.drawn.values() {
                // A record of an instance that is gone may be that of another by now.
                if scene.has(caster.instance) {
                    scene.leave_unit(caster.record);
                }
            }
            self.removed.push(key);
        }
    }

    /// What changed, for the render world; `placed` are records of units that got an entity.
    pub(crate) fn take_changes(
        &mut self,
        records: &DrawRecords,
        placed: &[(u32, Entity)],
    ) -> Vec<CasterChange> {
        let removed = self.removed.drain(..);
        let mut changes: Vec<CasterChange> = removed.map(CasterChange::RemoveCascade).collect();
        for (&cascade, casters) in &mut self.cascades {
            let came = placed.iter().filter_map(|&(record, _)| {
                let caster = casters.drawn.get(&records.unit(record)?.0)?;
                (caster.record == record).then_some((*caster, true))
            });
            for (caster, is_marked) in casters.changed.drain(..).chain(came) {
                let unit = records.entity(caster.record);
                // The object casts its shadow until the unit is there.
                let object = (unit.is_some() || !is_marked).then_some(caster.object);
                let entities = unit.into_iter().chain(object);
                changes.extend(entities.map(|entity| CasterChange::Mark {
                    cascade,
                    entity: entity.into(),
                    is_marked,
                }));
            }
        }
        changes
    }
}

impl Cascade {
    /// Chooses what casts the shadow of an instance.
    fn choose(&mut self, index: u32, scene: &mut LodScene, cut: &ViewCut, objects: &Objects) {
        let instance = scene.instance(index);
        let wanted = instance.and_then(|instance| {
            let object = objects.get(instance.entity).ok()?;
            // What is too small to be drawn casts no shadow.
            if cut.visibility.contains(instance.record) {
                return None;
            }
            let unit = self.level_of(instance, object, scene)?;
            Some((instance.id, instance.entity, unit))
        });
        let id = instance.map(|instance| instance.id);
        let drawn = self.drawn.get(&index).copied();
        if wanted.map(|(id, _, unit)| (id, unit)) == drawn.map(|one| (one.instance, one.unit)) {
            return;
        }
        if let Some(caster) = drawn {
            self.drawn.remove(&index);
            // Of an instance that is gone, the records are too.
            if id == Some(caster.instance) {
                scene.leave_unit(caster.record);
                self.changed.push((caster, false));
            }
        }
        let Some((instance, object, unit)) = wanted else {
            return;
        };
        let Some(record) = scene.hold_unit(instance, unit) else {
            return;
        };
        let caster = Caster {
            instance,
            object,
            unit,
            record,
        };
        self.drawn.insert(index, caster);
        self.changed.push((caster, true));
    }

    /// The level that casts the shadow of a whole mesh; `None` if the drawn level does.
    fn level_of(
        &self,
        instance: &LodInstance,
        object: &LodObject,
        scene: &LodScene,
    ) -> Option<u32> {
        let drawn = instance.level?;
        let pieces = &instance.mesh.pieces;
        let triangles = |level: u32| pieces[level as usize].triangles;
        let saves_enough = |level: &u32| triangles(*level) + LEAST_SAVED <= triangles(drawn);
        let world_from_local = scene.scene.placement(instance.id);
        let scale = largest_scale(&world_from_local) * object.auto_lod.bias;
        let errs_less = |level: &u32| {
            pieces[*level as usize].error_in_local * scale <= self.largest_error_in_world
        };
        let coarsest_first = (0..pieces.len() as u32).rev();
        coarsest_first.take_while(saves_enough).find(errs_less)
    }
}
