//! Two players on a split screen and a minimap: each camera draws its own levels of detail.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example cameras`.

mod common;

use bevy::camera::{ScalingMode, Viewport};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

/// The part of the screen that a camera draws to: its corner and its size, as shares of the screen.
#[derive(Component)]
struct ScreenPart(Vec2, Vec2);

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin))
        .add_systems(Startup, setup)
        .add_systems(Update, (set_viewports, log_triangles))
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let torus = Torus::new(0.5, 1.0).mesh();
    let mesh = Mesh3d(meshes.add(torus.minor_resolution(96).major_resolution(256)));
    for index in 0..9u8 {
        let material = materials.add(Color::hsl(40.0 * f32::from(index), 0.6, 0.6));
        let place = Vec3::new(f32::from(index % 3) - 1.0, 0.0, f32::from(index / 3) - 1.0);
        let place = Transform::from_translation(4.0 * place);
        commands.spawn((
            mesh.clone(),
            MeshMaterial3d(material),
            place,
            AutoLod::default(),
        ));
    }
    let sun = Transform::default().looking_to(Vec3::new(-1.0, -1.0, -0.5), Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));

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
    // The minimap is small, and nobody inspects it: four pixels of error.
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
        FieldLodSettings::with_error_px(4.0),
    ));
}

fn set_viewports(mut cameras: Query<(&mut Camera, &ScreenPart)>) {
    for (mut camera, ScreenPart(corner, size)) in &mut cameras {
        let Some(screen) = camera.physical_target_size().map(|size| size.as_vec2()) else {
            continue;
        };
        camera.viewport = Some(Viewport {
            physical_position: (corner * screen).as_uvec2(),
            physical_size: (size * screen).as_uvec2(),
            ..default()
        });
    }
}

fn log_triangles(cameras: Query<(&Camera, &FieldLodViewStats)>, mut last: Local<Vec<u64>>) {
    let now: Vec<_> = cameras
        .iter()
        .map(|(_, stats)| stats.triangles_drawn)
        .collect();
    if *last != now {
        info!("triangles of each camera: {now:?}");
        *last = now;
    }
}
