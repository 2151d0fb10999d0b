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
        "nodes": [{ "mesh": 0, "translation": [1, 2, 3], "children": [1] }, { "mesh": 1, "name": "door", "translation": [0, 5, 0] }],
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

/// A scene of one grid as programs that pack files write it: quantized, and with meshopt's codec.
fn packed_scene(folder: &Path) -> std::path::PathBuf {
    let cells = 40;
    let side = cells + 1;
    let corners = (0..side * side).map(|i| [(i / side) as i16, 0, (i % side) as i16, 0]);
    let words: Vec<[u32; 2]> = corners
        .map(|[x, y, z, w]| [[x, y], [z, w]].map(|[a, b]| a as u32 | (b as u32) << 16))
        .collect();
    let [_, indices] = grid(cells);
    let (indices, _) = indices.as_chunks::<4>();
    let indices: Vec<u32> = indices
        .iter()
        .map(|bytes| u32::from_le_bytes(*bytes))
        .collect();
    let positions = meshopt::encode_vertex_buffer(&words).unwrap();
    let packed_indices = meshopt::encode_index_buffer(&indices, words.len()).unwrap();
    let view = |offset: usize, bytes: &[u8], stride: usize, count: usize, mode: &str| {
        json!({ "buffer": 1, "byteOffset": 0, "byteLength": count * stride, "extensions": {
            "EXT_meshopt_compression": { "buffer": 0, "byteOffset": offset, "byteLength": bytes.len(),
                "byteStride": stride, "count": count, "mode": mode } } })
    };
    let padded = positions.len().next_multiple_of(4);
    let mut binary = positions.clone();
    binary.resize(padded, 0);
    binary.extend(&packed_indices);
    let mut of_positions = view(0, &positions, 8, words.len(), "ATTRIBUTES");
    of_positions["byteStride"] = json!(8);
    let names = json!(["EXT_meshopt_compression", "KHR_mesh_quantization"]);
    let json = json!({
        "asset": { "version": "2.0" },
        "extensionsRequired": names, "extensionsUsed": names,
        "buffers": [{ "byteLength": binary.len() }, { "byteLength": words.len() * 8 + indices.len() * 4,
            "extensions": { "EXT_meshopt_compression": { "fallback": true } } }],
        "bufferViews": [of_positions, view(padded, &packed_indices, 4, indices.len(), "TRIANGLES")],
        "accessors": [
            { "bufferView": 0, "componentType": 5122, "type": "VEC3", "count": words.len(),
                "min": [0, 0, 0], "max": [cells, 0, cells] },
            { "bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": indices.len() },
        ],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "nodes": [{ "mesh": 0, "scale": [0.01, 0.01, 0.01] }],
        "scenes": [{ "nodes": [0] }],
        "scene": 0,
    });
    let path = folder.join("packed.glb");
    fs::write(&path, glb(&json, &binary)).unwrap();
    path
}

#[test]
fn a_packed_scene_becomes_one_that_bevy_reads() {
    let folder = TempDir::new().unwrap();
    let (input, output) = (packed_scene(folder.path()), folder.path().join("out"));
    let baked = bake(&input, &output);
    assert!(baked.status.success(), "{baked:?}");
    let bytes = fs::read(output.join("packed.glb")).unwrap();
    let (json, _) = parts(&bytes);
    assert!(json.get("extensionsRequired").is_none() && json.get("extensionsUsed").is_none());
    assert_eq!(json["accessors"][0]["componentType"], 5126);
    assert_eq!(json["nodes"][0]["scale"], json!([0.01, 0.01, 0.01]));
    // The levels are those of the meshes in the scene.
    let scene = import_gltf(&output.join("packed.glb")).unwrap();
    let levels = fs::read(output.join("packed.fieldlod")).unwrap();
    let levels = BakedFile::from_bytes_beside_source(&levels).unwrap();
    let mesh = &scene.primitives[0].mesh;
    assert_eq!(
        levels.find(0, 0).unwrap().hierarchy.source,
        mesh.source_hash()
    );
    assert_eq!(mesh.triangle_count(), 3_200);
}

