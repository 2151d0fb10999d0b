//! The camera, and a second one for the split screen.

pub(crate) mod flight;
pub(crate) mod path;

use bevy::camera::{RenderTarget, ShadowLodOrigin, Viewport};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use crate::quality::Quality;

/// The camera that draws levels of detail.
#[derive(Component)]
pub(crate) struct MainCamera;

/// The camera that draws the right half at full detail when the screen is split.
#[derive(Component)]
pub(crate) struct FullDetailCamera;

/// Options of the picture. Keys change error and split.
#[derive(Resource, Clone, Copy, Debug)]
pub(crate) struct ViewOptions {
    /// Largest screen-space error, in physical pixels.
    pub(crate) error_px: f32,
    /// Whether objects that are hidden or half hidden are drawn with fewer triangles.
    pub(crate) visible_flux: bool,
    /// Whether the right half shows full detail.
    pub(crate) split: bool,
    /// Whether everything is drawn at full detail, without the plugin.
    pub(crate) plain: bool,
}

/// The target of the cameras.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct CameraTarget(pub(crate) RenderTarget);

/// Adds both cameras. The second one follows the main one.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(PreStartup, spawn).add_systems(
        PostUpdate,
        (follow, apply_options).before(TransformSystems::Propagate),
    );
}

/// A pose below the ground that looks down, from which only the sky is visible. A camera waits there.
pub(crate) fn pose_below_ground() -> Transform {
    Transform::from_xyz(0.0, -500.0, 0.0).looking_to(Vec3::NEG_Y, Vec3::X)
}

/// Sets the vertical field of view.
pub(crate) fn zoom(projection: &mut Projection, fov_in_rad: f32) {
    if let Projection::Perspective(perspective) = projection {
        perspective.fov = fov_in_rad;
    }
}

fn spawn(mut commands: Commands, target: Res<CameraTarget>, quality: Res<Quality>) {
    // A camera that renders pictures is inactive until it is placed, so that the bake gets all cores.
    let is_active = matches!(target.0, RenderTarget::Window(_));
    let lod = FieldLodCamera::default();
    let mut full_detail = lod;
    full_detail.forced_level = Some(0);
    let main = (MainCamera, IsDefaultUiCamera, ShadowLodOrigin, lod);
    commands.spawn((camera(0, is_active, &target, &quality), main));
    let twin = (FullDetailCamera, full_detail);
    commands.spawn((camera(1, false, &target, &quality), twin));
}

fn camera(order: isize, is_active: bool, target: &CameraTarget, quality: &Quality) -> impl Bundle {
    (
        Camera3d::default(),
        Camera {
            order,
            is_active,
            ..default()
        },
        target.0.clone(),
        Projection::Perspective(PerspectiveProjection {
            near: 0.1,
            // The sky is a sphere with a radius of 900 m.
            far: 2000.0,
            ..default()
        }),
        quality.msaa,
        quality.shadow_filter,
        Tonemapping::AcesFitted,
        pose_below_ground(),
    )
}

fn follow(
    main: Single<(&Transform, &Projection), With<MainCamera>>,
    twin: Single<(&mut Transform, &mut Projection), (With<FullDetailCamera>, Without<MainCamera>)>,
) {
    let (mut place, mut projection) = twin.into_inner();
    place.set_if_neq(*main.0);
    // Only the field of view is copied: the second camera has another aspect ratio.
    if let Projection::Perspective(main) = main.1 {
        zoom(&mut projection, main.fov);
    }
}

/// Applies [`ViewOptions`] to viewports and thresholds.
fn apply_options(
    mut commands: Commands,
    options: Res<ViewOptions>,
    main: Single<(Entity, &mut Camera, &mut FieldLodCamera), With<MainCamera>>,
    twin: Single<&mut Camera, (With<FullDetailCamera>, Without<MainCamera>)>,
) {
    let (entity, mut main, mut settings) = main.into_inner();
    let mut twin = twin.into_inner();
    settings.error_px = Some(options.error_px);
    if options.visible_flux {
        commands.entity(entity).insert(FieldLodVisibleFlux);
    } else {
        commands.entity(entity).remove::<FieldLodVisibleFlux>();
    }
    twin.is_active = options.split && main.is_active;
    let Some(size) = main.physical_target_size() else {
        return;
    };
    if options.split && size.x > 1 {
        let middle = size.x / 2;
        main.viewport = Some(viewport(0, middle, size.y));
        twin.viewport = Some(viewport(middle, size.x - middle, size.y));
    } else {
        main.viewport = None;
    }
}

fn viewport(left: u32, width: u32, height: u32) -> Viewport {
    Viewport {
        physical_position: UVec2::new(left, 0),
        physical_size: UVec2::new(width, height),
        ..default()
    }
}
