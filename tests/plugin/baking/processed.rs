//! Processed assets contain their levels of detail.

use std::path::{Path, PathBuf};

use bevy::asset::processor::{AssetProcessor, ProcessorState};
use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{FieldLodProcessorPlugin, LodOrigin};
use fieldlod_bake::{BakeConfig, bake_file};
use fieldlod_hierarchy::Precision;
use fieldlod_tests::apps::finish;
use serde_json::json;
use tempfile::TempDir;

use crate::content::surfaces::{save, tree};
use crate::gltf_file::GltfFile;
use crate::headless::{logged, origins, progress, run_until, unfinished};

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

/// A rock with normals, tangents, second texture coordinates and colors.
fn rock() -> GltfFile {
    let mesh = fieldlod_tests::rock(4, 1);
    let mut file = GltfFile::of(&mesh);
    let attributes: [(&str, &str, &[f32]); 3] = [
        ("TANGENT", "VEC4", &[0.6, 0.0, 0.8, -1.0]),
        ("TEXCOORD_1", "VEC2", &[0.25, 0.5]),
        ("COLOR_0", "VEC4", &[0.1, 0.2, 0.3, 0.4]),
    ];
    for (name, kind, value) in attributes {
        let accessor = file.add_floats(&value.repeat(mesh.positions.len()), kind);
        file.primitive()["attributes"][name] = json!(accessor);
    }
    file
}

/// Processes a folder of sources, and returns the processed `mesh.glb`.
fn process(sources: &Path) -> Vec<u8> {
    let mut app = unfinished(assets(sources, true));
    app.add_plugins(FieldLodProcessorPlugin);
    finish(&mut app);
    app.update();
    let processor = app.world().resource::<AssetProcessor>().clone();
    run_until(&mut app, "the assets are processed", |_| {
        bevy::tasks::block_on(processor.get_state()) == ProcessorState::Finished
    });
    std::fs::read(sources.join("../processed/mesh.glb")).unwrap()
}

/// A new folder of sources with one file.
fn sources_in(folder: &TempDir, name: &str, file: &[u8]) -> PathBuf {
    let sources = folder.path().join("sources");
    std::fs::create_dir(&sources).unwrap();
    std::fs::write(sources.join(name), file).unwrap();
    sources
}

/// The `.fieldlod` file that the processor added to a `.glb` file.
fn embedded(glb: &[u8]) -> &[u8] {
    let chunk = glb.windows(4).position(|bytes| bytes == b"FLOD").unwrap() + 4;
    let (length, file) = glb[chunk..].split_first_chunk::<4>().unwrap();
    &file[..u32::from_le_bytes(*length) as usize]
}

#[test]
fn processed_file_needs_no_bake() {
    let mut file = rock();
    file.json["nodes"] = json!([{ "mesh": 0 }]);
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    let folder = tempfile::tempdir().unwrap();
    let sources = sources_in(&folder, "mesh.glb", &file.glb_bytes());
    let processed = process(&sources);
    // The file equals that of `fieldlod bake --quantize`, and has the attributes of the rock.
    let baked = bake_file(&sources.join("mesh.glb"), &BakeConfig::default(), &|_| ()).unwrap();
    let vertices = &baked.file.primitives[0].hierarchy.vertices;
    assert!(!vertices.tangents.is_empty() && !vertices.uvs_1.is_empty());
    assert!(!vertices.colors.is_empty());
    assert_eq!(
        embedded(&processed),
        baked.file.to_bytes_with(Precision::Quantized16)
    );
    std::fs::remove_dir_all(&sources).unwrap();
    std::fs::create_dir(&sources).unwrap();

    // The game as it is shipped: no processor, and no sources.
    let mut shipped = unfinished(assets(&sources, false));
    finish(&mut shipped);
    load_scene(&mut shipped);
    run_until(&mut shipped, "the mesh is ready", |app| {
        progress(app).ready == 1
    });
    assert_eq!(origins(&shipped), [LodOrigin::BesideAsset]);
}

#[test]
fn processor_reads_textures_beside_file() {
    let folder = tempfile::tempdir().unwrap();
    let sources = sources_in(&folder, "mesh.glb", &tree().glb_bytes());
    let glb = sources.join("mesh.glb");
    let mut all = Vec::new();
    // The processor runs again on a file with a changed texture.
    for width in [6, 1] {
        save(&sources, width);
        let processed = process(&sources);
        let baked = bake_file(&glb, &BakeConfig::default(), &|_| ()).unwrap();
        assert_eq!(baked.unread_images, []);
        assert!(embedded(&processed) == baked.file.to_bytes_with(Precision::Quantized16));
        all.push(processed);
    }
    assert!(all[0] != all[1]);
}

#[test]
fn processor_ignores_missing_texture() {
    let folder = tempfile::tempdir().unwrap();
    let sources = sources_in(&folder, "mesh.glb", &tree().glb_bytes());
    let glb = sources.join("mesh.glb");
    let processed = process(&sources);
    let baked = bake_file(&glb, &BakeConfig::default(), &|_| ()).unwrap();
    assert!(embedded(&processed) == baked.file.to_bytes_with(Precision::Quantized16));
    assert!(logged(Level::WARN, &["mesh.glb", "needles.png"]));
}

#[test]
fn unbakeable_file_is_copied() {
    let folder = tempfile::tempdir().unwrap();
    let sources = sources_in(&folder, "odd-one.glb", b"no glTF at all");
    let mut app = unfinished(assets(&sources, true));
    app.add_plugins(FieldLodProcessorPlugin);
    finish(&mut app);
    let copy = folder.path().join("processed/odd-one.glb");
    run_until(&mut app, "the file is copied", |_| copy.exists());
    run_until(&mut app, "a warning is logged", |_| {
        logged(Level::WARN, &["odd-one.glb", "could not bake"])
    });
    assert_eq!(std::fs::read(copy).unwrap(), b"no glTF at all");
}
