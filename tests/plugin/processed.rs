//! Assets that were processed hold their levels of detail.

use std::path::Path;

use bevy::asset::processor::{AssetProcessor, ProcessorState};
use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{FieldLodProcessorPlugin, LodOrigin};
use fieldlod_tests::apps::finish;
use serde_json::json;

use crate::gltf_file::GltfFile;
use crate::headless::{logged, origins, run_until, status, unfinished};

fn assets(folder: &Path, processes: bool) -> AssetPlugin {
    AssetPlugin {
        file_path: folder.display().to_string(),
        processed_file_path: folder.join("../processed").display().to_string(),
        mode: AssetMode::Processed,
        use_asset_processor_override: Some(processes),
        watch_for_changes_override: Some(false),
        ..default()
    }
}

fn load_scene(app: &mut App) {
    let assets = app.world().resource::<AssetServer>();
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("mesh.glb"));
    app.world_mut()
        .spawn((WorldAssetRoot(scene), AutoLod::default()));
}

#[test]
fn a_processed_file_needs_no_bake() {
    let mut file = GltfFile::of(&fieldlod_tests::rock(4, 1));
    file.json["nodes"] = json!([{ "mesh": 0 }]);
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    let folder = tempfile::tempdir().unwrap();
    let sources = folder.path().join("sources");
    std::fs::create_dir(&sources).unwrap();
    std::fs::write(sources.join("mesh.glb"), file.glb_bytes()).unwrap();

    let mut processing = unfinished(assets(&sources, true));
    processing.add_plugins(FieldLodProcessorPlugin);
    finish(&mut processing);
    processing.update();
    let processor = processing.world().resource::<AssetProcessor>().clone();
    run_until(&mut processing, "the assets are processed", |_| {
        bevy::tasks::block_on(processor.get_state()) == ProcessorState::Finished
    });
    let processed = std::fs::read(folder.path().join("processed/mesh.glb")).unwrap();
    assert!(processed.len() > file.glb_bytes().len());
    drop(processing);
    std::fs::remove_dir_all(&sources).unwrap();
    std::fs::create_dir(&sources).unwrap();

    // The game as it is shipped: no processor, and no sources.
    let mut shipped = unfinished(assets(&sources, false));
    finish(&mut shipped);
    load_scene(&mut shipped);
    run_until(&mut shipped, "the mesh is ready", |app| {
        status(app).ready == 1
    });
    assert_eq!(origins(&shipped), [LodOrigin::BesideAsset]);
}

#[test]
fn a_file_that_cannot_be_baked_is_processed_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let sources = folder.path().join("sources");
    std::fs::create_dir(&sources).unwrap();
    std::fs::write(sources.join("odd-one.glb"), b"no glTF at all").unwrap();
    let mut app = unfinished(assets(&sources, true));
    app.add_plugins(FieldLodProcessorPlugin);
    finish(&mut app);
    let copy = folder.path().join("processed/odd-one.glb");
    run_until(&mut app, "the file is copied", |_| copy.exists());
    run_until(&mut app, "the log names it", |_| {
        logged(Level::WARN, &["odd-one.glb", "without levels of detail"])
    });
    assert_eq!(std::fs::read(copy).unwrap(), b"no glTF at all");
}
