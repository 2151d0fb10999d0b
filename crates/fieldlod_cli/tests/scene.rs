//! `bake --scene`: a folder with a scene and its files.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{FLOAT, Glb, assert_fails, fieldlod, grid, output, text};
use fieldlod_bake::import_gltf;
use fieldlod_hierarchy::{BakedFile, PagedFile};
use serde_json::{Value, json};
use tempfile::TempDir;

fn arguments<'a>(input: &'a Path, folder: &'a Path) -> [&'a str; 7] {
    let (input, folder) = (text(input), text(folder));
    ["bake", "--scene", "--preset", "fast", "-o", folder, input]
}

fn bake(input: &Path, folder: &Path) -> String {
    output(&arguments(input, folder))
}

const IMAGE: &[u8] = b"contents of an image";

/// A scene of a large and a small grid, an animation and an image.
fn scene() -> Glb {
    let mut file = Glb::new();
    let (mut large, small) = (file.add_grid(128), file.add_grid(20));
    large["material"] = json!(0);
    large["extras"] = json!({ "of": "the game" });
    let times = [0.0f32, 1.0].map(f32::to_le_bytes).concat();
    let times = file.add(&times, FLOAT, "SCALAR", 2);
    let moves = file.add(&[0; 24], FLOAT, "VEC3", 2);
    let image = file.add_view(IMAGE);
    let json = json!({
        "images": [{ "bufferView": image, "mimeType": "image/png" }],
        "textures": [{ "source": 0 }],
        "materials": [{ "name": "stone", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "meshes": [{ "name": "ground", "primitives": [large] }, { "name": "tile", "primitives": [small] }],
        "nodes": [{ "mesh": 0, "translation": [1, 2, 3], "children": [1] }, { "mesh": 1, "name": "door", "translation": [0, 5, 0] }],
        "animations": [{
            "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
            "samplers": [{ "input": times, "output": moves }],
        }],
        "scenes": [{ "nodes": [0] }],
        "scene": 0,
    });
    let all = file.json.as_object_mut().unwrap();
    all.extend(json.as_object().unwrap().clone());
    file
}

/// A folder, the path of a scene in it, and a path for its bake.
fn paths() -> (TempDir, PathBuf, PathBuf) {
    let folder = TempDir::new().unwrap();
    let [input, output] = ["world.glb", "world"].map(|name| folder.path().join(name));
    (folder, input, output)
}

#[test]
fn scene_keeps_everything_except_large_meshes() {
    let (_folder, input, output) = paths();
    let mut source = scene();
    source.write(&input);
    bake(&input, &output);

    let written = Glb::read(&output.join("world.glb"));
    let (json, old) = (&written.json, &source.json);
    for kept in ["nodes", "materials", "scenes", "textures", "animations"] {
        assert_eq!(json[kept], old[kept], "{kept}");
    }
    let ground = &json["meshes"][0]["primitives"][0];
    assert_eq!(ground["material"], 0);
    let place =
        json!({ "pages": "world.fieldpages", "mesh": 0, "primitive": 0, "triangles": 32_768 });
    let extras = json!({ "of": "the game", "fieldlod": place });
    assert_eq!(ground["extras"], extras);
    let times = old["animations"][0]["samplers"][0]["input"].as_u64();
    let times = times.unwrap() as usize;
    assert_eq!(json["accessors"][times], old["accessors"][times]);
    assert_eq!(written.view(&json["images"][0]["bufferView"]), IMAGE);
    let sizes = [written.binary.len(), source.binary.len()];
    assert!(sizes[0] * 10 < sizes[1], "{sizes:?}");

    // The large mesh is its coarsest level, and the small mesh is unchanged.
    let again = import_gltf(&output.join("world.glb")).unwrap().primitives;
    let triangles = [0, 1].map(|index: usize| again[index].mesh.triangle_count());
    assert!(triangles[0] < 100 && triangles[1] == 800, "{triangles:?}");
    let pages = fs::read(output.join("world.fieldpages")).unwrap();
    let pages = PagedFile::from_contents(&pages).unwrap();
    assert_eq!(pages.meshes[0].graph.source_triangle_count(), 32_768);
    assert_eq!(pages.meshes.len(), 1);
    let small = fs::read(output.join("world.fieldlod")).unwrap();
    let small = BakedFile::from_bytes(&small).unwrap();
    assert!(small.find(1, 0).is_some() && small.find(0, 0).is_none());
}

/// The large mesh is in pages. The scene itself has only its coarsest level.
#[test]
fn scenes_are_verified_with_their_pages() {
    let (_folder, input, folder) = paths();
    scene().write(&input);
    for quantize in [&[][..], &["--quantize"]] {
        output(&[&arguments(&input, &folder)[..], quantize].concat());
        for file in ["world.fieldlod", "world.fieldpages"] {
            let file = folder.join(file);
            let report = output(&["verify", "--json", text(&input), text(&file)]);
            let report: Value = serde_json::from_str(&report).unwrap();
            let cuts = [0, 1].map(|index| report["primitives"][index]["cuts"].clone());
            assert_eq!(cuts, [200, 200], "{report}");
        }
        let (scene, levels) = (folder.join("world.glb"), folder.join("world.fieldlod"));
        let report = output(&["verify", text(&scene), text(&levels)]);
        assert!(report.contains("in pages; verify them against"), "{report}");
    }
    fs::remove_file(folder.join("world.fieldpages")).unwrap();
    let levels = folder.join("world.fieldlod");
    let verify = fieldlod(&["verify", text(&input), text(&levels)]);
    assert_eq!(verify.status.code(), Some(1));
}

#[test]
fn scene_errors_name_the_file() {
    let (folder, input, output) = paths();
    let mut file = scene();
    file.write(&input);
    let fault = "would overwrite the file it is baked from";
    assert_fails(&arguments(&input, folder.path()), &input, fault);
    file.json["images"] = json!([{ "uri": "../stone.png" }]);
    file.write(&input);
    let image = folder.path().join("../stone.png");
    let fault = "could not be copied: it is outside the folder of the scene";
    assert_fails(&arguments(&input, &output), &image, fault);
}

/// Simulates a full disk: no file can grow beyond 32 kB.
#[cfg(unix)]
#[test]
fn full_disk_leaves_no_partial_files() {
    let (folder, input, _) = paths();
    let mut file = scene();
    file.json["images"] = json!([{ "uri": "stone.png" }]);
    file.write(&input);
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
        let shown = String::from_utf8(baked.stderr).unwrap();
        let expected = format!(
            "error: {}: could not be written: File too large",
            failed.display()
        );
        assert!(shown.starts_with(&expected), "{shown}");
        assert_eq!(shown.lines().count(), 1, "{shown}");
        let left = fs::read_dir(failed.parent().unwrap()).unwrap();
        let left: Vec<_> = left.map(|entry| entry.unwrap().file_name()).collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

/// Writes a grid with quantized and compressed positions.
fn write_packed_scene(path: &Path, cells: u32) {
    let side = cells + 1;
    let corners = (0..side * side).map(|i| [i / side, i % side]);
    let words: Vec<[u32; 2]> = corners.collect();
    let packed = meshopt::encode_vertex_buffer(&words).unwrap();
    let mut file = Glb::new();
    let mut grid = file.add_grid(cells);
    let view = file.add_view(&packed);
    let mut place = file.json["bufferViews"][view].clone();
    place["mode"] = json!("ATTRIBUTES");
    (place["byteStride"], place["count"]) = (json!(8), json!(words.len()));
    file.json["bufferViews"][view] = json!({ "buffer": 1, "byteLength": words.len() * 8,
        "byteStride": 8, "extensions": { "EXT_meshopt_compression": place } });
    let positions = json!({ "bufferView": view, "componentType": 5122, "type": "VEC3",
        "count": words.len(), "min": [0, 0, 0], "max": [cells, 0, cells] });
    grid["attributes"]["POSITION"] = json!(common::push(&mut file.json["accessors"], positions));
    let names = json!(["EXT_meshopt_compression", "KHR_mesh_quantization"]);
    (file.json["extensionsRequired"], file.json["extensionsUsed"]) = (names.clone(), names);
    let fallback = json!({ "EXT_meshopt_compression": { "fallback": true } });
    file.json["buffers"] = json!([{ "byteLength": file.binary.len() },
        { "byteLength": words.len() * 8, "extensions": fallback }]);
    file.json["meshes"] = json!([{ "primitives": [grid] }]);
    file.json["nodes"] = json!([{ "mesh": 0, "scale": [0.01, 0.01, 0.01] }]);
    file.write(path);
}

#[test]
fn packed_scenes_become_readable_for_bevy() {
    let (_folder, input, output) = paths();
    write_packed_scene(&input, 40);
    bake(&input, &output);
    let scene = output.join("world.glb");
    let json = Glb::read(&scene).json;
    assert!(json.get("extensionsRequired").is_none() && json.get("extensionsUsed").is_none());
    let positions = &json["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
    let positions = &json["accessors"][positions.as_u64().unwrap() as usize];
    assert_eq!(positions["componentType"], FLOAT);
    assert_eq!(json["nodes"][0]["scale"], json!([0.01, 0.01, 0.01]));
    // The levels are baked from the meshes of the written scene.
    let mesh = &import_gltf(&scene).unwrap().primitives[0].mesh;
    let levels = fs::read(output.join("world.fieldlod")).unwrap();
    let levels = BakedFile::from_bytes(&levels).unwrap();
    let baked = &levels.find(0, 0).unwrap().hierarchy;
    assert_eq!(baked.source, mesh.source_hash());
    assert_eq!(mesh.triangle_count(), 3_200);
}

#[test]
fn images_are_copied_with_the_scene() {
    let (folder, input, output) = paths();
    let mut file = scene();
    file.json["images"] = json!([{ "uri": "my%20picture.png" }, { "uri": "./dot.png" }, { "uri": "DATA:image/png;base64,AA==" }]);
    file.write(&input);
    fs::write(folder.path().join("dot.png"), IMAGE).unwrap();
    let missing = folder.path().join("my picture.png");
    assert_fails(&arguments(&input, &output), &missing, "No such file");
    assert!(!output.exists(), "an error leaves no folder");
    fs::write(missing, IMAGE).unwrap();
    bake(&input, &output);
    for name in ["my picture.png", "dot.png"] {
        assert_eq!(fs::read(output.join(name)).unwrap(), IMAGE, "{name}");
    }
}

#[test]
fn accessors_of_extensions_keep_their_indices() {
    let (_folder, input, output) = paths();
    let mut file = scene();
    // CESIUM_primitive_outline refers to accessors of both meshes.
    for mesh in 0..2 {
        let primitive = &mut file.json["meshes"][mesh]["primitives"][0];
        let outline = json!({ "indices": primitive["indices"] });
        primitive["extensions"] = json!({ "CESIUM_primitive_outline": outline });
    }
    file.write(&input);
    let shown = bake(&input, &output);
    assert!(shown.contains("CESIUM_primitive_outline"), "{shown}");
    let written = Glb::read(&output.join("world.glb"));
    let primitive = |json: &Value, mesh: usize| json["meshes"][mesh]["primitives"][0].clone();
    assert_eq!(primitive(&written.json, 0)["extensions"], json!({}));
    let small = primitive(&written.json, 1);
    assert_eq!(small, primitive(&file.json, 1));
    let index = small["indices"].as_u64().unwrap() as usize;
    let accessor = &written.json["accessors"][index];
    assert_eq!(accessor, &file.json["accessors"][index]);
    assert_eq!(written.view(&accessor["bufferView"]), grid(20)[1]);
}

#[test]
fn coarsest_levels_in_scenes_keep_all_attributes() {
    let (_folder, input, output) = paths();
    let mut file = scene();
    let count = 129 * 129;
    for (name, kind, width) in [
        ("TEXCOORD_1", "VEC2", 2),
        ("TANGENT", "VEC4", 4),
        ("COLOR_0", "VEC4", 4),
    ] {
        let floats = 1f32.to_le_bytes().repeat(count * width);
        let accessor = file.add(&floats, FLOAT, kind, count);
        file.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    }
    file.write(&input);
    bake(&input, &output);
    let scene = import_gltf(&output.join("world.glb")).unwrap();
    let mesh = &scene.primitives[0].mesh;
    let count = mesh.positions.len();
    assert!(count < 200, "{count}");
    let counts = [mesh.uvs_1.len(), mesh.tangents.len(), mesh.colors.len()];
    assert_eq!(counts, [count; 3]);
}

#[test]
fn quantized_levels_fit_the_exact_vertices_of_the_scene() {
    let (_folder, input, output) = paths();
    let mut file = scene();
    // Multiples of 0.3 differ from their quantized values.
    let view = &file.json["bufferViews"][0];
    let [start, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap());
    let bytes = &mut file.binary[start as usize..][..length as usize];
    for number in bytes.as_chunks_mut::<4>().0 {
        *number = (f32::from_le_bytes(*number) * 0.3).to_le_bytes();
    }
    file.write(&input);
    let options = ["--quantize", "--large-from", "1000000"];
    common::output(&[&arguments(&input, &output)[..], &options].concat());
    let mesh = &import_gltf(&output.join("world.glb")).unwrap().primitives[0].mesh;
    let levels = fs::read(output.join("world.fieldlod")).unwrap();
    // Reading validates bounds around the rounded vertices.
    let levels = BakedFile::from_bytes(&levels).unwrap();
    let baked = &levels.find(0, 0).unwrap().hierarchy;
    assert_eq!(baked.source, mesh.source_hash());
}
