//! Faults of glTF files and their messages.

use std::path::{Path, PathBuf};

use crate::common::gltf_file::GltfFile;
use fieldlod_bake::{BakeConfig, BakeOutcome, ImportError, bake_file, fixtures};
use proptest::prelude::*;
use serde_json::{Value, json};

fn bake(path: &Path) -> Result<BakeOutcome, ImportError> {
    bake_file(path, &BakeConfig::default(), &|_| ())
}

/// A square: accessor and view 0 are positions, 1 normals, 2 texture coordinates, and 3 indices.
fn square() -> GltfFile {
    GltfFile::of(&fixtures::plane(2))
}

/// Checks that the error is one line that contains `expected`.
fn assert_rejects(case: &str, path: &Path, expected: &str) {
    let result = bake(path).map(|_| ());
    let message = result.expect_err(case).to_string();
    assert!(message.contains(expected), "{case}: {message}");
    assert!(!message.contains('\n'), "{case}: {message}");
}

#[test]
fn unreadable_files_are_rejected() {
    type Damage = fn(&mut GltfFile) -> PathBuf;
    let cases: [(&str, Damage, &str); 13] = [
        (
            "missing",
            |file| file.folder().join("none.glb"),
            "could not be read: ",
        ),
        ("folder", |file| file.folder().into(), "could not be read: "),
        (
            "empty",
            |file| file.write("a.glb", b""),
            "the file is empty",
        ),
        (
            "image",
            |file| file.write("a.glb", b"\x89PNG\r\n"),
            "not a glTF file",
        ),
        (
            "list",
            |file| file.write("a.gltf", b"  [1]"),
            "not a glTF file",
        ),
        (
            "cut JSON",
            |file| file.write("a.gltf", b"{ \"asset\": "),
            "not valid glTF: EOF",
        ),
        (
            "no asset",
            |file| file.write("a.gltf", b"{}"),
            "not valid glTF: missing field",
        ),
        (
            "version",
            |file| file.glb_with(4, &[1]),
            "glTF version 1, but only version 2",
        ),
        (
            "chunk type",
            |file| file.glb_with(16, b"NOPE"),
            "the GLB has no JSON chunk",
        ),
        (
            "no buffer",
            |file| file.gltf("gone.bin"),
            "buffer 0: \"gone.bin\" could not be read",
        ),
        (
            "remote",
            |file| file.gltf("https://example.org/a.bin"),
            "is not a file beside the glTF",
        ),
        (
            "base64",
            |file| file.gltf("data:a/b;base64,%%%"),
            "its data URI could not be decoded",
        ),
        (
            "no comma",
            |file| file.gltf("data:nothing"),
            "its data URI could not be decoded",
        ),
    ];
    for (case, damage, expected) in cases {
        let mut file = square();
        assert_rejects(case, &damage(&mut file), expected);
    }
    let mut file = square();
    file.write("short.bin", &file.binary[1..]);
    assert_rejects(
        "short buffer",
        &file.gltf("short.bin"),
        "buffer 0: truncated: ",
    );
    file.json["buffers"] = json!([{ "byteLength": 4 }]);
    let text = file.json.to_string();
    let path = file.write("a.gltf", text.as_bytes());
    assert_rejects(
        "no binary chunk",
        &path,
        "buffer 0: it has no URI, and the file has no binary chunk",
    );
}

#[test]
fn glb_files_cut_anywhere_are_rejected() {
    let mut file = square();
    let bytes = file.glb_bytes();
    for length in 4..bytes.len() {
        let path = file.write("cut.glb", &bytes[..length]);
        assert_rejects("cut", &path, "truncated: ");
    }
}

