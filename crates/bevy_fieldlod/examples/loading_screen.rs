//! A loading screen with a bar that grows as meshes get their levels of detail.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example loading_screen`.

mod common;

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use common::rock::rock;

/// The whole screen.
#[derive(Component)]
struct LoadingScreen;

/// The growing part of the bar.
#[derive(Component)]
struct Bar;

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin))
        .add_systems(Startup, (setup, show_loading_screen))
        .add_systems(Update, grow_bar)
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    for index in 0..9u8 {
        let mesh = Mesh3d(meshes.add(rock(20 + 3 * u32::from(index))));
        let material = materials.add(Color::hsl(20.0 * f32::from(index), 0.4, 0.6));
        let place = Vec3::new(f32::from(index % 3) - 1.0, 0.0, f32::from(index / 3) - 1.0);
        let place = Transform::from_translation(3.0 * place);
        commands.spawn((mesh, MeshMaterial3d(material), place, AutoLod::default()));
    }
    let sun = Transform::default().looking_to(Vec3::new(-1.0, -1.0, -0.5), Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
    let eye = Transform::from_xyz(2.0, 6.0, 9.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
}

fn show_loading_screen(mut commands: Commands) {
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
    // Before the first mesh is seen there is nothing to wait for yet.
    if progress.ready > 0 && progress.waiting == 0 {
        info!("ready after {:.1} s", time.elapsed_secs());
        commands.entity(*screen).despawn();
    }
}
