//! Selects a cut for each camera.

use std::time::Duration;

use bevy::camera::RenderTarget;
use bevy::camera::primitives::Frustum;
use bevy::camera::visibility::{RenderLayers, VisibilityRange, VisibleEntities};
use bevy::ecs::change_detection::ContiguousRef;
use bevy::ecs::entity_disabling::Disabled;
use bevy::ecs::query::{Allow, QueryItem};
use bevy::mesh::skinning::SkinnedMesh;
// `std::time::Instant` panics on the web.
use bevy::platform::time::Instant;
use bevy::prelude::*;
use fieldlod_select::{Scene, View};

use crate::api::settings::FieldLodCamera;
use crate::api::stats::FieldLodViewStats;
use crate::api::systems::FieldLodSystems;
use crate::compat::OnRemove;
use crate::scene::changed::{ChangedOn, for_each_changed};
use crate::scene::lod_mesh::{LodObject, LodPlacement};
use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::{ViewCut, ViewState, layer_bits};
use crate::select::drawn_layers::{DrawnLayers, Placement};
use crate::select::shadow_lights::ShadowLights;
use crate::select::skins::SkinPoses;

/// The steps of [`FieldLodSystems::Select`].
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum SelectSteps {
    /// Updates the scene and [`ViewCut::wanted`].
    Prepare,
    /// Opt-in features set [`ViewCut::weigher`] here.
    Adjust,
    /// Selects the cuts and applies them to the scene.
    Select,
    /// Opt-in features read the new cuts here.
    Read,
}

/// Adds a cut to every camera and selects it in each frame.
pub(crate) fn plugin(app: &mut App) {
    use SelectSteps::{Adjust, Prepare, Read, Select};
    let any_new = |scene: Res<LodScene>| !scene.new_objects.is_empty();
    app.add_observer(clear_removed_view)
        .configure_sets(
            PostUpdate,
            (Prepare, Adjust, Select, Read)
                .chain()
                .in_set(FieldLodSystems::Select),
        )
        .add_systems(
            PostUpdate,
            (
                // In an earlier phase: commands insert and remove cuts, and must be applied before selection.
                track_views.in_set(FieldLodSystems::Prepare),
                // `begin_frame` updates the bounds of the scene after all changes.
                (
                    add_instances.run_if(any_new),
                    move_instances,
                    update_layers,
                    begin_frame,
                    prepare_views,
                )
                    .chain()
                    .in_set(Prepare),
                select_views.in_set(Select),
            ),
        );
}

/// Everything that Bevy and selection need of a 3D camera. An entity that lacks some of it draws nothing.
type IsView = (
    With<Camera>,
    With<RenderTarget>,
    With<GlobalTransform>,
    With<Frustum>,
    With<VisibleEntities>,
    Without<Camera2d>,
);

/// Entities that have or had a cut, enabled or not.
type HadCut = (With<ViewCut>, Allow<Disabled>);

/// Adds a cut and statistics to every new 3D view, and removes them from entities that are no longer views. Without the
/// removal, the units and levels of the last cut would stay in use, and the selector would keep ids that the scene gives
/// to other meshes.
fn track_views(
    mut commands: Commands,
    new: Query<Entity, (IsView, Or<(Without<ViewCut>, Without<FieldLodViewStats>)>)>,
    cuts: Query<Entity, HadCut>,
    views: Query<(), IsView>,
) {
    for view in &new {
        commands
            .entity(view)
            .try_insert_if_new((ViewCut::default(), FieldLodViewStats::default()));
    }
    for lost in cuts.iter().filter(|&entity| !views.contains(entity)) {
        commands
            .entity(lost)
            .try_remove::<(ViewCut, FieldLodViewStats)>();
    }
}

/// Adds new objects to the scene.
fn add_instances(
    mut scene: ResMut<LodScene>,
    mut objects: Query<(Placement, &mut LodPlacement)>,
    skins: SkinPoses,
    drawn_layers: DrawnLayers,
) {
    let new = std::mem::take(&mut scene.new_objects);
    for entity in new {
        let Ok((object, mut placement)) = objects.get_mut(entity) else {
            continue;
        };
        let (_, transform, lod, ..) = object;
        let world_from_local = skins.world_from_local(entity);
        let world_from_local = world_from_local.unwrap_or_else(|| transform.affine());
        let layers = drawn_layers.of(&object);
        placement.0 = Some(scene.add(entity, world_from_local, lod, layers));
    }
}

