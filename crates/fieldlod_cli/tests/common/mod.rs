//! Small glTF files, and runs of the `fieldlod` command.

#![allow(dead_code, reason = "each test file uses a part")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::{Value, json};

pub(crate) const FLOAT: u32 = 5126;
pub(crate) const UNSIGNED_INT: u32 = 5125;

/// A binary glTF file under construction.
pub(crate) struct Glb {
    pub(crate) json: Value,
    pub(crate) binary: Vec<u8>,
}

impl Glb {
    pub(crate) fn new() -> Self {
        let json = json!({ "asset": { "version": "2.0" }, "bufferViews": [], "accessors": [] });
        let binary = Vec::new();
        Self { json, binary }
    }

    pub(crate) fn read(path: &Path) -> Self {
        let glb = fs::read(path).unwrap();
        let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
        Self {
            json: serde_json::from_slice(&glb[20..20 + length]).unwrap(),
            binary: glb[28 + length..].to_vec(),
        }
    }

    pub(crate) fn write(&mut self, path: &Path) {
        if self.json["buffers"].is_null() || self.json["buffers"].as_array().unwrap().len() == 1 {
            self.json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        }
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = (12 + 8 + json.len() + 8 + self.binary.len()) as u32;
        let lengths = [2, length, json.len() as u32].map(u32::to_le_bytes);
        let binary_length = (self.binary.len() as u32).to_le_bytes();
        let head = [b"glTF", &lengths.concat()[..], b"JSON", &json].concat();
        let parts = [&head, &binary_length[..], b"BIN\0", &self.binary];
        fs::write(path, parts.concat()).unwrap();
    }

    /// Adds bytes with their own buffer view. Returns the index of the view.
    pub(crate) fn add_view(&mut self, bytes: &[u8]) -> usize {
        let place =
            json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        push(&mut self.json["bufferViews"], place)
    }

    /// Adds bytes with their own view and accessor. Returns the index of the accessor.
    pub(crate) fn add(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.add_view(bytes);
        let mut accessor = json!({ "bufferView": view, "componentType": component, "type": kind,
            "count": count });
        if kind == "VEC3" {
            (accessor["min"], accessor["max"]) = (json!([0, 0, 0]), json!([128, 0, 128]));
        }
        push(&mut self.json["accessors"], accessor)
    }

    /// Adds the accessors of a flat grid with `2 · cells²` triangles. Returns a primitive that no mesh has yet.
    pub(crate) fn add_grid(&mut self, cells: u32) -> Value {
        let [positions, indices] = grid(cells);
        let position = self.add(&positions, FLOAT, "VEC3", positions.len() / 12);
        let index = self.add(&indices, UNSIGNED_INT, "SCALAR", indices.len() / 4);
        json!({ "attributes": { "POSITION": position }, "indices": index })
    }

    /// The bytes of a view.
    pub(crate) fn view(&self, view: &Value) -> &[u8] {
        let view = &self.json["bufferViews"][view.as_u64().unwrap() as usize];
        let [start, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap());
        &self.binary[start as usize..][..length as usize]
    }
}

/// Appends a value to a JSON array. Returns the index of the value.
pub(crate) fn push(list: &mut Value, value: Value) -> usize {
    let list = list.as_array_mut().unwrap();
    list.push(value);
    list.len() - 1
}

/// Positions and indices of a flat grid with `2 · cells²` triangles.
pub(crate) fn grid(cells: u32) -> [Vec<u8>; 2] {
    let side = cells + 1;
    let corners = (0..side * side).map(|i| [(i / side) as f32, 0.0, (i % side) as f32]);
    let quads = (0..cells * cells).map(|q| q / cells * side + q % cells);
    let triangles = quads.flat_map(|a| [a, a + 1, a + side, a + side, a + 1, a + side + 1]);
    [
        corners.flatten().flat_map(f32::to_le_bytes).collect(),
        triangles.flat_map(u32::to_le_bytes).collect(),
    ]
}

pub(crate) fn fieldlod(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldlod"));
    command.args(arguments).output().unwrap()
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Runs a command that must succeed, and returns its standard output.
pub(crate) fn output(arguments: &[&str]) -> String {
    let output = fieldlod(arguments);
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs a command that must fail with one line that names the file and contains `fault`.
pub(crate) fn assert_fails(arguments: &[&str], file: &Path, fault: &str) {
    let output = fieldlod(arguments);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(output.stdout.is_empty(), "{output:?}");
    let shown = String::from_utf8(output.stderr).unwrap();
    assert_eq!(shown.lines().count(), 1, "{shown}");
    let start = format!("error: {}: ", file.display());
    let is_expected = shown.starts_with(&start) && shown.contains(fault);
    assert!(is_expected, "{shown}");
}
