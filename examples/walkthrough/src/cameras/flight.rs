//! The camera's motion: along its path or by hand.

use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseScrollUnit};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use super::path::{CameraPath, DURATION_IN_S};
use crate::cameras::{self, MainCamera};

const SPEED_IN_M_PER_S: f32 = 6.0;
const FAST_FACTOR: f32 = 5.0;
const RAD_PER_PIXEL: f32 = 0.0025;
const MIN_FOV_IN_RAD: f32 = 0.03;
const MAX_FOV_IN_RAD: f32 = 2.0;

/// The state of the walk along the path.
#[derive(Resource, Debug)]
struct Walk {
    on_path: bool,
    round: f32,
    path: CameraPath,
}

/// Adds the path and the keys that leave it.
pub(crate) fn plugin(app: &mut App) {
    app.insert_resource(Walk {
        on_path: true,
        round: 0.0,
        path: CameraPath::new(),
    })
    .add_systems(
        Update,
        (leave_or_join, walk, fly, zoom)
            .chain()
            .run_if(levels_are_ready),
    );
}

/// Returns `true` if all levels of detail were ready once. Until then the camera waits where nothing is visible,
/// because most machines cannot draw all source meshes.
fn levels_are_ready(
    progress: Res<FieldLodProgress>,
    time: Res<Time<Real>>,
    mut were_ready: Local<bool>,
) -> bool {
    if !*were_ready && progress.waiting == 0 && progress.ready + progress.plain > 0 {
        *were_ready = true;
        let seconds = time.elapsed_secs();
        eprintln!("walkthrough: levels of detail ready after {seconds:.1} s");
    }
    *were_ready
}

fn leave_or_join(
    keys: Res<ButtonInput<KeyCode>>,
    buttons: Res<ButtonInput<MouseButton>>,
    mut walk: ResMut<Walk>,
) {
    if keys.just_pressed(KeyCode::KeyP) {
        walk.on_path = true;
    } else if direction(&keys) != Vec3::ZERO || buttons.pressed(MouseButton::Right) {
        walk.on_path = false;
    }
}

/// Moves the camera along its path.
fn walk(
    time: Res<Time>,
    mut walk: ResMut<Walk>,
    camera: Single<(&mut Transform, &mut Projection), With<MainCamera>>,
) {
    if walk.on_path {
        let (mut place, mut projection) = camera.into_inner();
        walk.round = (walk.round + time.delta_secs() / DURATION_IN_S).fract();
        let pose = walk.path.pose(walk.round);
        *place = pose.transform();
        cameras::zoom(&mut projection, pose.fov_in_rad);
    }
}

/// Zooms with the mouse wheel in free flight.
fn zoom(
    scroll: Res<AccumulatedMouseScroll>,
    walk: Res<Walk>,
    mut projection: Single<&mut Projection, With<MainCamera>>,
) {
    let notches = match scroll.unit {
        MouseScrollUnit::Line => scroll.delta.y,
        MouseScrollUnit::Pixel => scroll.delta.y / MouseScrollUnit::SCROLL_UNIT_CONVERSION_FACTOR,
    };
    if !walk.on_path
        && notches != 0.0
        && let Projection::Perspective(perspective) = &mut **projection
    {
        perspective.fov = zoomed(perspective.fov, notches);
    }
}

/// The field of view after a turn of the wheel. One notch magnifies the picture by an eighth.
fn zoomed(fov_in_rad: f32, notches: f32) -> f32 {
    // The magnification is the inverse of the tangent of half the angle.
    let half = (fov_in_rad / 2.0).tan() * 1.125_f32.powf(-notches);
    (2.0 * half.atan()).clamp(MIN_FOV_IN_RAD, MAX_FOV_IN_RAD)
}

/// Moves and turns the camera with keys and mouse in free flight.
fn fly(
    time: Res<Time>,
    keys: Res<ButtonInput<KeyCode>>,
    buttons: Res<ButtonInput<MouseButton>>,
    mouse: Res<AccumulatedMouseMotion>,
    walk: Res<Walk>,
    mut camera: Single<&mut Transform, With<MainCamera>>,
) {
    if walk.on_path {
        return;
    }
    if buttons.pressed(MouseButton::Right) {
        camera.rotation = turned(camera.rotation, mouse.delta);
    }
    let fast = keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
    let speed = SPEED_IN_M_PER_S * if fast { FAST_FACTOR } else { 1.0 };
    let step = camera.rotation * direction(&keys).normalize_or_zero();
    camera.translation += step * speed * time.delta_secs();
}

/// Turns a rotation by a move of the mouse. The horizon stays level.
fn turned(rotation: Quat, moved_in_px: Vec2) -> Quat {
    let (yaw, pitch, _) = rotation.to_euler(EulerRot::YXZ);
    let yaw = yaw - moved_in_px.x * RAD_PER_PIXEL;
    // At a right angle, 1.57, the yaw would be undefined.
    let pitch = (pitch - moved_in_px.y * RAD_PER_PIXEL).clamp(-1.5, 1.5);
    Quat::from_euler(EulerRot::YXZ, yaw, pitch, 0.0)
}

/// The direction of the pressed flight keys, in view space.
fn direction(keys: &ButtonInput<KeyCode>) -> Vec3 {
    let along = |forward: KeyCode, backward: KeyCode| {
        f32::from(u8::from(keys.pressed(forward))) - f32::from(u8::from(keys.pressed(backward)))
    };
    Vec3::new(
        along(KeyCode::KeyD, KeyCode::KeyA),
        along(KeyCode::KeyE, KeyCode::KeyQ),
        along(KeyCode::KeyS, KeyCode::KeyW),
    )
}
