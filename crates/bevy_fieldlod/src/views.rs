//! Each view has a cut of its own: selection.

use bevy::camera::Camera;
use bevy::camera::visibility::{RenderLayers, VisibleEntities};
use bevy::ecs::system::SystemParam;
// That of the standard library panics on the web.
use bevy::platform::time::Instant;
use bevy::prelude::*;
use fieldlod_select::{LodSettings, Selector, View};

use crate::marks::{NO_LEVEL, ViewMarks};
use crate::objects::LodObject;
use crate::world::{Drawn, LodWorld};
use crate::{FieldLodDebug, FieldLodSettings, FieldLodViewStats};

/// The cuts of one camera.
#[derive(Component, Default)]
pub(crate) struct ViewCuts {
    selector: Selector,
    pub(crate) marks: ViewMarks,
    /// What was selected for last.
    pub(crate) view: Option<View>,
    pub(crate) state: ViewState,
}

/// What a view draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ViewState {
    /// Nothing: the camera is not active.
    #[default]
    Idle,
    /// The source meshes.
    Full,
    /// Its cuts.
    Cuts,
}

/// 3D views that have no cuts yet.
type NewViews = (
    With<Camera>,
    With<VisibleEntities>,
    Without<Camera2d>,
    Without<ViewCuts>,
);

/// Whether there are any.
pub(crate) fn any_new(cameras: Query<(), NewViews>) -> bool {
    !cameras.is_empty()
}

/// Gives every 3D view the components that hold its cuts and its numbers.
pub(crate) fn add_view_components(mut commands: Commands, cameras: Query<Entity, NewViews>) {
    for camera in &cameras {
        commands
            .entity(camera)
            .insert((ViewCuts::default(), FieldLodViewStats::default()));
    }
}

/// Takes entities that came or moved into the scene.
pub(crate) fn place_instances(
    mut world: ResMut<LodWorld>,
    moved: Query<(Entity, &GlobalTransform, &LodObject), Changed<GlobalTransform>>,
    objects: Query<(Entity, &GlobalTransform, &LodObject)>,
) {
    let came = std::mem::take(&mut world.came);
    for (entity, transform, object) in moved.iter().chain(objects.iter_many(came)) {
        world.place(entity, transform, &object.mesh, object.bias);
    }
}

/// The lights of the world.
#[derive(SystemParam)]
pub(crate) struct Lights<'w, 's> {
    directional: Query<'w, 's, &'static DirectionalLight>,
    point: Query<'w, 's, &'static PointLight>,
    spot: Query<'w, 's, &'static SpotLight>,
}

impl Lights<'_, '_> {
    /// Whether any of them casts shadows.
    fn cast(&self) -> bool {
        self.directional
            .iter()
            .any(|light| light.shadow_maps_enabled)
            || self.point.iter().any(|light| light.shadow_maps_enabled)
            || self.spot.iter().any(|light| light.shadow_maps_enabled)
    }
}

/// Selects the cuts of every active view.
pub(crate) fn select_views(
    mut world: ResMut<LodWorld>,
    mut cameras: Query<(
        &Camera,
        &GlobalTransform,
        Option<&FieldLodSettings>,
        &mut ViewCuts,
        &mut FieldLodViewStats,
    )>,
    changed_layers: Query<(), (Changed<RenderLayers>, Or<(With<ViewCuts>, With<LodObject>)>)>,
    mut removed_layers: RemovedComponents<RenderLayers>,
    lights: Lights,
    debug: Res<FieldLodDebug>,
) {
    let casts = lights.cast();
    let world = &mut *world;
    world.begin_frame(
        cameras
            .iter_mut()
            .map(|(_, _, _, cuts, _)| cuts.into_inner()),
    );
    for (camera, pose, settings, mut cuts, mut stats) in &mut cameras {
        let start = Instant::now();
        let settings = settings.copied().unwrap_or_default();
        let (state, view) = wish(camera, pose, &settings);
        let frozen = cuts.view.filter(|_| debug.freeze);
        cuts.follow(world, state, frozen.or(view), &settings.selection(casts));
        stats.error_px = cuts.selector.error_px().unwrap_or(0.0);
        stats.selection_time = start.elapsed();
    }
    if !changed_layers.is_empty() || removed_layers.read().count() > 0 {
        world.stir_chains();
    }
}

/// What a camera should draw.
fn wish(
    camera: &Camera,
    pose: &GlobalTransform,
    settings: &FieldLodSettings,
) -> (ViewState, Option<View>) {
    if !camera.is_active {
        return (ViewState::Idle, None);
    }
    let view = (!settings.full_detail)
        .then(|| view_of(camera, pose))
        .flatten();
    match view {
        Some(view) => (ViewState::Cuts, Some(view)),
        None => (ViewState::Full, None),
    }
}

impl ViewCuts {
    fn follow(
        &mut self,
        world: &mut LodWorld,
        state: ViewState,
        view: Option<View>,
        settings: &LodSettings,
    ) {
        if self.state != state {
            self.state = state;
            self.release(world);
            // One that draws everything in full has a say in the chains' levels.
            world.stir_chains();
        }
        let (ViewState::Cuts, Some(view)) = (state, view) else {
            return;
        };
        self.view = Some(view);
        self.selector.select(&world.scene, &view, settings);
        for change in self.selector.changes() {
            world.apply(&change, &mut self.marks);
        }
    }

    /// Gives back everything.
    pub(crate) fn release(&mut self, world: &mut LodWorld) {
        world.drop_view(&mut self.marks);
        self.selector.clear();
        self.view = None;
    }

    /// The level that this view asks of a chain; `None` if it has no say.
    fn level(&self, instance: u32) -> Option<u32> {
        match self.state {
            ViewState::Idle => None,
            ViewState::Full => Some(0),
            ViewState::Cuts => match self.marks.level(instance) {
                NO_LEVEL => None,
                level => Some(u32::from(level)),
            },
        }
    }
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

/// Gives chains the mesh of the finest level that a view which sees them asks for.
pub(crate) fn exchange_levels(
    mut world: ResMut<LodWorld>,
    views: Query<(&ViewCuts, Option<&RenderLayers>)>,
    mut meshes: Query<(&mut Mesh3d, &LodObject, Option<&RenderLayers>)>,
) {
    let restless = std::mem::take(&mut world.restless);
    for &index in &restless {
        let Some(instance) = world.instance(index) else {
            continue;
        };
        let Drawn::Chain { level: worn } = instance.drawn else {
            continue;
        };
        let Ok((mut mesh, object, layers)) = meshes.get_mut(instance.entity) else {
            continue;
        };
        let layers = layers.unwrap_or_default();
        let seeing = views
            .iter()
            .filter(|(_, view)| view.unwrap_or_default().intersects(layers));
        let level = seeing.filter_map(|(cuts, _)| cuts.level(index)).min();
        if let Some(level) = level.filter(|&level| level != worn) {
            mesh.0 = object.piece(level).clone();
            world.set_level(index, level);
        }
    }
    // The storage is worth keeping.
    world.restless = restless;
    world.restless.clear();
}

/// A camera that is gone draws nothing any more.
pub(crate) fn release_view(
    removal: On<Remove, ViewCuts>,
    mut views: Query<&mut ViewCuts>,
    mut world: ResMut<LodWorld>,
) {
    if let Ok(mut cuts) = views.get_mut(removal.entity) {
        cuts.release(&mut world);
    }
}
