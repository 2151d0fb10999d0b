//! The debug view: colours of levels, boxes and numbers. C, B and O switch them; F freezes the selection; H shows a
//! heat map.
//!
//! Run with `cargo run --release -p bevy_fieldlod --features debug --example debug_view`.

mod common;

use bevy::prelude::*;
use bevy_fieldlod::{FieldLodDebugPlugin, FieldLodHeatMap, prelude::*};
use common::meshes::spawn_rocks;

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin, FieldLodDebugPlugin))
        .insert_resource(FieldLodDebug {
            color_levels: true,
            bounds: true,
            overlay: true,
            ..default()
        })
        .add_systems(Startup, (spawn_rocks, setup))
        .add_systems(Update, (switch, move_camera))
        .run()
}

fn setup(mut commands: Commands) {
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
    let place = Vec3::new(0.0, 1.5, 7.0 + 3.0 * (0.5 * time.elapsed_secs()).sin());
    **camera = Transform::from_translation(place).looking_at(Vec3::ZERO, Vec3::Y);
}
