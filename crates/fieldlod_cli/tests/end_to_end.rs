//! The program on the command line.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use fieldlod_bake::SourceMesh;
use fieldlod_hierarchy::Vertices;
use glam::Vec3;
use serde_json::{Value, json};
use tempfile::TempDir;

fn fieldlod(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fieldlod"))
        .args(arguments)
        .output()
        .unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A flat grid of `2 · cells²` triangles as a GLB.
fn grid_glb(folder: &Path, cells: u32) -> PathBuf {
    let side = cells + 1;
    let corner = |i: u32| Vec3::new((i / side) as f32, 0.0, (i % side) as f32);
    let quads = (0..cells * cells).map(|q| q / cells * side + q % cells);
    let triangles = quads.flat_map(|a| [a, a + 1, a + side, a + side, a + 1, a + side + 1]);
    let path = folder.join("grid.glb");
    let positions: Vec<Vec3> = (0..side * side).map(corner).collect();
    let grid = SourceMesh {
        vertices: Vertices {
            normals: vec![Vec3::Y; positions.len()],
            positions,
            ..Vertices::default()
        },
        indices: triangles.collect(),
        ..SourceMesh::default()
    };
    write_glb(&path, &grid);
    path
}

/// The triangles of a mesh with their normals, and then its vertices as points.
fn write_glb(path: &Path, mesh: &SourceMesh) {
    let count = mesh.positions.len();
    let least = mesh.positions.iter().copied().reduce(Vec3::min).unwrap();
    let most = mesh.positions.iter().copied().reduce(Vec3::max).unwrap();
    let (min, max) = (least.to_array(), most.to_array());
    let bytes = |vectors: &[Vec3]| -> Vec<u8> {
        let numbers = vectors.iter().flat_map(Vec3::to_array);
        numbers.flat_map(f32::to_le_bytes).collect()
    };
    let (positions, normals) = (bytes(&mesh.positions), bytes(&mesh.normals));
    let indices = mesh.indices.iter().flat_map(|index| index.to_le_bytes());
    let indices: Vec<u8> = indices.collect();
    let (p, n, i) = (positions.len(), normals.len(), indices.len());
    let json = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": p + n + i }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": p },
            { "buffer": 0, "byteOffset": p, "byteLength": n },
            { "buffer": 0, "byteOffset": p + n, "byteLength": i },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": count,
              "min": min, "max": max },
            { "bufferView": 1, "componentType": 5126, "type": "VEC3", "count": count },
            { "bufferView": 2, "componentType": 5125, "type": "SCALAR", "count": i / 4 },
        ],
        "meshes": [{ "name": "grid", "primitives": [
            { "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2 },
            { "attributes": { "POSITION": 0, "NORMAL": 1 }, "mode": 0 },
        ] }],
    });
    fs::write(path, glb(&json, &[positions, normals, indices].concat())).unwrap();
}

/// Changes the JSON of a file.
fn change(path: &Path, change: impl FnOnce(&mut Value)) {
    let bytes = fs::read(path).unwrap();
    let binary = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&bytes[20..binary]).unwrap();
    change(&mut json);
    fs::write(path, glb(&json, &bytes[binary + 8..])).unwrap();
}

fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(
        [2, length as u32, json.len() as u32]
            .iter()
            .flat_map(|n| n.to_le_bytes()),
    );
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

#[test]
fn bakes_and_inspects() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 64);
    let output = folder.path().join("grid.fieldlod");

    let bake = fieldlod(&["bake", text(&input), "-o", text(&output)]);
    assert!(bake.status.success(), "{bake:?}");
    let said = String::from_utf8(bake.stdout).unwrap();
    assert!(said.contains("8,192 triangles to "), "{said}");
    assert!(
        said.contains("skipped: mesh 0 (\"grid\"), primitive 1"),
        "{said}"
    );
    assert!(
        bake.stderr.is_empty(),
        "progress where there is no terminal"
    );

    let inspect = fieldlod(&["inspect", text(&output)]);
    assert!(inspect.status.success());
    let said = String::from_utf8(inspect.stdout).unwrap();
    assert!(
        said.contains("mesh 0 (\"grid\"), primitive 0: 8,192 triangles"),
        "{said}"
    );

    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 2, "a temporary file was left");
}

