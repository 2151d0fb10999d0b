//! A torus that the program makes, and a camera that goes away from it and comes back. The title of the
//! window counts the triangles drawn.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example minimal`.

mod common;

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

fn main() -> AppExit {
    App::new()
        // In a game: `DefaultPlugins` in place of `common::plugins()`.
        .add_plugins((common::plugins(), FieldLodPlugin))
        .add_systems(Startup, setup)
        .add_systems(Update, (move_camera, count_triangles))
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let torus = Torus::new(0.5, 1.0).mesh();
    let mesh = meshes.add(torus.minor_resolution(128).major_resolution(512));
    let material = materials.add(Color::srgb(0.8, 0.5, 0.3));
    // `AutoLod` adds levels of detail. They are baked in the background.
    commands.spawn((Mesh3d(mesh), MeshMaterial3d(material), AutoLod::default()));
    let sun = Transform::default().looking_to(Vec3::new(-1.0, -1.0, -0.5), Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
    // One pixel of error is also the default of a camera.
    commands.spawn((Camera3d::default(), FieldLodCamera::with_error_px(1.0)));
}

fn move_camera(time: Res<Time>, mut camera: Single<&mut Transform, With<Camera3d>>) {
    let distance = 11.0 - 9.0 * (0.5 * time.elapsed_secs()).cos();
    let direction = Vec3::new(0.0, 0.6, 0.8);
    **camera = Transform::from_translation(distance * direction).looking_at(Vec3::ZERO, Vec3::Y);
}

fn count_triangles(stats: Single<&FieldLodViewStats>, mut window: Single<&mut Window>) {
    let (drawn, full) = (stats.triangles_drawn, stats.triangles_full);
    window.title = format!("{drawn} of {full} triangles");
}
