//! Where the camera is: on its path, or flown by hand.

use bevy::input::mouse::AccumulatedMouseMotion;
use bevy::prelude::*;
use bevy::render::renderer::RenderAdapterInfo;
use bevy_fieldlod::prelude::*;

use crate::cameras::MainCamera;
use crate::path::{CameraPath, DURATION_IN_S, Pose};

const SPEED_IN_M_PER_S: f32 = 6.0;
const FAST: f32 = 5.0;
const RAD_PER_PIXEL: f32 = 0.0025;

/// Whether the camera walks by itself, and how far around it has come.
#[derive(Resource, Debug)]
pub(crate) struct Walk {
    pub(crate) on_path: bool,
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
        (leave_or_join, walk, fly).chain().run_if(worth_drawing),
    );
}

/// A software renderer takes minutes for the source meshes: there, the camera stays where it sees
/// nothing until the first levels of detail are ready.
fn worth_drawing(
    adapter: Res<RenderAdapterInfo>,
    status: Res<LodStatus>,
    mut since_before: Local<bool>,
) -> bool {
    let is_software = adapter.device_type == wgpu::DeviceType::Cpu;
    *since_before |= !is_software || status.waiting == 0 && status.ready > 0;
    *since_before
}

/// The camera's transform at a pose.
pub(crate) fn at_pose(pose: Pose) -> Transform {
    Transform::from_translation(pose.eye).looking_at(pose.target, Vec3::Y)
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

fn walk(
    time: Res<Time>,
    mut walk: ResMut<Walk>,
    mut camera: Single<&mut Transform, With<MainCamera>>,
) {
    if walk.on_path {
        walk.round = (walk.round + time.delta_secs() / DURATION_IN_S).fract();
        **camera = at_pose(walk.path.pose(walk.round));
    }
}

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
    let speed = SPEED_IN_M_PER_S * if fast { FAST } else { 1.0 };
    let step = camera.rotation * direction(&keys).normalize_or_zero();
    camera.translation += step * speed * time.delta_secs();
}

fn turned(rotation: Quat, moved_in_px: Vec2) -> Quat {
    let (yaw, pitch, _) = rotation.to_euler(EulerRot::YXZ);
    let yaw = yaw - moved_in_px.x * RAD_PER_PIXEL;
    let pitch = (pitch - moved_in_px.y * RAD_PER_PIXEL).clamp(-1.5, 1.5);
    Quat::from_euler(EulerRot::YXZ, yaw, pitch, 0.0)
}

/// The pressed flight keys, in view space.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looking_around_keeps_the_horizon_level_and_never_turns_over() {
        let up = turned(Quat::IDENTITY, Vec2::new(300.0, -99_999.0));
        assert!((up * Vec3::X).y.abs() < 1e-5);
        assert!((up * Vec3::Y).y > 0.0);
    }
}
