//! glTF scenes and their `.fieldlod` files.

use std::path::Path;

use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{BakeConfig, bake_file};
use serde_json::json;

use crate::gltf_file::GltfFile;
use crate::headless::{app, logged, run_until, status};

/// A file with one scene of two rocks.
fn two_rocks() -> GltfFile {
    let mut file = GltfFile::of(&fieldlod_tests::rock(4, 1));
    file.add_mesh(&fieldlod_tests::flat_shaded(&fieldlod_tests::rock(3, 2)));
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1, "scale": [1.0, -2.0, 1.0] }]);
    file.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    file
}

fn bake(glb: &Path) -> Vec<u8> {
    let outcome = bake_file(glb, &BakeConfig::default(), &|_| ()).unwrap();
    assert!(outcome.skipped.is_empty());
    outcome.file.to_bytes()
}

/// Spawns the scene of `mesh.glb`, with the hierarchies of `lods` if there are any.
fn spawn_scene(app: &mut App, lods: Option<&'static str>) {
    let assets = app.world().resource::<AssetServer>();
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("mesh.glb"));
    let auto_lod = match lods {
        Some(path) => AutoLod::from_file(assets.load(path)),
        None => AutoLod::default(),
    };
    app.world_mut().spawn((WorldAssetRoot(scene), auto_lod));
}

#[test]
fn a_scene_is_baked_in_the_background() {
    let mut file = two_rocks();
    file.glb();
    let mut app = app(file.folder());
    spawn_scene(&mut app, None);
    run_until(&mut app, "both meshes are ready", |app| {
        status(app).ready == 2
    });
}

#[test]
fn a_fieldlod_file_fits_the_meshes_that_bevy_loads() {
    let mut file = two_rocks();
    let glb = file.glb();
    file.write("good.fieldlod", &bake(&glb));
    let mut app = app(file.folder());
    spawn_scene(&mut app, Some("good.fieldlod"));
    run_until(&mut app, "both meshes are ready", |app| {
        status(app).ready == 2
    });
    assert!(!logged(Level::ERROR, &["good.fieldlod"]));
}

#[test]
fn rejects_a_stale_fieldlod_file() {
    let mut file = two_rocks();
    let glb = file.glb();
    file.write("stale.fieldlod", &bake(&glb));
    let mut changed = GltfFile::of(&fieldlod_tests::rock(4, 9));
    changed.json["nodes"] = json!([{ "mesh": 0 }]);
    changed.json["scenes"] = json!([{ "nodes": [0] }]);
    file.write("mesh.glb", &changed.glb_bytes());
    let mut app = app(file.folder());
    spawn_scene(&mut app, Some("stale.fieldlod"));
    run_until(&mut app, "the mesh is given up", |app| {
        status(app).plain == 1
    });
    let words = ["mesh.glb#Mesh0/Primitive0", "stale.fieldlod", "stale"];
    assert!(logged(Level::ERROR, &words));
}

#[test]
fn rejects_a_corrupt_fieldlod_file() {
    let mut file = two_rocks();
    let glb = file.glb();
    let mut bytes = bake(&glb);
    bytes[1000] ^= 1;
    file.write("corrupt.fieldlod", &bytes);
    let mut app = app(file.folder());
    spawn_scene(&mut app, Some("corrupt.fieldlod"));
    run_until(&mut app, "both meshes are given up", |app| {
        status(app).plain == 2
    });
    // The asset server logs from another thread.
    run_until(&mut app, "the log names file and fault", |_| {
        logged(Level::ERROR, &["corrupt.fieldlod", "checksum"])
    });
}

#[test]
fn rejects_a_missing_fieldlod_file() {
    let mut file = two_rocks();
    file.glb();
    let mut app = app(file.folder());
    spawn_scene(&mut app, Some("missing.fieldlod"));
    run_until(&mut app, "both meshes are given up", |app| {
        status(app).plain == 2
    });
    run_until(&mut app, "the log names the file", |_| {
        logged(Level::ERROR, &["missing.fieldlod"])
    });
}
