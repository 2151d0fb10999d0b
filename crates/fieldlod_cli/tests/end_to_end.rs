//! The `fieldlod` program.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{FLOAT, Glb, assert_fails, fieldlod, output, push, text};
use serde_json::{Value, json};
use tempfile::TempDir;

/// Writes a flat grid of `2 · cells²` triangles, and its vertices as points.
fn grid_glb(folder: &Path, cells: u32) -> PathBuf {
    let mut file = Glb::new();
    let mut grid = file.add_grid(cells);
    let count = ((cells + 1) * (cells + 1)) as usize;
    let up = [0.0f32, 1.0, 0.0].map(f32::to_le_bytes).concat();
    grid["attributes"]["NORMAL"] = json!(file.add(&up.repeat(count), FLOAT, "VEC3", count));
    let points = json!({ "attributes": grid["attributes"], "mode": 0 });
    file.json["meshes"] = json!([{ "name": "grid", "primitives": [grid, points] }]);
    let path = folder.join("grid.glb");
    file.write(&path);
    path
}

/// Changes the JSON of a file.
fn change(path: &Path, change: impl FnOnce(&mut Value)) {
    let mut file = Glb::read(path);
    change(&mut file.json);
    file.write(path);
}

#[test]
fn bake_writes_file_that_inspect_reads() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 64);
    let output = folder.path().join("grid.fieldlod");

    let bake = fieldlod(&["bake", text(&input), "-o", text(&output)]);
    assert!(bake.status.success(), "{bake:?}");
    // Without a terminal, no progress is printed.
    assert!(bake.stderr.is_empty(), "{bake:?}");
    let shown = String::from_utf8(bake.stdout).unwrap();
    assert!(shown.contains("8,192 triangles to "), "{shown}");
    let skipped = "skipped: mesh 0 (\"grid\"), primitive 1";
    assert!(shown.contains(skipped), "{shown}");
    let shown = self::output(&["inspect", text(&output)]);
    let expected = "mesh 0 (\"grid\"), primitive 0: 8,192 triangles";
    assert!(shown.contains(expected), "{shown}");
    // No temporary file remains.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
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

    let shown = output(&["bake", text(&input)]);
    let warning = format!(
        "warning: {}: image 0 (\"leaves.ktx2\") is ignored: it is neither PNG nor JPEG",
        input.display()
    );
    assert!(shown.contains(&warning), "{shown}");
}

#[test]
fn json_is_one_object_on_standard_output() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 64);
    let report: Value = serde_json::from_str(&output(&["bake", "--json", text(&input)])).unwrap();
    assert_eq!(report["source_triangles"], 8_192);
    let bake = &report["bakes"][0];
    assert_eq!(bake["stuck"], false);
    assert_eq!(bake["coarsest_triangles"], report["coarsest_triangles"]);
    assert_eq!(bake["fallbacks"], json!([]));
    assert_eq!(
        report["skipped"][0]["reason"],
        "it is made of points or lines"
    );
    let file = input.with_extension("fieldlod");
    assert_eq!(report["bytes"], fs::metadata(&file).unwrap().len());

    let inspected = output(&["inspect", text(&file), "--json"]);
    let inspected: Value = serde_json::from_str(&inspected).unwrap();
    assert_eq!(inspected["primitives"], report["primitives"]);
    let levels = inspected["primitives"][0]["levels"].as_array().unwrap();
    assert_eq!(levels[0]["triangles"], 8_192);
    assert!(levels[0]["error_in_local"]["max"].is_number());
}

#[test]
fn verify_passes_a_bake_and_rejects_another_mesh() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 48);
    let file = input.with_extension("fieldlod");
    output(&["bake", text(&input)]);
    let report = output(&["verify", "--json", text(&input), text(&file)]);
    let report: Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["passed"], true);
    assert_eq!(report["primitives"][0]["cuts"], 200);

    grid_glb(folder.path(), 47);
    assert_verify_fails(&input, &file, "it was baked from another mesh");
}

/// Writes a barrel and a label on it as two meshes.
fn labelled_glb(folder: &Path) -> PathBuf {
    let mut file = Glb::new();
    let mut wall = |cells: u32, turns: [f32; 2], heights: [f32; 2], radius: f32| {
        let part =
            |share: u32, [from, to]: [f32; 2]| from + (to - from) * share as f32 / cells as f32;
        let side = cells + 1;
        let vertices = (0..side * side).map(|i| {
            let (sin, cos) = (part(i / side, turns) * std::f32::consts::TAU).sin_cos();
            let height = part(i % side, heights);
            ([cos * radius, height, sin * radius], [cos, 0.0, sin])
        });
        let (positions, normals): (Vec<_>, Vec<_>) = vertices.unzip();
        let mut primitive = file.add_grid(cells);
        for (name, values) in [("POSITION", positions), ("NORMAL", normals)] {
            let bytes: Vec<u8> = values
                .iter()
                .flatten()
                .flat_map(|x| x.to_le_bytes())
                .collect();
            primitive["attributes"][name] = json!(file.add(&bytes, FLOAT, "VEC3", values.len()));
        }
        json!({ "primitives": [primitive] })
    };
    let barrel = wall(40, [0.0, 1.0], [0.0, 3.0], 1.0);
    let label = wall(16, [0.1, 0.4], [0.8, 2.0], 1.003);
    file.json["meshes"] = json!([barrel, label]);
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1 }]);
    let path = folder.join("labelled.glb");
    file.write(&path);
    path
}

