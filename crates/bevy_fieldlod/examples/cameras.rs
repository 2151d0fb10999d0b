//! Two players on a split screen and a minimap: each camera draws its own levels of detail.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example cameras`.

mod common;

use bevy::camera::{ScalingMode, Viewport};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use common::meshes::spawn_rocks;

/// The part of the screen that a camera draws to: its corner and its size, as shares of the screen.
#[derive(Component)]
struct ScreenPart(Vec2, Vec2);

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin))
        .add_systems(Startup, (spawn_rocks, setup))
        .add_systems(Update, set_viewports)
        .run()
}

fn setup(mut commands: Commands) {
    // The players. A camera without settings allows one pixel of error.
    for (order, eye) in [Vec3::new(5.0, 2.0, 8.0), Vec3::new(-9.0, 6.0, -16.0)]
        .iter()
        .enumerate()
    {
        commands.spawn((
            Camera3d::default(),
            Camera {
                order: order as isize,
                ..default()
            },
            Transform::from_translation(*eye).looking_at(Vec3::ZERO, Vec3::Y),
            ScreenPart(Vec2::new(0.5 * order as f32, 0.0), Vec2::new(0.5, 1.0)),
        ));
    }
    // A minimap is small: four pixels of error are enough.
    let mut map = OrthographicProjection::default_3d();
    map.scaling_mode = ScalingMode::FixedVertical {
        viewport_height: 14.0,
    };
    commands.spawn((
        Camera3d::default(),
        Camera {
            order: 2,
            ..default()
        },
        Projection::Orthographic(map),
        Transform::from_xyz(0.0, 20.0, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z),
        ScreenPart(Vec2::new(0.4, 0.0), Vec2::new(0.2, 0.35)),
        FieldLodCamera::with_error_px(4.0),
    ));
}

fn set_viewports(mut cameras: Query<(&mut Camera, &ScreenPart)>) {
    for (mut camera, ScreenPart(corner, size)) in &mut cameras {
        let Some(screen) = camera.physical_target_size().map(UVec2::as_vec2) else {
            continue;
        };
        camera.viewport = Some(Viewport {
            physical_position: (corner * screen).as_uvec2(),
            physical_size: (size * screen).as_uvec2(),
            ..default()
        });
    }
}
