//! Selects a cut for each camera.

use std::time::Duration;

use bevy::camera::primitives::Frustum;
use bevy::camera::visibility::{RenderLayers, VisibleEntities};
use bevy::ecs::query::QueryItem;
// That of the standard library panics on the web.
use bevy::platform::time::Instant;
use bevy::prelude::*;
use fieldlod_select::{LodSettings, OcclusionBuffer, Scene, View};

use crate::api::config::FieldLodConfig;
use crate::api::cut_of::FieldLodCutOf;
use crate::api::debug_options::FieldLodDebug;
use crate::api::settings::FieldLodSettings;
use crate::api::stats::FieldLodViewStats;
use crate::api::systems::FieldLodSystems;
use crate::scene::changed::ChangedOn;
use crate::scene::lod_mesh::LodObject;
use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::{ViewCut, ViewState, layer_bits};
use crate::select::shadow_lights::ShadowLights;

/// Adds a cut to every camera and selects it in each frame.
pub(crate) fn plugin(app: &mut App) {
    app.add_observer(clear_removed_view).add_systems(
        PostUpdate,
        (
            add_view_cuts
                .run_if(any_match_filter::<NewViews>)
                .in_set(FieldLodSystems::Prepare),
            (
                place_instances,
                mark_occluders.run_if(any_hides),
                select_views,
            )
                .chain()
                .in_set(FieldLodSystems::Select),
        ),
    );
}

/// 3D views that have no cut yet.
type NewViews = (
    With<Camera>,
    With<VisibleEntities>,
    Without<Camera2d>,
    Without<ViewCut>,
);

/// Gives every new 3D view a cut and its statistics.
fn add_view_cuts(mut commands: Commands, cameras: Query<Entity, NewViews>) {
    for camera in &cameras {
        commands
            .entity(camera)
            .try_insert((ViewCut::default(), FieldLodViewStats::default()));
    }
}

/// Where an object is drawn.
type Placement = (
    Entity,
    &'static GlobalTransform,
    &'static LodObject,
    &'static InheritedVisibility,
    Option<&'static RenderLayers>,
);

/// Whether some camera asks what is hidden.
fn any_hides(cameras: Query<&FieldLodSettings>) -> bool {
    cameras.iter().any(|settings| settings.visible_flux)
}

/// Tells which objects hide others: those whose material is certainly opaque. After a while without being asked, that
/// is all that has changed since.
fn mark_occluders(
    mut scene: ResMut<LodScene>,
    new: ChangedOn<LodObject>,
    changed: ChangedOn<MeshMaterial3d<StandardMaterial>, With<LodObject>>,
    objects: Query<(Entity, Option<&MeshMaterial3d<StandardMaterial>>), With<LodObject>>,
    materials: Option<Res<Assets<StandardMaterial>>>,
) {
    let scene = scene.bypass_change_detection();
    let mut entities = new.entities();
    changed.add_to(&mut entities);
    for (entity, material) in objects.iter_many(entities) {
        let material = material.and_then(|material| materials.as_ref()?.get(material));
        let is_opaque = material.is_some_and(|material| {
            material.alpha_mode == AlphaMode::Opaque && material.specular_transmission == 0.0
        });
        scene.set_occluder(entity, is_opaque);
    }
}

/// Places objects that are new or have moved in the scene that cuts are selected from.
fn place_instances(
    mut scene: ResMut<LodScene>,
    moved: ChangedOn<GlobalTransform, With<LodObject>>,
    objects: Query<Placement>,
    shown: ChangedOn<InheritedVisibility, With<LodObject>>,
    on_layers: Query<Entity, (With<LodObject>, Changed<RenderLayers>)>,
    mut removed_layers: RemovedComponents<RenderLayers>,
) {
    let drawn_layers = |is_shown: &InheritedVisibility, layers: Option<&RenderLayers>| {
        if is_shown.get() {
            layer_bits(layers)
        } else {
            0
        }
    };
    let mut placed = moved.entities();
    placed.append(&mut scene.new_objects);
    for (entity, transform, object, is_shown, layers) in objects.iter_many(placed) {
        let layers = drawn_layers(is_shown, layers);
        scene.place(entity, transform, object, layers);
    }
    // What is hidden, or on layers that no view sees, is not selected.
    let mut changed = shown.entities();
    changed.extend(on_layers.iter().chain(removed_layers.read()));
    for (entity, _, _, is_shown, layers) in objects.iter_many(changed) {
        scene.set_layers(entity, drawn_layers(is_shown, layers));
    }
}

/// What of a camera its cut depends on.
type CutView = (
    &'static Camera,
    &'static GlobalTransform,
    &'static Frustum,
    Option<&'static RenderLayers>,
    Option<&'static FieldLodSettings>,
    &'static mut ViewCut,
    &'static mut FieldLodViewStats,
);

