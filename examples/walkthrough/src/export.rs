//! Shapes and the scene as binary glTF files, for `fieldlod` and `fieldlod-lab`.

use std::collections::HashMap;
use std::path::Path;

use bevy::prelude::*;
use serde_json::{Value, json};

use crate::layout;
use crate::placed::Placed;
use crate::quality::Quality;
use crate::shapes::{self, Shape, ShapeId};

const PLANTS: [(&str, ShapeId); 5] = [
    ("oak", ShapeId::Oak(0)),
    ("pine", ShapeId::Pine(0)),
    ("cypress", ShapeId::Cypress),
    ("bush", ShapeId::Bush),
    ("tuft", ShapeId::Tuft),
];

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;

/// Writes one binary glTF file for each plant into `directory`.
pub(crate) fn write_plants(directory: &Path) -> Result<(), String> {
    std::fs::create_dir_all(directory)
        .map_err(|error| format!("{}: {error}", directory.display()))?;
    for (name, id) in PLANTS {
        let path = directory.join(name).with_extension("glb");
        let mut glb = Glb::default();
        // White and opaque, as no material would be, but told: a plant that is known to be opaque gets cards.
        glb.materials
            .push(json!({"name": "white", "pbrMetallicRoughness": {"metallicFactor": 0.0}}));
        glb.add_mesh(&id.name(), &id.generate(1), json!({"material": 0}));
        glb.nodes.push(json!({"mesh": 0}));
        write(&path, &glb.into_bytes())?;
    }
    Ok(())
}

/// Writes all that stands in the scene, but for lights and the texture on the ground.
pub(crate) fn write_scene(path: &Path, quality: &Quality) -> Result<(), String> {
    let mut glb = Glb::default();
    let mut meshes = HashMap::new();
    for (id, shape) in shapes::generate_all(quality.ground_squares) {
        meshes.insert(id, glb.add_colored_mesh(&id.name(), shape));
    }
    for placed in layout::place_all(quality.vegetation) {
        glb.place(meshes[&placed.shape], &placed);
    }
    write(path, &glb.into_bytes())
}

/// Writes the ground and so many rocks on it, each another one, where the path begins.
pub(crate) fn write_rocks(path: &Path, quality: &Quality, count: u32) -> Result<(), String> {
    let mut glb = Glb::default();
    let ground = ShapeId::Terrain;
    let mesh = glb.add_colored_mesh(&ground.name(), ground.generate(quality.ground_squares));
    glb.place(mesh, &Placed::at_height(ground, Vec2::ZERO, 0.0, 0.0, 1.0));
    for (number, placed) in (0..count).zip(layout::field_of_rocks(count)) {
        let mesh = glb.add_colored_mesh(&format!("rock {number}"), shapes::fine_rock(number));
        glb.place(mesh, &placed);
    }
    write(path, &glb.into_bytes())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    std::fs::write(path, bytes).map_err(|error| format!("{}: {error}", path.display()))
}

/// A binary glTF file under way: all arrays follow each other in one buffer.
#[derive(Default)]
struct Glb {
    buffer: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
}

impl Glb {
    /// Adds positions, normals, colours, texture coordinates and triangles to what a primitive has already. Returns
    /// the number of the mesh.
    fn add_mesh(&mut self, name: &str, shape: &Shape, mut primitive: Value) -> usize {
        let corner = |pick: fn(Vec3, Vec3) -> Vec3| {
            let corner = shape.positions.iter().copied().reduce(pick);
            corner.unwrap_or_default().to_array()
        };
        let position = self.add_floats("VEC3", shape.positions.iter().map(Vec3::to_array));
        self.accessors[position]["min"] = json!(corner(Vec3::min));
        self.accessors[position]["max"] = json!(corner(Vec3::max));
        let mut attributes = json!({
            "POSITION": position,
            "NORMAL": self.add_floats("VEC3", shape.normals.iter().map(Vec3::to_array)),
        });
        if !shape.colors.is_empty() {
            let colors = shape.colors.iter().map(Vec3::to_array);
            attributes["COLOR_0"] = self.add_floats("VEC3", colors).into();
        }
        if !shape.uvs.is_empty() {
            let uvs = shape.uvs.iter().map(Vec2::to_array);
            attributes["TEXCOORD_0"] = self.add_floats("VEC2", uvs).into();
        }
        primitive["attributes"] = attributes;
        let indices = shape.indices.iter().map(|index| index.to_le_bytes());
        let count = shape.indices.len();
        let indices = self.add_array(UNSIGNED_INT, "SCALAR", count, indices);
        primitive["indices"] = indices.into();
        self.meshes
            .push(json!({"name": name, "primitives": [primitive]}));
        self.meshes.len() - 1
    }

    /// Adds a mesh with a material of the mean of its colours, by which these are relative.
    fn add_colored_mesh(&mut self, name: &str, mut shape: Shape) -> usize {
        let (colors, mean) = shape.relative_colors();
        shape.colors = colors;
        let primitive = json!({"material": self.materials.len()});
        self.materials.push(json!({
            "name": "color",
            "pbrMetallicRoughness": {"baseColorFactor": mean.extend(1.0).to_array(), "metallicFactor": 0.0},
        }));
        self.add_mesh(name, &shape, primitive)
    }

    /// Adds a node that has a mesh.
    fn place(&mut self, mesh: usize, placed: &Placed) {
        let Transform {
            translation,
            rotation,
            scale,
        } = placed.transform;
        self.nodes.push(json!({
            "name": placed.shape.name(),
            "mesh": mesh,
            "translation": translation.to_array(),
            "rotation": rotation.to_array(),
            "scale": scale.to_array(),
        }));
    }

    fn add_floats<const N: usize>(
        &mut self,
        kind: &str,
        vectors: impl ExactSizeIterator<Item = [f32; N]>,
    ) -> usize {
        let count = vectors.len();
        self.add_array(FLOAT, kind, count, vectors.flatten().map(f32::to_le_bytes))
    }

    /// Returns the number of the accessor.
    fn add_array(
        &mut self,
        component: u32,
        kind: &str,
        count: usize,
        numbers: impl Iterator<Item = [u8; 4]>,
    ) -> usize {
        let start = self.buffer.len();
        self.buffer.extend(numbers.flatten());
        let length = self.buffer.len() - start;
        let view = self.views.len();
        self.views
            .push(json!({"buffer": 0, "byteOffset": start, "byteLength": length}));
        let accessor =
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind});
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn into_bytes(self) -> Vec<u8> {
        let mut document = json!({
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": self.buffer.len()}],
            "bufferViews": self.views,
            "accessors": self.accessors,
            "meshes": self.meshes,
            "scenes": [{"nodes": (0..self.nodes.len()).collect::<Vec<_>>()}],
            "nodes": self.nodes,
            "scene": 0,
        });
        // A list must not be empty.
        if !self.materials.is_empty() {
            document["materials"] = self.materials.into();
        }
        let mut json = document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        // Header, and a chunk each for the document and the buffer.
        let mut file = b"glTF".to_vec();
        let length = 12 + 8 + json.len() + 8 + self.buffer.len();
        for number in [2, length as u32, json.len() as u32] {
            file.extend(number.to_le_bytes());
        }
        file.extend(b"JSON");
        file.extend(json);
        file.extend((self.buffer.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(self.buffer);
        file
    }
}