#[test]
fn verify_finds_layers_that_another_mesh_swallows() {
    let folder = TempDir::new().unwrap();
    let input = labelled_glb(folder.path());
    let file = input.with_extension("fieldlod");
    output(&["bake", text(&input)]);
    output(&["verify", text(&input), text(&file)]);
    // Apart, each mesh has levels of its own.
    change(&input, |json| {
        json["nodes"][1]["translation"] = json!([5, 0, 0]);
    });
    output(&["bake", text(&input)]);
    output(&["verify", text(&input), text(&file)]);
    change(&input, |json| {
        json["nodes"][1]["translation"] = json!([0, 0, 0]);
    });
    assert_verify_fails(&input, &file, "where it is");
}

fn assert_verify_fails(input: &Path, file: &Path, fault: &str) {
    let verify = fieldlod(&["verify", text(input), text(file)]);
    assert_eq!(verify.status.code(), Some(1));
    let shown = String::from_utf8(verify.stdout).unwrap();
    assert!(shown.contains(&format!("FAILED: {fault}")), "{shown}");
}

#[test]
fn rejects_bad_input_files_in_one_line() {
    let folder = TempDir::new().unwrap();
    let path = grid_glb(folder.path(), 4);
    let mut file = Glb::read(&path);
    file.binary[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    file.write(&path);
    let nan = fs::read(&path).unwrap();
    for (name, bytes, fault) in [
        ("text.glb", &b"hello"[..], "not a glTF file"),
        ("cut.glb", &nan[..99], "truncated: the file ends after"),
        (
            "nan.glb",
            &nan,
            "mesh 0 (\"grid\"), primitive 0: vertex 0 lies at [NaN, 0, 0]",
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
    stale[8] = 1;
    let mut corrupt = whole.clone();
    corrupt[100] ^= 1;
    let cut = &whole[..whole.len() / 2];
    for (bytes, fault) in [
        (&b""[..], "not a .fieldlod file"),
        (
            &stale,
            "format version 1, but this program reads version 2: bake again",
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
        self::output(&arguments);
        fs::read(&output).unwrap()
    };
    let (lossless, quantized) = (bake(&[]), bake(&["--quantize"]));
    assert!(quantized.len() < lossless.len());
    let shown = self::output(&["inspect", text(&output)]);
    let expected = "quantized: positions differ by up to ";
    assert!(shown.contains(expected), "{shown}");
    assert!(bake(&[]) == lossless && bake(&["--quantize"]) == quantized);
}

#[test]
fn files_in_pages_are_inspected() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 100);
    let output = folder.path().join("grid.fieldpages");
    for quantize in [&[][..], &["--quantize"]] {
        self::output(&[&["bake", text(&input), "--pages"], quantize].concat());
        let report = self::output(&["inspect", text(&output), "--json"]);
        let report: Value = serde_json::from_str(&report).unwrap();
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
    assert_fails(&verify, &output, "corrupt: wrong checksum");
}

#[test]
fn pages_are_verified() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 100);
    let output = folder.path().join("grid.fieldpages");
    for quantize in [&[][..], &["--quantize"]] {
        self::output(&[&["bake", text(&input), "--pages"], quantize].concat());
        let report = self::output(&["verify", "--json", text(&input), text(&output)]);
        let report: Value = serde_json::from_str(&report).unwrap();
        assert_eq!(report["primitives"][0]["cuts"], 200, "{report}");
        assert_eq!(report["primitives"].as_array().unwrap().len(), 1);
    }
    grid_glb(folder.path(), 99);
    assert_verify_fails(&input, &output, "it was baked from another mesh");
}

#[test]
fn quantized_files_pass_verification() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 40);
    let mut file = Glb::read(&input);
    // Multiples of 0.3 are on no grid.
    let positions = file.binary[..41 * 41 * 12].as_chunks_mut::<4>().0;
    for number in positions {
        *number = (f32::from_le_bytes(*number) * 0.3).to_le_bytes();
    }
    file.write(&input);
    output(&["bake", "--quantize", text(&input)]);
    output(&[
        "verify",
        text(&input),
        text(&input.with_extension("fieldlod")),
    ]);
}