#[test]
fn unreadable_images_are_named() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 16);
    change(&input, |json| {
        json["images"] = json!([{ "uri": "leaves.ktx2" }]);
        json["textures"] = json!([{ "source": 0 }]);
        json["materials"] =
            json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
        json["meshes"][0]["primitives"][0]["material"] = json!(0);
    });
    fs::write(folder.path().join("leaves.ktx2"), "KTX").unwrap();

    let bake = fieldlod(&["bake", text(&input)]);
    assert!(bake.status.success(), "{bake:?}");
    let said = String::from_utf8(bake.stdout).unwrap();
    let warning = format!(
        "warning: {}: image 0 (\"leaves.ktx2\") is ignored: it is neither PNG nor JPEG",
        input.display()
    );
    assert!(said.contains(&warning), "{said}");
}

#[test]
fn json_is_one_object_on_standard_output() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 64);
    let bake = fieldlod(&["bake", "--json", text(&input)]);
    let report: Value = serde_json::from_slice(&bake.stdout).unwrap();
    assert_eq!(report["source_triangles"], 8_192);
    let bake = &report["bakes"][0];
    assert_eq!(bake["stuck"], false);
    assert_eq!(bake["coarsest_triangles"], report["coarsest_triangles"]);
    assert_eq!(bake["fallbacks"], json!([]));
    assert_eq!(
        report["skipped"][0]["reason"],
        "it is made of points or lines"
    );
    let output = input.with_extension("fieldlod");
    assert_eq!(report["bytes"], fs::metadata(&output).unwrap().len());

    let inspect = fieldlod(&["inspect", text(&output), "--json"]);
    let inspected: Value = serde_json::from_slice(&inspect.stdout).unwrap();
    assert_eq!(inspected["primitives"], report["primitives"]);
    let levels = inspected["primitives"][0]["levels"].as_array().unwrap();
    assert_eq!(levels[0]["triangles"], 8_192);
    assert!(levels[0]["error_in_local"]["max"].is_number());
}

#[test]
fn verify_passes_a_bake_and_fails_that_of_another_mesh() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 48);
    let output = input.with_extension("fieldlod");
    assert!(fieldlod(&["bake", text(&input)]).status.success());
    let verify = fieldlod(&["verify", "--json", text(&input), text(&output)]);
    assert_eq!(verify.status.code(), Some(0), "{verify:?}");
    let report: Value = serde_json::from_slice(&verify.stdout).unwrap();
    assert_eq!(report["passed"], true);
    assert_eq!(report["primitives"][0]["cuts"], 200);

    grid_glb(folder.path(), 47);
    let verify = fieldlod(&["verify", text(&input), text(&output)]);
    assert_eq!(verify.status.code(), Some(1));
    let said = String::from_utf8(verify.stdout).unwrap();
    assert!(
        said.contains("FAILED: it was baked from another mesh"),
        "{said}"
    );
}

/// Runs a command that must fail with one line that names the file and holds `fault`.
fn assert_fails(arguments: &[&str], file: &Path, fault: &str) {
    let output = fieldlod(arguments);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(output.stdout.is_empty(), "{output:?}");
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(
        said.starts_with(&format!("error: {}: ", file.display())),
        "{said}"
    );
    assert!(said.contains(fault), "{said}");
}

