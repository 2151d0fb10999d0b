//! The camera, and its twin for the split screen.

use bevy::camera::{RenderTarget, ShadowLodOrigin, Viewport};
use bevy::core_pipeline::prepass::DepthPrepass;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use bevy::render::occlusion_culling::OcclusionCulling;
use bevy_fieldlod::prelude::*;

use crate::quality::Quality;

/// The camera that draws levels of detail.
#[derive(Component)]
pub(crate) struct MainCamera;

/// The camera that draws the right half at full detail when the screen is split.
#[derive(Component)]
pub(crate) struct FullDetailCamera;

/// How the scene is drawn; keys change it.
#[derive(Resource, Clone, Copy, Debug)]
pub(crate) struct ViewOptions {
    /// Largest screen-space error, in physical pixels.
    pub(crate) error_px: f32,
    /// How much errors count of what only casts shadows.
    pub(crate) shadow_bias: f32,
    /// Margin around the image that is drawn as finely, as a share of its size.
    pub(crate) offscreen_margin: f32,
    /// Whether errors count by how much of a thing nothing hides.
    pub(crate) visible_flux: bool,
    /// Whether the GPU leaves out what is wholly hidden.
    pub(crate) occlusion_culling: bool,
    /// Whether the right half shows full detail.
    pub(crate) split: bool,
    /// Whether everything is drawn as Bevy draws it without the plugin.
    pub(crate) plain: bool,
    /// Whether the moon and the lamps shine, not the sun.
    pub(crate) night: bool,
}

/// Where the cameras draw to.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct CameraTarget(pub(crate) RenderTarget);

/// Adds both cameras. Move the main one: the other follows.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(PreStartup, spawn).add_systems(
        PostUpdate,
        (follow, apply_options).before(TransformSystems::Propagate),
    );
}

/// A place below the ground with a view further down: where a camera waits without drawing.
pub(crate) fn seeing_nothing() -> Transform {
    Transform::from_xyz(0.0, -500.0, 0.0).looking_to(Vec3::NEG_Y, Vec3::X)
}

/// Sets the vertical field of view.
pub(crate) fn zoom(projection: &mut Projection, fov_in_rad: f32) {
    if let Projection::Perspective(perspective) = projection {
        perspective.fov = fov_in_rad;
    }
}

fn spawn(
    mut commands: Commands,
    target: Res<CameraTarget>,
    quality: Res<Quality>,
    options: Res<ViewOptions>,
) {
    // The camera of pictures is off until it is placed: meanwhile baking gets the processor.
    let is_active = matches!(target.0, RenderTarget::Window(_));
    let lod = FieldLodSettings::default();
    let full_detail = FieldLodSettings {
        forced_level: Some(0),
        ..lod
    };
    let main = (MainCamera, IsDefaultUiCamera, ShadowLodOrigin, lod);
    let mut main = commands.spawn((camera(0, is_active, &target, &quality), main));
    if options.occlusion_culling {
        main.insert((DepthPrepass, OcclusionCulling));
    }
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
            far: 2000.0,
            ..default()
        }),
        quality.msaa,
        quality.shadow_filter,
        Tonemapping::AcesFitted,
        seeing_nothing(),
    )
}

fn follow(
    main: Single<(&Transform, &Projection), With<MainCamera>>,
    twin: Single<(&mut Transform, &mut Projection), (With<FullDetailCamera>, Without<MainCamera>)>,
) {
    let (mut place, mut projection) = twin.into_inner();
    place.set_if_neq(*main.0);
    // The aspect ratio stays the twin's own.
    if let Projection::Perspective(main) = main.1 {
        zoom(&mut projection, main.fov);
    }
}

/// Brings viewports and thresholds in line with [`ViewOptions`] and with the size of the target.
fn apply_options(
    mut commands: Commands,
    options: Res<ViewOptions>,
    main: Single<(Entity, &mut Camera, &mut FieldLodSettings), With<MainCamera>>,
    twin: Single<&mut Camera, (With<FullDetailCamera>, Without<MainCamera>)>,
) {
    let (entity, mut main, mut settings) = main.into_inner();
    let mut twin = twin.into_inner();
    settings.error_px = Some(options.error_px);
    settings.shadow_bias = options.shadow_bias;
    settings.offscreen_margin = options.offscreen_margin;
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