/// Only regular files are replaced.
#[cfg(unix)]
#[test]
fn outputs_that_are_links_or_pipes_stay() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 8);
    let at = |name: &str| folder.path().join(name);
    let bake = |name: &str| output(&["bake", text(&input), "-o", text(&at(name))]);
    bake("plain");
    let expected = fs::read(at("plain")).unwrap();
    for (link, target) in [("to_old", "old"), ("to_new", "new")] {
        std::os::unix::fs::symlink(target, at(link)).unwrap();
    }
    fs::write(at("old"), "old").unwrap();
    for (link, target) in [("to_old", "old"), ("to_new", "new")] {
        bake(link);
        assert!(at(link).is_symlink() && fs::read(at(target)).unwrap() == expected);
    }
    let pipe = at("pipe");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read(pipe).unwrap()
    });
    bake("pipe");
    assert!(reader.join().unwrap() == expected && !pipe.is_file());
}

/// A killed bake leaves the old file or the complete new file.
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
fn faulty_primitives_are_skipped_unless_strict() {
    let folder = TempDir::new().unwrap();
    let input = grid_glb(folder.path(), 32);
    // A third primitive, whose number of indices is not a multiple of 3.
    change(&input, |json| {
        let mut indices = json["accessors"][1].clone();
        indices["count"] = json!(3 * 64 - 1);
        let mut bad = json["meshes"][0]["primitives"][0].clone();
        bad["indices"] = json!(push(&mut json["accessors"], indices));
        push(&mut json["meshes"][0]["primitives"], bad);
    });
    let output = folder.path().join("grid.fieldlod");
    let fault = "primitive 2: the number of indices, 191, is not a multiple of 3";
    assert_fails(&["bake", "--strict", text(&input)], &input, fault);
    assert!(!output.exists());
    let shown = self::output(&["bake", text(&input)]);
    assert!(shown.contains(fault), "{shown}");
    self::output(&["verify", text(&input), text(&output)]);
}

#[test]
fn coarse_grids_of_quantized_positions_are_reported() {
    let folder = TempDir::new().unwrap();
    for (cells, is_coarse) in [(8, false), (100, true)] {
        let input = grid_glb(folder.path(), cells);
        let shown = output(&["bake", "--quantize", text(&input)]);
        assert_eq!(shown.contains("of the median edge"), is_coarse, "{shown}");
    }
}

/// Writes the grid with two joints. The second moves vertices with x > 12, with weight `last` at the last vertex.
fn skinned_glb(folder: &Path, last: f32) -> PathBuf {
    let mut file = Glb::read(&grid_glb(folder, 24));
    let count = 25 * 25;
    let weight = |vertex: usize| f32::from(u8::from(vertex / 25 > 12));
    let mut weights: Vec<f32> = (0..count).map(weight).collect();
    weights[count - 1] = last;
    let weights = weights.iter().flat_map(|w| [1.0 - w, *w, 0.0, 0.0]);
    let weights: Vec<u8> = weights.flat_map(f32::to_le_bytes).collect();
    let joints = file.add(&[0u8, 1, 0, 0].repeat(count), 5121, "VEC4", count);
    let weights = file.add(&weights, FLOAT, "VEC4", count);
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    file.json["skins"] = json!([{ "joints": [1, 2] }]);
    file.json["nodes"] =
        json!([{ "mesh": 0, "skin": 0 }, { "name": "a", "children": [2] }, { "name": "b" }]);
    let path = folder.join("skinned.glb");
    file.write(&path);
    path
}

#[test]
fn verify_checks_skinned_meshes_in_poses() {
    let folder = TempDir::new().unwrap();
    let input = skinned_glb(folder.path(), 1.0);
    let file = input.with_extension("fieldlod");
    output(&["bake", text(&input)]);
    let inspected = output(&["inspect", text(&file)]);
    assert!(
        inspected.contains("skinned: joint 0 places it"),
        "{inspected}"
    );
    let report = output(&["verify", "--json", text(&input), text(&file)]);
    let report: Value = serde_json::from_str(&report).unwrap();
    let posed = &report["primitives"][0]["posed"];
    // The bind pose, the rest pose, and the second joint bent about each axis in both directions.
    assert_eq!(posed["poses"], 8, "{report}");
    let number = |value: &Value| value.as_f64().unwrap();
    let share = number(&posed["share"]);
    assert!(share > 0.1 && share <= 1.0, "{report}");
    let bounds = [0, 1, 2].map(|angle| number(&posed["bounds"][angle]));
    assert!(bounds.is_sorted() && bounds[0] > 0.0, "{report}");

    skinned_glb(folder.path(), 0.5);
    assert_verify_fails(&input, &file, "it was baked from another mesh");
}

#[test]
fn rejects_foreign_clips_and_characters_in_pages() {
    let folder = TempDir::new().unwrap();
    let input = skinned_glb(folder.path(), 1.0);
    let other = grid_glb(folder.path(), 4);
    let fault = "no animation moves a node of the baked file";
    assert_fails(
        &["bake", text(&input), "--clips", text(&other)],
        &other,
        fault,
    );
    let fault = "mesh 0 (\"grid\"), primitive 0: pages cannot hold skinned or morphed meshes";
    assert_fails(&["bake", "--pages", text(&input)], &input, fault);
}
