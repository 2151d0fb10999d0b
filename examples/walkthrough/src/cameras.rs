//! The camera, and its twin for the split screen.

use bevy::camera::{RenderTarget, ShadowLodOrigin, Viewport};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::light::EnvironmentMapLight;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use crate::hours::Hours;

/// Vertical field of view in free flight, until the wheel changes it.
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
    /// Whether the moon and the lamps shine, not the sun.
    pub(crate) night: bool,
}

/// The light of the sky, by day and by night.
#[derive(Resource)]
struct Skylights([EnvironmentMapLight; 2]);

/// Where the cameras draw to; `None` is the window.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct CameraTarget(pub(crate) Option<RenderTarget>);

/// Adds both cameras. Move the main one: the other follows.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(PreStartup, spawn).add_systems(
        PostUpdate,
        (
            follow,
            apply_look,
            apply_hours.run_if(resource_changed::<Look>),
        )
            .before(TransformSystems::Propagate),
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

fn spawn(mut commands: Commands, mut images: ResMut<Assets<Image>>, target: Res<CameraTarget>) {
    commands.insert_resource(Skylights([Hours::Day, Hours::Night].map(|hours| {
        let (intensity, [above, around, below]) = hours.skylight();
        EnvironmentMapLight {
            intensity,
            ..EnvironmentMapLight::hemispherical_gradient(&mut images, above, around, below)
        }
    })));
    let main = camera(&mut commands, &target, 0);
    commands
        .entity(main)
        .insert((MainCamera, IsDefaultUiCamera, ShadowLodOrigin));
    let full_detail = camera(&mut commands, &target, 1);
    commands.entity(full_detail).insert((
        FullDetailCamera,
        FieldLodSettings {
            full_detail: true,
            ..default()
        },
    ));
}

fn camera(commands: &mut Commands, target: &CameraTarget, order: isize) -> Entity {
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
        FieldLodSettings::default(),
        seeing_nothing(),
    ));
    let camera = camera.id();
    if let Some(target) = &target.0 {
        commands.entity(camera).insert(target.clone());
    }
    camera
}

/// Gives the cameras the air and the sky of the hour.
fn apply_hours(
    mut commands: Commands,
    look: Res<Look>,
    skylights: Res<Skylights>,
    cameras: Query<Entity, With<Camera3d>>,
) {
    let hours = Hours::of(&look);
    let Skylights([day, night]) = &*skylights;
    for camera in &cameras {
        let skylight = if look.night { night } else { day };
        commands
            .entity(camera)
            .insert((hours.fog(), skylight.clone()));
    }
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

/// Brings viewports and thresholds in line with [`Look`] and with the size of the target.
fn apply_look(
    look: Res<Look>,
    main: Single<(&mut Camera, &mut FieldLodSettings), With<MainCamera>>,
    twin: Single<&mut Camera, (With<FullDetailCamera>, Without<MainCamera>)>,
) {
    let (mut main, mut view) = main.into_inner();
    let mut twin = twin.into_inner();
    view.error_px = Some(look.error_px);
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
