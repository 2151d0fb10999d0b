//! A menu of quality presets. Click an entry, or press 1 to 4. Each preset allows another error in pixels.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example quality_menu`.

mod common;

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use common::meshes::spawn_rocks;

/// The name, key and settings of each preset.
const PRESETS: [(&str, KeyCode, fn() -> FieldLodCamera); 4] = [
    ("1  low", KeyCode::Digit1, FieldLodCamera::low),
    ("2  medium", KeyCode::Digit2, FieldLodCamera::medium),
    ("3  high", KeyCode::Digit3, FieldLodCamera::high),
    ("4  ultra", KeyCode::Digit4, FieldLodCamera::ultra),
];

/// A button, and the index of its preset.
#[derive(Component)]
struct Preset(usize);

/// The text with the number of triangles.
#[derive(Component)]
struct TriangleText;

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin))
        .add_systems(Startup, (spawn_rocks, show_menu))
        .add_systems(Update, (choose_preset, update_menu))
        .run()
}

fn show_menu(mut commands: Commands) {
    let eye = Transform::from_xyz(0.0, 1.5, 6.0).looking_at(Vec3::ZERO, Vec3::Y);
    let high = FieldLodCamera::high();
    commands.spawn((Camera3d::default(), eye, high));
    let column = Node {
        flex_direction: FlexDirection::Column,
        padding: px(16).all(),
        ..default()
    };
    commands.spawn(column).with_children(|menu| {
        for (index, (name, ..)) in PRESETS.iter().enumerate() {
            menu.spawn((Button, Preset(index), children![Text::new(*name)]));
        }
        menu.spawn((TriangleText, Text::default()));
    });
}

fn choose_preset(
    keys: Res<ButtonInput<KeyCode>>,
    buttons: Query<(&Interaction, &Preset)>,
    mut camera: Single<&mut FieldLodCamera>,
) {
    for (interaction, preset) in &buttons {
        let (_, key, settings) = PRESETS[preset.0];
        if keys.just_pressed(key) || *interaction == Interaction::Pressed {
            **camera = settings();
        }
    }
}

fn update_menu(
    camera: Single<(&FieldLodCamera, &FieldLodViewStats)>,
    mut buttons: Query<(&Preset, &mut BackgroundColor)>,
    mut text: Single<&mut Text, With<TriangleText>>,
) {
    let (settings, stats) = *camera;
    for (preset, mut color) in &mut buttons {
        let is_chosen = *settings == PRESETS[preset.0].2();
        color.0 = if is_chosen {
            Color::srgb(0.1, 0.4, 0.8)
        } else {
            Color::NONE
        };
    }
    text.0 = format!("{} triangles", stats.triangles_drawn);
}
