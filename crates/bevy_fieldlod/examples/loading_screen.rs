//! A loading screen with a bar that grows as meshes get their levels of detail.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example loading_screen`.

mod common;

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use common::meshes::spawn_rocks;

/// The whole screen.
#[derive(Component)]
struct LoadingScreen;

/// The growing part of the bar.
#[derive(Component)]
struct Bar;

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin))
        .add_systems(Startup, (spawn_rocks, show_loading_screen))
        .add_systems(Update, grow_bar)
        .run()
}

fn show_loading_screen(mut commands: Commands) {
    // All cores load while the game waits.
    commands.insert_resource(LodPriority::LoadingScreen);
    let eye = Transform::from_xyz(0.0, 1.5, 6.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
    let screen = Node {
        width: percent(100),
        height: percent(100),
        align_items: AlignItems::Center,
        padding: UiRect::axes(percent(20), px(0)),
        ..default()
    };
    let frame = Node {
        width: percent(100),
        height: px(24),
        ..default()
    };
    let bar = Node {
        width: percent(0),
        height: percent(100),
        ..default()
    };
    commands.spawn((
        LoadingScreen,
        screen,
        BackgroundColor(Color::BLACK),
        children![(
            frame,
            BackgroundColor(Color::srgb(0.2, 0.2, 0.2)),
            children![(Bar, bar, BackgroundColor(Color::WHITE))],
        )],
    ));
}

fn grow_bar(
    mut commands: Commands,
    progress: Res<FieldLodProgress>,
    screen: Single<Entity, With<LoadingScreen>>,
    mut bar: Single<&mut Node, With<Bar>>,
    time: Res<Time<Real>>,
) {
    bar.width = percent(100.0 * progress.share_done());
    if progress.share_done() == 1.0 {
        info!("ready after {:.1} s", time.elapsed_secs());
        commands.entity(*screen).despawn();
        commands.insert_resource(LodPriority::Background);
    }
}