#[test]
fn images_come_along_by_any_name_and_a_missing_one_is_refused_before_the_bake() {
    let folder = TempDir::new().unwrap();
    let (input, output) = (folder.path().join("world.glb"), folder.path().join("out"));
    let (mut json, binary) = scene();
    json["images"] = json!([{ "uri": "my%20picture.png" }, { "uri": "./dot.png" }, { "uri": "DATA:image/png;base64,AA==" }]);
    fs::write(&input, glb(&json, &binary)).unwrap();
    fs::write(folder.path().join("dot.png"), IMAGE).unwrap();
    let baked = bake(&input, &output);
    let said = String::from_utf8(baked.stderr).unwrap();
    assert!(said.contains("my picture.png"), "{said}");
    assert!(!output.exists(), "a refusal leaves no folder");
    fs::write(folder.path().join("my picture.png"), IMAGE).unwrap();
    let baked = bake(&input, &output);
    assert!(baked.status.success(), "{baked:?}");
    for name in ["my picture.png", "dot.png"] {
        assert_eq!(fs::read(output.join(name)).unwrap(), IMAGE, "{name}");
    }
}

#[test]
fn accessors_that_extensions_name_keep_their_numbers() {
    let folder = TempDir::new().unwrap();
    let (input, output) = (folder.path().join("world.glb"), folder.path().join("out"));
    let (mut json, binary) = scene();
    // Outlines of both meshes, as CESIUM_primitive_outline names them.
    for mesh in 0..2 {
        let indices = json["meshes"][mesh]["primitives"][0]["indices"].clone();
        json["meshes"][mesh]["primitives"][0]["extensions"] =
            json!({ "CESIUM_primitive_outline": { "indices": indices } });
    }
    fs::write(&input, glb(&json, &binary)).unwrap();
    let baked = bake(&input, &output);
    assert!(baked.status.success(), "{baked:?}");
    let said = String::from_utf8(baked.stdout).unwrap();
    assert!(said.contains("CESIUM_primitive_outline"), "{said}");
    let bytes = fs::read(output.join("world.glb")).unwrap();
    let (written, data) = parts(&bytes);
    let large = &written["meshes"][0]["primitives"][0];
    assert_eq!(large["extensions"], json!({}));
    let small = &written["meshes"][1]["primitives"][0];
    assert_eq!(small, &json["meshes"][1]["primitives"][0]);
    let [accessor, source] = [&written, &json].map(|json| json["accessors"][3].clone());
    assert_eq!(accessor, source);
    let view = &written["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let start = view["byteOffset"].as_u64().unwrap() as usize;
    let length = view["byteLength"].as_u64().unwrap() as usize;
    assert_eq!(data[start..start + length], grid(20)[1]);
}

#[test]
fn stand_ins_keep_all_attributes() {
    let folder = TempDir::new().unwrap();
    let (input, output) = (folder.path().join("world.glb"), folder.path().join("out"));
    let (mut json, mut binary) = scene();
    for (name, kind, width) in [
        ("TEXCOORD_1", "VEC2", 2),
        ("TANGENT", "VEC4", 4),
        ("COLOR_0", "VEC4", 4),
    ] {
        let count = 129 * 129;
        let floats: Vec<u8> = [1.0f32]
            .repeat(count * width)
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let view = json["bufferViews"].as_array().unwrap().len();
        let accessor = json["accessors"].as_array().unwrap().len();
        let place = json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": floats.len() });
        json["bufferViews"].as_array_mut().unwrap().push(place);
        let place =
            json!({ "bufferView": view, "componentType": 5126, "type": kind, "count": count });
        json["accessors"].as_array_mut().unwrap().push(place);
        json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
        binary.extend(floats);
    }
    json["buffers"][0]["byteLength"] = json!(binary.len());
    fs::write(&input, glb(&json, &binary)).unwrap();
    let baked = bake(&input, &output);
    assert!(baked.status.success(), "{baked:?}");
    let mesh = &import_gltf(&output.join("world.glb")).unwrap().primitives[0].mesh;
    let count = mesh.positions.len();
    assert!(count < 200, "{count}");
    assert_eq!(
        [mesh.uvs_1.len(), mesh.tangents.len(), mesh.colors.len()],
        [count; 3]
    );
}
