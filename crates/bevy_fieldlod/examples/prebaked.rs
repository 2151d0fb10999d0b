//! Levels of detail from a `.fieldlod` file beside the glTF file: nothing is baked at run time.
//!
//! The command `fieldlod bake rocks.gltf` writes `rocks.fieldlod`; this example calls the same function.
//! Run with `cargo run --release -p bevy_fieldlod --example prebaked`.

mod common;

use std::path::Path;

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use common::meshes::{folder_of, rock, sun, write_gltf};
use fieldlod_bake::{BakeConfig, bake_file};

fn main() -> AppExit {
    let folder = folder_of("prebaked").expect("a folder for temporary files");
    write_assets(&folder).expect("a scene and its levels of detail");
    App::new()
        .add_plugins((common::plugins_with_assets_in(folder), FieldLodPlugin))
        // A mesh without a file is reported and drawn without levels.
        .insert_resource(FieldLodAppConfig {
            bake_at_run_time: false,
            ..default()
        })
        .add_systems(Startup, setup)
        .add_systems(Update, log_origins)
        .run()
}

/// Writes the scene and its levels, as a developer does once before shipping the game.
fn write_assets(folder: &Path) -> Result {
    let scene = folder.join("rocks.gltf");
    let places = [-3.0, 0.0, 3.0].map(|x| Vec3::new(x, 0.0, -x.abs()));
    write_gltf(&scene, &rock(50), &places, [0.6, 0.5, 0.4])?;
    let baked = bake_file(&scene, &BakeConfig::default(), &|_| ())?;
    std::fs::write(folder.join("rocks.fieldlod"), baked.file.to_bytes())?;
    Ok(())
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    // The plugin finds `rocks.fieldlod`. A file elsewhere is named by `AutoLod::from_file`.
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("rocks.gltf"));
    commands.spawn((WorldAssetRoot(scene), AutoLod::default()));
    commands.spawn(sun());
    let eye = Transform::from_xyz(0.0, 1.5, 6.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
}

fn log_origins(mut events: MessageReader<FieldLodEvent>) {
    for event in events.read() {
        match event {
            FieldLodEvent::Ready { path, origin, .. } => info!("{path:?}: levels from {origin:?}"),
            FieldLodEvent::Failed { path, error, .. } => warn!("{path:?}: {error}"),
            _ => (),
        }
    }
}
