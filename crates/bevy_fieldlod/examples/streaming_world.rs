//! A landscape that is read in parts: only the pages that the camera needs are in memory.
//!
//! The command `fieldlod bake --pages land.gltf` writes `land.fieldpages`; this example calls the same functions.
//! Run with `cargo run --release -p bevy_fieldlod --example streaming_world`.

mod common;

use std::path::Path;

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use common::meshes::{folder_of, hills, sun, write_gltf};
use fieldlod_bake::{BakeConfig, bake_file};
use fieldlod_hierarchy::{PageOptions, PagedFile};

fn main() -> AppExit {
    let folder = folder_of("streaming_world").expect("a folder for temporary files");
    write_pages(&folder).expect("a landscape in pages");
    // Less than the landscape takes, so that pages are also evicted.
    let memory = LodMemory {
        gpu_bytes: 12 << 20,
        ..default()
    };
    App::new()
        .add_plugins((common::plugins_with_assets_in(folder), FieldLodPlugin))
        .insert_resource(FieldLodAppConfig {
            memory,
            ..default()
        })
        .add_systems(Startup, setup)
        .add_systems(Update, (move_camera, show_memory))
        .run()
}

/// Writes the landscape in pages, as a developer does once before shipping the game.
fn write_pages(folder: &Path) -> Result {
    let land = hills(100.0, 250, &[0.07, 0.23, 0.9, 3.1]);
    let source = folder.join("land.gltf");
    write_gltf(&source, &land, &[Vec3::ZERO], [0.6, 0.5, 0.4])?;
    let baked = bake_file(&source, &BakeConfig::default(), &|_| ())?;
    let pages = PagedFile::to_bytes(&baked.file, PageOptions::default());
    std::fs::write(folder.join("land.fieldpages"), pages)?;
    Ok(())
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let land = LodMesh3d::new(assets.load("land.fieldpages"), 0, 0);
    commands.spawn((
        land,
        MeshMaterial3d(materials.add(Color::srgb(0.4, 0.55, 0.3))),
    ));
    commands.spawn(sun());
    commands.spawn((Camera3d::default(), DistanceFog::default()));
    commands.spawn((
        Text::default(),
        Node {
            margin: px(8).all(),
            ..default()
        },
    ));
}

fn move_camera(time: Res<Time>, mut camera: Single<&mut Transform, With<Camera3d>>) {
    let angle = 0.05 * time.elapsed_secs();
    let place = Vec3::new(30.0 * angle.cos(), 6.0, 30.0 * angle.sin());
    let direction = Vec3::new(-angle.sin(), -0.25, angle.cos());
    **camera = Transform::from_translation(place).looking_to(direction, Vec3::Y);
}

fn show_memory(memory: Res<FieldLodMemory>, mut text: Single<&mut Text>) {
    let kilobytes = memory.resident_bytes >> 10;
    text.0 = format!(
        "{kilobytes} kB on the GPU, {} pages missing",
        memory.missing_pages
    );
}
