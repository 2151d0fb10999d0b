//! `bake --scene`: a folder with a scene and its files.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use common::{glb, grid, parts};
use fieldlod_bake::import_gltf;
use fieldlod_hierarchy::{BakedFile, PagedFile};
use serde_json::{Value, json};
use tempfile::TempDir;

fn bake(input: &Path, folder: &Path) -> Output {
    let arguments = ["bake", "--scene", "--preset", "fast", "-o"];
    Command::new(env!("CARGO_BIN_EXE_fieldlod"))
        .args(arguments)
        .args([folder, input])
        .output()
        .unwrap()
}

const IMAGE: &[u8] = b"contents of an image";

/// A scene of a large and a small grid, an animation and an image.
fn scene() -> (Value, Vec<u8>) {
    let ([large, large_indices], [small, small_indices]) = (grid(128), grid(20));
    let times: Vec<u8> = [0.0f32, 1.0].iter().flat_map(|t| t.to_le_bytes()).collect();
    let moves: Vec<u8> = [0.0f32; 6].iter().flat_map(|t| t.to_le_bytes()).collect();
    let parts = [
        large,
        large_indices,
        IMAGE.to_vec(),
        small,
        small_indices,
        times,
        moves,
    ];
    let (mut binary, mut views) = (Vec::new(), Vec::new());
    for part in &parts {
        views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": part.len() }));
        binary.extend(part);
        binary.resize(binary.len().next_multiple_of(4), 0);
    }
    let floats = |view: usize, kind: &str, most: u32| {
        let width = if kind == "VEC3" { 12 } else { 4 };
        json!({ "bufferView": view, "componentType": 5126, "type": kind, "count": parts[view].len() / width,
            "min": [0, 0, 0], "max": [most, 0, most] })
    };
    let indices = |view: usize| json!({ "bufferView": view, "componentType": 5125, "type": "SCALAR", "count": parts[view].len() / 4 });
    let json = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": binary.len() }],
        "bufferViews": views,
        "accessors": [
            floats(0, "VEC3", 128), indices(1), floats(3, "VEC3", 20), indices(4),
            { "bufferView": 5, "componentType": 5126, "type": "SCALAR", "count": 2, "min": [0], "max": [1] },
            floats(6, "VEC3", 0),
        ],
        "images": [{ "bufferView": 2, "mimeType": "image/png" }],
        "textures": [{ "source": 0 }],
        "materials": [{ "name": "stone", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "meshes": [
            { "name": "ground", "primitives": [
                { "attributes": { "POSITION": 0 }, "indices": 1, "material": 0, "extras": { "of": "the game" } },
            ] },
            { "name": "tile", "primitives": [{ "attributes": { "POSITION": 2 }, "indices": 3 }] },
        ],
        "nodes": [{ "mesh": 0, "translation": [1, 2, 3], "children": [1] }, { "mesh": 1, "name": "door" }],
        "animations": [{
            "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
            "samplers": [{ "input": 4, "output": 5 }],
        }],
        "scenes": [{ "nodes": [0] }],
        "scene": 0,
    });
    (json, binary)
}

