//! Writes small valid and invalid glTF files.

use std::path::{Path, PathBuf};

use fieldlod_bake::{SourceMesh, UnpackedGltf};
use glam::{Vec2, Vec3};
use serde_json::{Value, json};
use tempfile::TempDir;

pub(crate) const TRIANGLES: u32 = 4;

/// A glTF file under construction: JSON and binary buffer.
pub(crate) struct GltfFile {
    pub(crate) json: Value,
    pub(crate) binary: Vec<u8>,
    folder: TempDir,
}

impl GltfFile {
    /// Creates a file without meshes.
    pub(crate) fn empty() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "buffers": [], "bufferViews": [], "accessors": [], "meshes": [], "nodes": [],
        });
        Self {
            json,
            binary: Vec::new(),
            folder: TempDir::new().unwrap(),
        }
    }

    /// Creates a file with one mesh: positions, normals, texture coordinates and 32-bit indices.
    pub(crate) fn of(mesh: &SourceMesh) -> Self {
        let mut file = Self::empty();
        file.add_mesh(mesh);
        file
    }

    pub(crate) fn add_mesh(&mut self, mesh: &SourceMesh) {
        let mut attributes = json!({});
        let positions = mesh.positions.iter().flat_map(Vec3::to_array);
        let positions = self.add_floats(&positions.collect::<Vec<_>>(), "VEC3");
        self.json["accessors"][positions]["min"] = json!([0.0, 0.0, 0.0]);
        self.json["accessors"][positions]["max"] = json!([0.0, 0.0, 0.0]);
        attributes["POSITION"] = json!(positions);
        if !mesh.normals.is_empty() {
            let normals = mesh.normals.iter().flat_map(Vec3::to_array);
            attributes["NORMAL"] = json!(self.add_floats(&normals.collect::<Vec<_>>(), "VEC3"));
        }
        if !mesh.uvs.is_empty() {
            let uvs = mesh.uvs.iter().flat_map(Vec2::to_array);
            attributes["TEXCOORD_0"] = json!(self.add_floats(&uvs.collect::<Vec<_>>(), "VEC2"));
        }
        let bytes: Vec<u8> = mesh.indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let indices = self.add_accessor(&bytes, 5125, "SCALAR", mesh.indices.len());
        let primitive = json!({ "attributes": attributes, "indices": indices, "mode": TRIANGLES });
        let mesh = json!({ "name": "part", "primitives": [primitive] });
        self.list("meshes").push(mesh);
    }

    /// Moves the primitives of all meshes into the first one.
    pub(crate) fn join_meshes(&mut self) {
        let added = self.list("meshes").split_off(1);
        for mesh in added {
            let primitive = mesh["primitives"][0].clone();
            let primitives = self.list("meshes")[0]["primitives"].as_array_mut();
            primitives.unwrap().push(primitive);
        }
    }

    pub(crate) fn add_floats(&mut self, floats: &[f32], kind: &str) -> usize {
        let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
        let width = match kind {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 1,
        };
        self.add_accessor(&bytes, 5126, kind, floats.len() / width)
    }

    /// Adds bytes with their own view and accessor.
    pub(crate) fn add_accessor(
        &mut self,
        bytes: &[u8],
        component: u32,
        kind: &str,
        count: usize,
    ) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view =
            json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        self.binary.extend(bytes);
        self.list("bufferViews").push(view);
        let view = self.list("bufferViews").len() - 1;
        let accessor = json!({
            "bufferView": view, "componentType": component, "type": kind, "count": count,
        });
        self.list("accessors").push(accessor);
        self.list("accessors").len() - 1
    }

    /// Adds vectors with `stride` bytes each.
    pub(crate) fn add_strided(
        &mut self,
        bytes: &[u8],
        component: u32,
        stride: usize,
        is_normalized: bool,
    ) -> usize {
        let index = self.add_accessor(bytes, component, "VEC3", bytes.len() / stride);
        let accessor = &mut self.json["accessors"][index];
        accessor["normalized"] = json!(is_normalized);
        (accessor["min"], accessor["max"]) = (json!([0, 0, 0]), json!([0, 0, 0]));
        let view = accessor["bufferView"].as_u64().unwrap() as usize;
        self.json["bufferViews"][view]["byteStride"] = json!(stride);
        index
    }

    /// Compresses a view: the extension refers to `packed`, and the view itself to a fallback buffer without bytes.
    pub(crate) fn pack(&mut self, view: usize, extension: &str, packed: &[u8], mut object: Value) {
        object["buffer"] = json!(0);
        object["byteOffset"] = json!(self.binary.len());
        object["byteLength"] = json!(packed.len());
        self.binary.extend(packed);
        let view = &mut self.json["bufferViews"][view];
        view["buffer"] = json!(1);
        view["extensions"] = json!({ extension: object });
        let fallback = json!({ extension: { "fallback": true } });
        self.json["buffers"] = json!([{ "byteLength": self.binary.len() },
            { "byteLength": 1 << 20, "extensions": fallback }]);
    }

    pub(crate) fn list(&mut self, name: &str) -> &mut Vec<Value> {
        self.json[name].as_array_mut().unwrap()
    }

    /// The first primitive of the first mesh.
    pub(crate) fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// The accessor of an attribute of the first primitive.
    pub(crate) fn accessor_of(&mut self, attribute: &str) -> &mut Value {
        let index = self.primitive()["attributes"][attribute].as_u64().unwrap() as usize;
        &mut self.json["accessors"][index]
    }

    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Writes a GLB file.
    pub(crate) fn glb(&mut self) -> PathBuf {
        let bytes = self.glb_bytes();
        self.write("mesh.glb", &bytes)
    }

    /// Writes a GLB file with some bytes replaced.
    pub(crate) fn glb_with(&mut self, at: usize, bytes: &[u8]) -> PathBuf {
        let mut glb = self.glb_bytes();
        glb[at..at + bytes.len()].copy_from_slice(bytes);
        self.write("mesh.glb", &glb)
    }

    pub(crate) fn glb_bytes(&mut self) -> Vec<u8> {
        if self.json["buffers"].as_array().is_some_and(Vec::is_empty) {
            self.json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        }
        let (json, binary) = (self.json.clone(), self.binary.clone());
        UnpackedGltf { json, binary }.to_glb().unwrap()
    }

    /// Writes a `.gltf` file whose only buffer is at `uri`.
    pub(crate) fn gltf(&mut self, uri: &str) -> PathBuf {
        self.json["buffers"] = json!([{ "byteLength": self.binary.len(), "uri": uri }]);
        let text = self.json.to_string();
        self.write("mesh.gltf", text.as_bytes())
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.folder().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}