/// Selects the cut of every active view, and applies what changed to the scene.
pub(crate) fn select_views(
    mut scene: ResMut<LodScene>,
    mut cameras: Query<CutView>,
    entities: Query<Entity, With<ViewCut>>,
    followers: Query<(Entity, &FieldLodCutOf)>,
    lights: ShadowLights,
    debug: Res<FieldLodDebug>,
    config: Res<FieldLodConfig>,
) {
    let scene = scene.bypass_change_detection();
    let cuts = cameras.iter_mut().map(|(.., cut, _)| cut.into_inner());
    let cuts = cuts.map(|cut| &mut cut.visibility);
    scene.begin_frame(cuts, config.units_per_frame);
    scene.culls = false;
    // Each view goes from its last cut to the next; only what changed reaches the scene.
    let is_follower = |entity: &Entity| followers.contains(*entity);
    let entities: Vec<Entity> = entities.iter().filter(|one| !is_follower(one)).collect();
    let mut wanted_count = 0;
    let mut views = cameras.iter_many_mut(&entities);
    while let Some(view) = views.fetch_next() {
        wanted_count += usize::from(prepare_view(view, scene, &lights, &debug));
    }
    let lods = &scene.scene;
    let select =
        |(.., mut cut, mut stats): QueryItem<CutView>| select_cut(&mut cut, &mut stats, lods);
    // Several at once, each on its own.
    if wanted_count > 1 {
        cameras.par_iter_mut().for_each(select);
    } else {
        cameras.iter_mut().for_each(select);
    }
    let mut views = cameras.iter_many_mut(&entities);
    while let Some((.., mut cut, mut stats)) = views.fetch_next() {
        apply_cut(&mut cut, &mut stats, scene);
    }
    // Then those that draw the cut of another.
    for (camera, &FieldLodCutOf(leader)) in &followers {
        if let Ok([(.., lead, lead_stats), (viewed, .., mut cut, mut stats)]) =
            cameras.get_many_mut([leader, camera])
            && drawn_px(viewed).is_some()
            && follow(leader, &lead, &mut cut, scene)
        {
            stats.error_px = lead_stats.error_px;
            stats.occluder_triangles = 0;
            stats.selection_time = Duration::ZERO;
        } else if let Ok(view) = cameras.get_mut(camera) {
            prepare_view(view, scene, &lights, &debug);
            if let Ok((.., mut cut, mut stats)) = cameras.get_mut(camera) {
                select_cut(&mut cut, &mut stats, &scene.scene);
                apply_cut(&mut cut, &mut stats, scene);
            }
        }
    }
}

/// Finds out what a view is to select. Whether that is anything.
fn prepare_view(
    (camera, pose, frustum, layers, settings, mut cut, _): QueryItem<CutView>,
    scene: &mut LodScene,
    lights: &ShadowLights,
    debug: &FieldLodDebug,
) -> bool {
    let settings = settings.copied().unwrap_or_default();
    let (state, view) = desired_view(camera, pose, &settings, scene.coarsening.is_some());
    // What was drawn in another state, or as another camera does, is drawn no longer.
    if cut.state != state || cut.leader.is_some() {
        cut.state = state;
        clear_cut(&mut cut, scene);
    }
    // What casts shadows into the image counts, seen or not.
    let layers = layer_bits(layers);
    let lit = lights.lit_by(frustum, layers);
    set_layers(&mut cut, layers | lit.layers, scene);
    cut.wanted = view.map(|view| {
        // A frozen view selects from where it was.
        let view = cut.view.filter(|_| debug.freeze).unwrap_or(view);
        let view = view.with_layers(cut.layers).with_shadow_lights(&lit.lights);
        let settings = lod_settings(&settings, lit.layers != 0, scene.coarsening);
        scene.culls |= settings.cull_below_px.is_some();
        if settings.displacement_px.is_some() {
            warn_of_unmeasured(scene);
        }
        (view, settings)
    });
    cut.wanted.is_some()
}

fn warn_of_unmeasured(scene: &mut LodScene) {
    for mesh in scene.unmeasured.drain(..) {
        warn!(
            "{mesh} is drawn in full where `displacement_px` is asked for: how far its levels \
             deviate was not measured"
        );
    }
}

/// What selection reads. `coarsening` is by how much errors count for less where meshes are read in parts: there,
/// what is beside the view is kept for when that turns.
fn lod_settings(
    settings: &FieldLodSettings,
    has_shadows: bool,
    coarsening: Option<f32>,
) -> LodSettings {
    let settings = settings.to_lod_settings(has_shadows || coarsening.is_some());
    let coarser = |px: f32| px * coarsening.unwrap_or(1.0);
    LodSettings {
        error_px: settings.error_px.map(coarser),
        displacement_px: settings.displacement_px.map(coarser),
        ..settings
    }
}