/// The transforms of objects without a skin. All components are in tables, so that whole columns can be read.
type Moving<'w, 's> = Query<
    'w,
    's,
    (Ref<'static, GlobalTransform>, &'static LodPlacement),
    (With<LodObject>, Without<SkinnedMesh>),
>;

/// Moves the instances of objects that have moved.
fn move_instances(
    mut scene: ResMut<LodScene>,
    moving: Moving,
    skins: SkinPoses,
    mut removed_skins: RemovedComponents<SkinnedMesh>,
    objects: Query<(&GlobalTransform, &LodPlacement)>,
) {
    for (transforms, placements) in moving.contiguous_iter().into_iter().flatten() {
        let (transforms, ticks) = ContiguousRef::split(transforms);
        for_each_changed(&ticks, |index| {
            if let LodPlacement(Some(id)) = placements[index] {
                scene.set_placement(id, transforms[index].affine());
            }
        });
    }
    for entity in skins.moved().chain(removed_skins.read()) {
        if let Ok((transform, LodPlacement(Some(id)))) = objects.get(entity) {
            let world_from_local = skins.world_from_local(entity);
            scene.set_placement(*id, world_from_local.unwrap_or_else(|| transform.affine()));
        }
    }
}

/// Updates the layers of objects. Selection skips hidden objects and those on layers that no view sees.
fn update_layers(
    mut scene: ResMut<LodScene>,
    objects: Query<Placement>,
    shown: ChangedOn<InheritedVisibility, With<LodObject>>,
    on_layers: Query<Entity, (With<LodObject>, Changed<RenderLayers>)>,
    in_ranges: Query<Entity, (With<LodObject>, With<VisibilityRange>)>,
    mut removed_layers: RemovedComponents<RenderLayers>,
    mut removed_ranges: RemovedComponents<VisibilityRange>,
    drawn_layers: DrawnLayers,
) {
    let mut changed = shown.entities();
    changed.extend(on_layers.iter().chain(removed_layers.read()));
    // Any camera may have moved.
    changed.extend(in_ranges.iter().chain(removed_ranges.read()));
    for object in changed
        .into_iter()
        .filter_map(|entity| objects.get(entity).ok())
    {
        scene.set_layers(object.0, drawn_layers.of(&object));
    }
}

/// Camera properties that affect selection.
type CameraInputs = (
    &'static Camera,
    &'static GlobalTransform,
    &'static Frustum,
    Option<&'static RenderLayers>,
    Option<&'static FieldLodCamera>,
    &'static mut ViewCut,
);

/// Frees unused meshes and records, and updates the scene.
fn begin_frame(mut scene: ResMut<LodScene>, mut cuts: Query<&mut ViewCut, Allow<Disabled>>) {
    // All cuts, also those of entities that `track_views` removes in the next frame.
    let cuts = cuts.iter_mut().map(Mut::into_inner);
    scene.begin_frame(cuts.map(|cut| &mut cut.visibility));
}

/// Updates the selection inputs of every view.
fn prepare_views(
    mut scene: ResMut<LodScene>,
    mut cameras: Query<CameraInputs>,
    lights: ShadowLights,
) {
    for view in &mut cameras {
        prepare_view(view, &mut scene, &lights);
    }
}

fn prepare_view(
    (camera, pose, frustum, layers, settings, mut cut): QueryItem<CameraInputs>,
    scene: &mut LodScene,
    lights: &ShadowLights,
) {
    let settings = settings.copied().unwrap_or_default();
    let (state, view) = desired_view(camera, pose, &settings, scene.has_incomplete_sources);
    // The other state draws other entities, and the hysteresis must not depend on an old cut.
    if cut.state != state {
        cut.state = state;
        clear_cut(&mut cut, scene);
    }
    // Objects that cast shadows into the image are selected even if the camera does not see them.
    let layers = layer_bits(layers);
    let lit = lights.lit_by(frustum, layers);
    let layers = layers | lit.layers;
    // Views without a cut report no changes, but their layers decide which whole meshes they draw.
    if cut.layers != layers {
        cut.layers = layers;
        scene.swap_all_whole_meshes();
    }
    cut.wanted = view.map(|view| {
        let view = view.with_layers(layers).with_shadow_lights(&lit.lights);
        (view, settings.to_lod_settings(lit.layers != 0))
    });
}

