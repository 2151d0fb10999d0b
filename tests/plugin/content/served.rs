//! `.fieldlod` files beside assets on a server.

use bevy::asset::io::{AssetSourceBuilder, AssetSourceId};
use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::LodError;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{BakeConfig, bake_file};
use serde_json::json;

use crate::gltf_file::GltfFile;
use crate::headless::{IDLE_FRAMES, failures, logged_times, progress, run_until, unfinished_in};
use crate::streamed::shelf::Shelf;

/// The number of meshes of a scene. They are prepared at the same time.
const MESHES: u32 = 5;

/// A file with a scene of rocks that are meshes of their own.
fn rocks() -> GltfFile {
    let mut file = GltfFile::empty();
    for seed in 0..MESHES {
        file.add_mesh(&fieldlod_tests::rock(3, seed));
    }
    let meshes = 0..MESHES;
    file.json["nodes"] = meshes.clone().map(|mesh| json!({ "mesh": mesh })).collect();
    file.json["scenes"] = json!([{ "nodes": Vec::from_iter(meshes) }]);
    file
}

/// Draws the scene `name` of a server that answers with `lods` for its `.fieldlod` file, and waits until all entities
/// have levels or are plain. Returns the app and the number of requests for the file.
fn load(name: &str, lods: Option<Vec<u8>>) -> (App, usize) {
    let (server, [glb, beside]) = (
        Shelf::default(),
        ["glb", "fieldlod"].map(|extension| format!("{name}.{extension}")),
    );
    server.put(&glb, std::fs::read(rocks().glb()).unwrap());
    if let Some(lods) = lods {
        server.put(&beside, lods);
    }
    let mut app = App::new();
    let reader = server.clone();
    let source = AssetSourceBuilder::new(move || Box::new(reader.clone()));
    app.register_asset_source(AssetSourceId::Default, source);
    let mut app = unfinished_in(app, AssetPlugin::default());
    app.insert_resource(FieldLodAppConfig {
        bake_at_run_time: false,
        ..default()
    });
    fieldlod_tests::apps::finish(&mut app);
    let scene = GltfAssetLabel::Scene(0).from_asset(glb);
    let scene = app.world().resource::<AssetServer>().load(scene);
    let root = (WorldAssetRoot(scene), AutoLod::default());
    app.world_mut().spawn(root);
    run_until(&mut app, "all meshes are prepared", |app| {
        progress(app).ready + progress(app).plain == MESHES
    });
    (0..IDLE_FRAMES).for_each(|_| app.update());
    (app, server.reads_of(&beside))
}

#[test]
fn all_meshes_share_one_request() {
    let outcome = bake_file(&rocks().glb(), &BakeConfig::default(), &|_| ()).unwrap();
    let (app, requests) = load("served", Some(outcome.file.to_bytes()));
    assert_eq!((progress(&app).ready, requests), (MESHES, 1));
}

#[test]
fn missing_file_is_requested_and_logged_once() {
    let page = b"\n<!DOCTYPE html><title>Not found</title>".to_vec();
    for (name, answer) in [("absent", None), ("replaced-by-a-page", Some(page))] {
        let (app, requests) = load(name, answer);
        assert_eq!((progress(&app).plain, requests), (MESHES, 1));
        assert_eq!(
            failures(&app),
            vec![LodError::BakeDisabled; MESHES as usize]
        );
        assert_eq!(
            logged_times(Level::ERROR, &[name, "no matching .fieldlod"]),
            1
        );
        assert_eq!(logged_times(Level::WARN, &[name]), 0);
    }
}

#[test]
fn corrupt_file_is_logged() {
    let (app, requests) = load("corrupt", Some(b"fieldlod".to_vec()));
    assert_eq!((progress(&app).plain, requests), (MESHES, 1));
    assert_eq!(logged_times(Level::WARN, &["corrupt.fieldlod"]), 1);
}