#[test]
fn rejects_bad_input_files_in_one_line() {
    let folder = TempDir::new().unwrap();
    let whole = fs::read(grid_glb(folder.path(), 4)).unwrap();
    let mut nan = whole.clone();
    let position = nan.len() - 4 * 4 * 6 * 4 - 25 * 24;
    nan[position..position + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut index = whole.clone();
    let last = index.len() - 4;
    index[last..].copy_from_slice(&25u32.to_le_bytes());
    for (name, bytes, fault) in [
        ("empty.glb", &b""[..], "the file is empty"),
        ("text.glb", b"hello", "not a glTF file"),
        (
            "cut.glb",
            &whole[..whole.len() - 7],
            "truncated: the file ends after",
        ),
        (
            "json.gltf",
            b"{\"asset\":{\"version\":\"2.0\"}}",
            "it has no meshes",
        ),
        ("bad.gltf", b"{\"asset\":", "not valid glTF: "),
        (
            "nan.glb",
            &nan,
            "mesh 0 (\"grid\"), primitive 0: vertex 0 lies at [NaN, 0, 0]",
        ),
        (
            "index.glb",
            &index,
            "index 95 is 25, but there are only 25 vertices",
        ),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        assert_fails(&["bake", text(&path)], &path, fault);
        assert!(!path.with_extension("fieldlod").exists());
    }
    let missing = folder.path().join("missing.glb");
    assert_fails(&["bake", text(&missing)], &missing, "could not be read: ");
    assert_fails(
        &["bake", text(folder.path())],
        folder.path(),
        "could not be read: ",
    );
}

#[test]
fn rejects_bad_fieldlod_files_in_one_line() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 8);
    let path = folder.path().join("grid.fieldlod");
    assert!(fieldlod(&["bake", text(&input)]).status.success());
    let whole = fs::read(&path).unwrap();
    let mut stale = whole.clone();
    stale[8] = 2;
    let mut corrupt = whole.clone();
    corrupt[100] ^= 1;
    let cut = &whole[..whole.len() / 2];
    for (bytes, fault) in [
        (&b""[..], "not a .fieldlod file"),
        (
            &stale,
            "format version 2, but this program reads version 1: bake again",
        ),
        (&corrupt, "corrupt: wrong checksum"),
        (cut, "truncated: the file ends after"),
    ] {
        fs::write(&path, bytes).unwrap();
        assert_fails(&["inspect", text(&path)], &path, fault);
    }
    assert_fails(
        &["inspect", text(folder.path())],
        folder.path(),
        "could not be read: ",
    );
}

#[test]
fn rejects_outputs_that_cannot_be_written() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 4);
    let before = fs::read(&input).unwrap();
    for (output, fault) in [
        (folder.path().to_owned(), "it is a folder"),
        (folder.path().join("none/a.fieldlod"), "no such folder"),
        (input.clone(), "would overwrite the file it is baked from"),
    ] {
        assert_fails(&["bake", text(&input), "-o", text(&output)], &output, fault);
    }
    assert_eq!(fs::read(&input).unwrap(), before);
}

#[test]
fn quantized_files_are_smaller_and_deterministic() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 64);
    let output = input.with_extension("fieldlod");
    let bake = |arguments: &[&str]| {
        let arguments = [&["bake", text(&input)], arguments].concat();
        assert!(fieldlod(&arguments).status.success());
        fs::read(&output).unwrap()
    };
    let (lossless, quantized) = (bake(&[]), bake(&["--quantize"]));
    assert!(quantized.len() < lossless.len());
    let inspect = fieldlod(&["inspect", text(&output)]);
    let said = String::from_utf8(inspect.stdout).unwrap();
    assert!(
        said.contains("quantized: positions differ by up to "),
        "{said}"
    );
    assert!(bake(&[]) == lossless && bake(&["--quantize"]) == quantized);
}

#[test]
fn files_in_pages_are_inspected() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 100);
    let output = folder.path().join("grid.fieldpages");
    for quantize in [&[][..], &["--quantize"]] {
        let baked = fieldlod(&[&["bake", text(&input), "--pages"], quantize].concat());
        assert!(baked.status.success(), "{baked:?}");
        let inspected = fieldlod(&["inspect", text(&output), "--json"]);
        let report: Value = serde_json::from_slice(&inspected.stdout).unwrap();
        let bytes = fs::metadata(&output).unwrap().len();
        assert_eq!(report["bytes"], bytes);
        assert_eq!(report["meshes"][0]["source_triangles"], 20_000);
        assert!(report["meshes"][0]["pages"].as_u64().unwrap() > 2);
        assert!(report["contents_bytes"].as_u64().unwrap() * 4 < bytes);
    }
    // A truncated page and a corrupt page.
    let mut bytes = fs::read(&output).unwrap();
    let last = bytes.len() - 1;
    fs::write(&output, &bytes[..last]).unwrap();
    assert_fails(&["inspect", text(&output)], &output, "truncated");
    bytes[last] ^= 1;
    fs::write(&output, &bytes).unwrap();
    assert_fails(&["inspect", text(&output)], &output, "checksum");
    let verify = ["verify", text(&input), text(&output)];
    assert_fails(&verify, &output, "not a .fieldlod file");
}

