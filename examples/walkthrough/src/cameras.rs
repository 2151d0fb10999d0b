//! The camera, and its twin for the split screen.

use bevy::camera::{RenderTarget, Viewport};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::light::EnvironmentMapLight;
use bevy::pbr::{DistanceFog, FogFalloff};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use crate::sky;

/// Vertical field of view.
pub(crate) const FIELD_OF_VIEW_IN_RAD: f32 = 0.95;
/// Distance of the near plane.
pub(crate) const NEAR_IN_M: f32 = 0.1;

/// The camera that draws levels of detail.
#[derive(Component)]
pub(crate) struct MainCamera;

/// The camera that draws the right half at full detail when the screen is split.
#[derive(Component)]
pub(crate) struct FullDetailCamera;

/// How the scene is looked at; keys change it.
#[derive(Resource, Clone, Copy, Debug)]
pub(crate) struct Look {
    /// Largest screen-space error, in physical pixels.
    pub(crate) error_px: f32,
    /// Whether the right half shows full detail.
    pub(crate) split: bool,
}

/// Where the cameras draw to; `None` is the window.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct CameraTarget(pub(crate) Option<RenderTarget>);

/// Adds both cameras. Move the main one: the other follows.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(PreStartup, spawn).add_systems(
        PostUpdate,
        (follow, apply_look).before(TransformSystems::Propagate),
    );
}

/// A place below the ground with a view further down: where a camera waits without drawing.
pub(crate) fn seeing_nothing() -> Transform {
    Transform::from_xyz(0.0, -500.0, 0.0).looking_to(Vec3::NEG_Y, Vec3::X)
}

fn spawn(mut commands: Commands, mut images: ResMut<Assets<Image>>, target: Res<CameraTarget>) {
    let skylight = EnvironmentMapLight {
        intensity: 650.0,
        ..EnvironmentMapLight::hemispherical_gradient(
            &mut images,
            Color::linear_rgb(0.55, 0.75, 1.1),
            Color::linear_rgb(0.75, 0.70, 0.65),
            Color::linear_rgb(0.34, 0.26, 0.18),
        )
    };
    let main = camera(&mut commands, &target, &skylight, 0);
    commands
        .entity(main)
        .insert((MainCamera, IsDefaultUiCamera));
    let full_detail = camera(&mut commands, &target, &skylight, 1);
    commands.entity(full_detail).insert((
        FullDetailCamera,
        LodView {
            full_detail: true,
            ..default()
        },
    ));
}

fn camera(
    commands: &mut Commands,
    target: &CameraTarget,
    skylight: &EnvironmentMapLight,
    order: isize,
) -> Entity {
    let horizon = Color::linear_rgb(sky::HORIZON.x, sky::HORIZON.y, sky::HORIZON.z);
    let camera = commands.spawn((
        Camera3d::default(),
        Camera { order, ..default() },
        Projection::Perspective(PerspectiveProjection {
            fov: FIELD_OF_VIEW_IN_RAD,
            near: NEAR_IN_M,
            far: 2000.0,
            ..default()
        }),
        Tonemapping::AcesFitted,
        DistanceFog {
            color: horizon,
            directional_light_color: Color::linear_rgba(1.0, 0.7, 0.4, 0.35),
            directional_light_exponent: 12.0,
            falloff: FogFalloff::ExponentialSquared { density: 0.0034 },
        },
        skylight.clone(),
        LodView::default(),
        seeing_nothing(),
    ));
    let camera = camera.id();
    if let Some(target) = &target.0 {
        commands.entity(camera).insert(target.clone());
    }
    camera
}

fn follow(
    main: Single<&Transform, With<MainCamera>>,
    mut twin: Single<&mut Transform, (With<FullDetailCamera>, Without<MainCamera>)>,
) {
    twin.set_if_neq(**main);
}

/// Brings viewports and thresholds in line with [`Look`] and with the size of the target.
fn apply_look(
    look: Res<Look>,
    main: Single<(&mut Camera, &mut LodView), With<MainCamera>>,
    twin: Single<&mut Camera, (With<FullDetailCamera>, Without<MainCamera>)>,
) {
    let (mut main, mut view) = main.into_inner();
    let mut twin = twin.into_inner();
    view.error_px = look.error_px;
    twin.is_active = look.split;
    let Some(size) = main.physical_target_size() else {
        return;
    };
    if look.split && size.x > 1 {
        let left = size.x / 2;
        main.viewport = Some(viewport(0, left, size.y));
        twin.viewport = Some(viewport(left, size.x - left, size.y));
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
