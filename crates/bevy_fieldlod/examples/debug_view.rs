//! The debug view: colours of levels, boxes and numbers. C, B and O switch them; F freezes the selection; H shows a
//! heat map.
//!
//! Run with `cargo run --release -p bevy_fieldlod --features debug --example debug_view`.

mod common;

use bevy::prelude::*;
use bevy_fieldlod::{FieldLodDebugPlugin, FieldLodHeatMap, prelude::*};
use common::rock::rock;

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin, FieldLodDebugPlugin))
        .insert_resource(FieldLodDebug {
            color_levels: true,
            bounds: true,
            overlay: true,
            ..default()
        })
        .add_systems(Startup, setup)
        .add_systems(Update, (switch, move_camera))
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let mesh = Mesh3d(meshes.add(rock(80)));
    let material = MeshMaterial3d(materials.add(Color::WHITE));
    for index in 0..5u8 {
        let place = Transform::from_xyz(2.5 * f32::from(index), 0.0, -8.0 * f32::from(index));
        commands.spawn((mesh.clone(), material.clone(), place, AutoLod::default()));
    }
    let sun = Transform::default().looking_to(Vec3::new(-1.0, -1.0, -0.5), Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
    commands.spawn(Camera3d::default());
}

fn switch(keys: Res<ButtonInput<KeyCode>>, mut debug: ResMut<FieldLodDebug>) {
    let pressed = |key| keys.just_pressed(key);
    debug.color_levels ^= pressed(KeyCode::KeyC);
    debug.bounds ^= pressed(KeyCode::KeyB);
    debug.overlay ^= pressed(KeyCode::KeyO);
    debug.freeze ^= pressed(KeyCode::KeyF);
    if pressed(KeyCode::KeyH) {
        let heat_map = FieldLodHeatMap::SamplingDensity;
        debug.heat_map = debug.heat_map.xor(Some(heat_map));
    }
}

fn move_camera(time: Res<Time>, mut camera: Single<&mut Transform, With<Camera3d>>) {
    let place = Vec3::new(-1.5, 1.0, 4.0 + 3.0 * (0.5 * time.elapsed_secs()).sin());
    **camera = Transform::from_translation(place).looking_at(Vec3::new(1.0, 0.0, -4.0), Vec3::Y);
}