#[test]
fn files_without_source_vertices_are_verified() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 64);
    let output = input.with_extension("fieldlod");
    for options in [&["--beside-source"][..], &["--beside-source", "--quantize"]] {
        let bake = fieldlod(&[&["bake", text(&input)], options].concat());
        assert!(bake.status.success(), "{bake:?}");
        let inspect = fieldlod(&["inspect", text(&output)]);
        let shown = String::from_utf8(inspect.stdout).unwrap();
        assert!(
            shown.contains("without the vertices of the source"),
            "{shown}"
        );
        let verify = fieldlod(&["verify", text(&input), text(&output)]);
        assert!(verify.status.success(), "{verify:?}");
    }
    // The grid of another size.
    let other = grid_glb(folder.path(), 32);
    let verify = fieldlod(&["verify", text(&other), text(&output)]);
    assert_eq!(verify.status.code(), Some(1), "{verify:?}");
    let shown = String::from_utf8(verify.stdout).unwrap();
    assert!(shown.contains("baked from another mesh"), "{shown}");
}

/// Whenever it is stopped, the file is the old one or the new one.
#[test]
fn stopped_bake_leaves_no_partial_file() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 200);
    let output = input.with_extension("fieldlod");
    fs::write(&output, b"old").unwrap();
    for wait_ms in [1, 30, 100] {
        let mut bake = Command::new(env!("CARGO_BIN_EXE_fieldlod"))
            .args(["bake", text(&input)])
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(wait_ms));
        bake.kill().unwrap();
        bake.wait().unwrap();
        let found = fs::read(&output).unwrap();
        let whole = found == b"old" || fieldlod(&["inspect", text(&output)]).status.success();
        assert!(whole, "{} bytes", found.len());
    }
}

#[test]
fn wrong_command_lines_exit_with_2() {
    for arguments in [
        &["bake"][..],
        &["bake", "a.glb", "--nope"],
        &["frobnicate"],
        &[],
    ] {
        assert_eq!(fieldlod(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn faulty_primitives_are_skipped_unless_the_bake_is_strict() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 32);
    // A second primitive whose triangles are no whole number.
    change(&input, |json| {
        let good = json["meshes"][0]["primitives"][0].clone();
        let mut indices = json["accessors"][2].clone();
        indices["count"] = json!(3 * 64 - 1);
        json["accessors"].as_array_mut().unwrap().push(indices);
        let mut bad = good;
        bad["indices"] = json!(3);
        json["meshes"][0]["primitives"]
            .as_array_mut()
            .unwrap()
            .push(bad);
    });
    let output = folder.path().join("grid.fieldlod");
    let strict = fieldlod(&["bake", "--strict", text(&input)]);
    assert_eq!(strict.status.code(), Some(1));
    let said = String::from_utf8(strict.stderr).unwrap();
    assert!(
        said.contains("primitive 2: 191 indices are not a whole number"),
        "{said}"
    );
    assert!(!output.exists());
    let bake = fieldlod(&["bake", text(&input)]);
    assert!(bake.status.success(), "{bake:?}");
    let said = String::from_utf8(bake.stdout).unwrap();
    assert!(
        said.contains("primitive 2: 191 indices are not a whole number"),
        "{said}"
    );
    let verify = fieldlod(&["verify", text(&input), text(&output)]);
    assert!(verify.status.success(), "{verify:?}");
}

#[test]
fn coarse_grids_of_rounded_positions_are_told_of() {
    let folder = TempDir::new().unwrap();
    for (cells, is_coarse) in [(8, false), (100, true)] {
        let input = grid_glb(folder.path(), cells);
        let bake = fieldlod(&["bake", "--quantize", text(&input)]);
        assert!(bake.status.success(), "{bake:?}");
        let said = String::from_utf8(bake.stdout).unwrap();
        assert_eq!(said.contains("of the median edge"), is_coarse, "{said}");
    }
}