#[test]
fn scene_keeps_everything_except_large_meshes() {
    let folder = TempDir::new().unwrap();
    let (input, output) = (folder.path().join("world.glb"), folder.path().join("world"));
    let (json, binary) = scene();
    fs::write(&input, glb(&json, &binary)).unwrap();
    let baked = bake(&input, &output);
    assert!(baked.status.success(), "{baked:?}");

    let bytes = fs::read(output.join("world.glb")).unwrap();
    let (written, data) = parts(&bytes);
    for kept in ["nodes", "materials", "scenes", "textures"] {
        assert_eq!(written[kept], json[kept], "{kept}");
    }
    let ground = &written["meshes"][0]["primitives"][0];
    assert_eq!(
        (&ground["material"], &ground["extras"]["of"]),
        (&json!(0), &json!("the game"))
    );
    let place =
        json!({ "pages": "world.fieldpages", "mesh": 0, "primitive": 0, "triangles": 32_768 });
    assert_eq!(ground["extras"]["fieldlod"], place);
    let times = written["animations"][0]["samplers"][0]["input"]
        .as_u64()
        .unwrap();
    let times = &written["accessors"][times as usize];
    assert_eq!((&times["count"], &times["max"]), (&json!(2), &json!([1])));
    let image = written["images"][0]["bufferView"].as_u64().unwrap() as usize;
    let view = &written["bufferViews"][image];
    let start = view["byteOffset"].as_u64().unwrap() as usize;
    assert_eq!(&data[start..start + IMAGE.len()], IMAGE);
    assert!(
        data.len() * 10 < binary.len(),
        "{} of {}",
        data.len(),
        binary.len()
    );

    // The large mesh is its coarsest level, and the small mesh is unchanged.
    let again = import_gltf(&output.join("world.glb")).unwrap();
    let triangles: Vec<usize> = again
        .primitives
        .iter()
        .map(|p| p.mesh.triangle_count())
        .collect();
    assert!(triangles[0] < 100, "{triangles:?}");
    assert_eq!(triangles[1], 800);
    let pages = fs::read(output.join("world.fieldpages")).unwrap();
    let pages = PagedFile::from_contents(&pages).unwrap();
    assert_eq!(pages.meshes[0].graph.source_triangle_count(), 32_768);
    assert_eq!(pages.meshes.len(), 1);
    let small = fs::read(output.join("world.fieldlod")).unwrap();
    let small = BakedFile::from_bytes_beside_source(&small).unwrap();
    assert!(small.find(1, 0).is_some() && small.find(0, 0).is_none());
}

#[test]
fn scene_errors_name_the_file() {
    let folder = TempDir::new().unwrap();
    let (input, output) = (folder.path().join("world.glb"), folder.path().join("world"));
    let (mut json, binary) = scene();
    json["images"] = json!([{ "uri": "../stone.png" }]);
    fs::write(&input, glb(&json, &binary)).unwrap();
    let baked = bake(&input, &output);
    let said = String::from_utf8(baked.stderr).unwrap();
    assert!(said.contains("stone.png: could not be copied"), "{said}");
    // The folder of the source.
    let (json, binary) = scene();
    fs::write(&input, glb(&json, &binary)).unwrap();
    let baked = bake(&input, folder.path());
    let said = String::from_utf8(baked.stderr).unwrap();
    assert!(said.contains("would overwrite"), "{said}");
}

/// Simulates a full disk: no file can grow beyond 32 kB.
#[cfg(unix)]
#[test]
fn full_disk_leaves_no_partial_files() {
    let folder = TempDir::new().unwrap();
    let input = folder.path().join("world.glb");
    let (mut json, binary) = scene();
    json["images"] = json!([{ "uri": "stone.png" }]);
    fs::write(&input, glb(&json, &binary)).unwrap();
    fs::write(folder.path().join("stone.png"), vec![7; 100_000]).unwrap();
    let full = |arguments: &[&str], output: &Path| {
        let limited = "trap '' XFSZ; ulimit -f 64; exec \"$@\"";
        Command::new("sh")
            .args(["-c", limited, "sh", env!("CARGO_BIN_EXE_fieldlod"), "bake"])
            .args(["--preset", "fast", "-o"])
            .args([output, &input])
            .args(arguments)
            .output()
            .unwrap()
    };
    for (arguments, output, failed) in [
        (&[][..], "alone/world.fieldlod", "alone/world.fieldlod"),
        (
            &["--pages"],
            "alone/world.fieldpages",
            "alone/world.fieldpages",
        ),
        (&["--scene"], "scene", "scene/stone.png"),
    ] {
        let output = folder.path().join(output);
        let failed = folder.path().join(failed);
        fs::create_dir_all(failed.parent().unwrap()).unwrap();
        let baked = full(arguments, &output);
        assert_eq!(baked.status.code(), Some(1), "{baked:?}");
        let said = String::from_utf8(baked.stderr).unwrap();
        let expected = format!(
            "error: {}: could not be written: File too large",
            failed.display()
        );
        assert!(said.starts_with(&expected), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        let left = fs::read_dir(failed.parent().unwrap()).unwrap();
        let left: Vec<_> = left.map(|entry| entry.unwrap().file_name()).collect();
        assert!(left.is_empty(), "{left:?}");
    }
}
