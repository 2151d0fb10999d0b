//! A glTF scene with levels of detail: one component on the root of the scene. The log
//! names each mesh entity once it has levels.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example gltf_scene`.

mod common;

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use common::meshes::{folder_of, rock, sun, write_gltf};

fn main() -> AppExit {
    // A game has its scenes in the folder `assets`. This example writes one.
    let folder = folder_of("gltf_scene").expect("a folder for temporary files");
    let places: Vec<_> = (0..12u8)
        .map(|i| Vec3::new(3.0 * f32::from(i % 3), 0.0, -4.0 * f32::from(i / 3)))
        .collect();
    write_gltf(
        &folder.join("rocks.gltf"),
        &rock(33),
        &places,
        [0.6, 0.5, 0.4],
    )
    .expect("a writable folder");
    App::new()
        .add_plugins((common::plugins_with_assets_in(folder), FieldLodPlugin))
        .add_systems(Startup, setup)
        .add_systems(Update, move_camera)
        .run()
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("rocks.gltf"));
    commands
        .spawn((WorldAssetRoot(scene), AutoLod::default()))
        // Triggered on each mesh entity, and propagated to the root of the scene.
        .observe(|ready: On<LodReady>| {
            info!(
                "{} is ready: {:?}",
                ready.original_event_target(),
                ready.kind
            );
        })
        .observe(|failed: On<LodFailed>| warn!("no levels of detail: {}", failed.error));
    let (light, place) = sun();
    let shadow_maps_enabled = true;
    commands.spawn((
        DirectionalLight {
            shadow_maps_enabled,
            ..light
        },
        place,
    ));
    commands.spawn((Camera3d::default(), FieldLodCamera::with_error_px(1.0)));
}

fn move_camera(time: Res<Time>, mut camera: Single<&mut Transform, With<Camera3d>>) {
    let place = Vec3::new(3.0 + 6.0 * (0.2 * time.elapsed_secs()).sin(), 2.0, 5.0);
    **camera = Transform::from_translation(place).looking_at(Vec3::new(3.0, 0.0, -4.0), Vec3::Y);
}