/// Lets a camera draw the cut that was selected for another; whether that has one.
fn follow(leader: Entity, lead: &ViewCut, cut: &mut ViewCut, scene: &mut LodScene) -> bool {
    if lead.state != ViewState::Cut || lead.leader.is_some() {
        return false;
    }
    let following = Some((leader, lead.clear_count));
    let is_new = cut.leader != following;
    if is_new {
        clear_cut(cut, scene);
        (cut.leader, cut.state) = (following, ViewState::Cut);
    }
    set_layers(cut, lead.layers, scene);
    let ViewCut {
        visibility,
        deferred,
        ..
    } = cut;
    if is_new {
        scene.apply_whole_cut(&lead.selector, visibility, deferred);
    } else {
        for change in lead.selector.changes() {
            scene.apply_change(&change, visibility, deferred);
        }
    }
    scene.advance_deferred(&lead.selector, visibility, deferred);
    true
}

fn set_layers(cut: &mut ViewCut, layers: u64, scene: &mut LodScene) {
    if cut.layers != layers {
        cut.layers = layers;
        scene.swap_all_whole_meshes();
    }
}

/// What a camera should draw, and from where if it is a cut.
fn desired_view(
    camera: &Camera,
    pose: &GlobalTransform,
    settings: &FieldLodSettings,
    is_streaming: bool,
) -> (ViewState, Option<View>) {
    let Some(viewport_px) = drawn_px(camera) else {
        return (ViewState::Inactive, None);
    };
    // Of what is read in parts there is no source to draw, but a cut of the same triangles.
    let wants_cut = settings.forced_level != Some(0) || is_streaming;
    let view = wants_cut.then(|| view_of(camera, viewport_px, pose));
    match view.flatten() {
        Some(view) => (ViewState::Cut, Some(view)),
        None => (ViewState::FullDetail, None),
    }
}

/// The size of the image that a camera draws; `None` if it draws none, as while its window is minimised
/// or its target is not loaded.
pub(crate) fn drawn_px(camera: &Camera) -> Option<UVec2> {
    let target_px = camera.physical_target_size()?;
    let viewport_px = camera.physical_viewport_size()?;
    let is_drawn = camera.is_active && target_px.min(viewport_px).min_element() > 0;
    is_drawn.then_some(viewport_px)
}

/// The view of a camera; `None` for projections that the field has no formula for.
fn view_of(camera: &Camera, viewport_px: UVec2, pose: &GlobalTransform) -> Option<View> {
    let viewport_px = viewport_px.as_vec2();
    match camera_field::Camera::from_projection(&camera.clip_from_view(), viewport_px) {
        Ok(intrinsics) => Some(View::new(intrinsics, &pose.affine())),
        Err(error) => {
            warn_once!("a camera draws full detail: {error}");
            None
        }
    }
}

/// Selects what is wanted of a view.
fn select_cut(cut: &mut ViewCut, stats: &mut FieldLodViewStats, scene: &Scene) {
    let Some((view, settings)) = cut.wanted else {
        return;
    };
    let start = Instant::now();
    cut.view = Some(view);
    cut.selector.select(scene, &view, &settings);
    stats.selection_time = start.elapsed();
}

/// Draws what was selected.
fn apply_cut(cut: &mut ViewCut, stats: &mut FieldLodViewStats, scene: &mut LodScene) {
    let start = Instant::now();
    if cut.wanted.take().is_some() {
        for change in cut.selector.changes() {
            scene.apply_change(&change, &mut cut.visibility, &mut cut.deferred);
        }
        scene.advance_deferred(&cut.selector, &mut cut.visibility, &mut cut.deferred);
    } else {
        stats.selection_time = Duration::ZERO;
    }
    stats.error_px = cut.selector.threshold_px().unwrap_or(0.0);
    let occlusion = cut.selector.occlusion();
    stats.occluder_triangles = occlusion.map_or(0, OcclusionBuffer::cost_in_triangles);
    stats.selection_time += start.elapsed();
}

fn clear_cut(cut: &mut ViewCut, scene: &mut LodScene) {
    scene.clear_view(&mut cut.visibility, &mut cut.deferred);
    cut.selector.clear();
    cut.view = None;
    cut.leader = None;
    cut.clear_count = cut.clear_count.wrapping_add(1);
}

/// Clears the cut of a camera that is removed.
fn clear_removed_view(
    removal: On<Remove, ViewCut>,
    mut views: Query<&mut ViewCut>,
    mut scene: ResMut<LodScene>,
) {
    if let Ok(mut cut) = views.get_mut(removal.entity) {
        clear_cut(&mut cut, &mut scene);
    }
}