/// How a camera should draw, and the view to select for.
fn desired_view(
    camera: &Camera,
    pose: &GlobalTransform,
    settings: &FieldLodCamera,
    has_incomplete_sources: bool,
) -> (ViewState, Option<View>) {
    let Some(viewport_px) = drawn_px(camera) else {
        return (ViewState::Inactive, None);
    };
    // A source of a streamed mesh is its coarsest level: full detail is a cut at level 0.
    let wants_cut = settings.forced_level != Some(0) || has_incomplete_sources;
    let view = wants_cut.then(|| view_of(camera, viewport_px, pose));
    match view.flatten() {
        Some(view) => (ViewState::Cut, Some(view)),
        None => (ViewState::FullDetail, None),
    }
}

/// The size of the image that a camera draws. `None` if it draws nothing: it is inactive, its window is minimised
/// or its target is not loaded.
fn drawn_px(camera: &Camera) -> Option<UVec2> {
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
            warn_once!("could not select for a camera: {error}; drawing full detail");
            None
        }
    }
}

/// Selects the cut of every view and applies it to the scene.
fn select_views(
    mut scene: ResMut<LodScene>,
    mut cameras: Query<(&mut ViewCut, Option<&mut FieldLodViewStats>), Allow<Disabled>>,
) {
    let lods = &scene.scene;
    let wanted = cameras.iter().filter(|(cut, _)| cut.wanted.is_some());
    // For one view, threads of the pool only cost time.
    let has_several = wanted.count() > 1;
    let select = |(mut cut, stats): (Mut<ViewCut>, Option<Mut<FieldLodViewStats>>)| {
        let time = select_cut(&mut cut, lods);
        if let Some(mut stats) = stats {
            stats.selection_time = time;
        }
    };
    if has_several {
        cameras.par_iter_mut().for_each(select);
    } else {
        cameras.iter_mut().for_each(select);
    }
    for (mut cut, stats) in &mut cameras {
        // In turn: the records of units count the views that draw them.
        let start = Instant::now();
        apply_cut(&mut cut, &mut scene);
        if let Some(mut stats) = stats {
            stats.selection_time += start.elapsed();
            update_stats(&mut stats, &cut, &scene);
        }
    }
}

/// Selects the cut of a view, and returns how long that took.
fn select_cut(cut: &mut ViewCut, scene: &Scene) -> Duration {
    let Some((view, settings)) = cut.wanted else {
        return Duration::ZERO;
    };
    let start = Instant::now();
    cut.view = Some(view);
    match &mut cut.weigher {
        Some(select_weighed) => select_weighed(&mut cut.selector, scene, &view, &settings),
        None => cut.selector.select(scene, &view, &settings),
    }
    start.elapsed()
}

/// Applies the changes of a cut to the scene.
fn apply_cut(cut: &mut ViewCut, scene: &mut LodScene) {
    if cut.wanted.take().is_some() {
        scene.apply_changes(cut);
    } else if cut.state == ViewState::Cut {
        // It lost a component in this frame. A selector that skips a frame would miss the removal of a mesh.
        cut.state = ViewState::Inactive;
        clear_cut(cut, scene);
    }
}

/// Updates the statistics of a view.
fn update_stats(stats: &mut FieldLodViewStats, cut: &ViewCut, scene: &LodScene) {
    if cut.state == ViewState::Inactive {
        *stats = default();
        return;
    }
    stats.error_px = cut.selector.threshold_px().unwrap_or(0.0);
    stats.triangles_full = scene.full_triangles(cut.layers);
    (stats.triangles_drawn, stats.units_drawn) = match cut.state {
        ViewState::Cut => (cut.selector.triangle_count(), cut.unit_count),
        _ => (stats.triangles_full, 0),
    };
}

fn clear_cut(cut: &mut ViewCut, scene: &mut LodScene) {
    scene.clear_view(cut);
    cut.selector.clear();
    cut.view = None;
}

/// Clears the cut of a camera that is removed.
fn clear_removed_view(
    removal: OnRemove<ViewCut>,
    mut views: Query<&mut ViewCut, Allow<Disabled>>,
    mut scene: ResMut<LodScene>,
) {
    if let Ok(mut cut) = views.get_mut(removal.entity) {
        clear_cut(&mut cut, &mut scene);
    }
}