#[test]
fn damaged_json_is_rejected() {
    let outside = "reads outside its buffer";
    let skinned = json!([{ "mesh": 0, "skin": 0 }]);
    // The byte at 23 is 63, but there are 9 vertices.
    let sparse = json!({ "count": 1, "indices": { "bufferView": 0, "byteOffset": 23, "componentType": 5121 },
        "values": { "bufferView": 0 } });
    let zeros = json!({ "count": 1u64 << 31, "componentType": 5126, "type": "VEC3",
        "min": [0, 0, 0], "max": [0, 0, 0], "sparse": sparse });
    // The first primitive is abbreviated as `~`.
    let cases: Vec<(&str, Value, &str)> = vec![
        (
            "/asset/version",
            json!("1.0"),
            "glTF version 1.0, but only version 2",
        ),
        ("/meshes", json!([]), "it has no meshes"),
        (
            "/extensionsRequired",
            json!(["KHR_draco_mesh_compression"]),
            "--compress false",
        ),
        (
            "/extensionsRequired",
            json!(["VENDOR_unheard_of"]),
            "extension VENDOR_unheard_of",
        ),
        (
            "~/attributes/POSITION",
            json!(99),
            "attributes.POSITION: no such accessor",
        ),
        ("~/attributes", json!({}), "not valid glTF: "),
        ("~/indices", json!(99), "not valid glTF: "),
        ("/accessors/0/bufferView", json!(99), "not valid glTF: "),
        ("/bufferViews/0/buffer", json!(99), "not valid glTF: "),
        ("/accessors/0/count", json!(10), outside),
        ("/accessors/0/count", json!(1 << 20), outside),
        ("/accessors/1/byteOffset", json!(u64::MAX), outside),
        ("/accessors/0/sparse", sparse, outside),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), outside),
        ("/bufferViews/0/byteLength", json!(u64::MAX), outside),
        ("/bufferViews/0/byteLength", json!(7), outside),
        (
            "/bufferViews/0/byteStride",
            json!(4),
            "a stride of 4 for elements of 12 bytes",
        ),
        ("/accessors/0/count", json!(u64::MAX), "too many elements"),
        ("/accessors/0", zeros, "too many elements"),
        (
            "/accessors/3/componentType",
            json!(5126),
            "does not hold indices",
        ),
        (
            "/accessors/3/componentType",
            json!(5122),
            "does not hold indices",
        ),
        ("/accessors/3/type", json!("VEC2"), "does not hold indices"),
        ("~/mode", json!(0), "it is made of points or lines"),
        ("~/mode", json!(3), "it is made of points or lines"),
        (
            "/accessors/0/componentType",
            json!(5125),
            "a format that glTF does not allow",
        ),
        ("/accessors/3/count", json!(0), "it has no triangles"),
        (
            "/nodes",
            skinned,
            "its joints or weights are missing or in an unknown format",
        ),
    ];
    for (place, value, expected) in cases {
        let mut file = square();
        file.json["skins"] = json!([{ "joints": [0] }]);
        file.json["nodes"] = json!([{}]);
        let place = &place.replace('~', "/meshes/0/primitives/0");
        let (parent, key) = place.rsplit_once('/').unwrap();
        match file.json.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            object => object[key] = value,
        }
        assert_rejects(place, &file.glb(), expected);
    }
}

#[test]
fn extensions_without_geometry_are_accepted() {
    let mut file = square();
    file.json["extensionsRequired"] = json!(["KHR_texture_transform", "KHR_materials_unlit"]);
    bake(&file.glb()).unwrap();
}

#[test]
fn faulty_triangles_are_rejected() {
    let mut far = fixtures::plane(2);
    far.positions[5].y = f32::NAN;
    let expected = "mesh 0 (\"part\"), primitive 0: vertex 5 lies at ";
    assert_rejects("NaN", &GltfFile::of(&far).glb(), expected);
    let mut mesh = fixtures::plane(2);
    mesh.indices[7] = 1_000;
    let expected = "index 7 is 1000, but there are only 9 vertices";
    assert_rejects("with normals", &GltfFile::of(&mesh).glb(), expected);
    mesh.normals.clear();
    assert_rejects("without normals", &GltfFile::of(&mesh).glb(), expected);
}

/// A changed byte: its position as a share of the file, and a new value. Digits keep the JSON valid.
fn change() -> impl Strategy<Value = (u16, u8)> {
    let digit = || b'0'..=b'9';
    (any::<u16>(), prop_oneof![any::<u8>(), digit(), digit()])
}

proptest! {
    /// Any bytes give a result or an error.
    #[test]
    fn changed_bytes_never_panic(changes in prop::collection::vec(change(), 1..4)) {
        let mut file = square();
        let mut bytes = file.glb_bytes();
        for (place, value) in changes {
            let place = usize::from(place) * bytes.len() / (usize::from(u16::MAX) + 1);
            bytes[place] = value;
        }
        if let Ok(outcome) = bake(&file.write("changed.glb", &bytes)) {
            for primitive in outcome.file.primitives {
                primitive.hierarchy.validate().unwrap();
            }
        }
    }
}
