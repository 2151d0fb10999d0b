//! An animated character made by the program.

use std::f32::consts::TAU;
use std::ffi::OsStr;
use std::io;
use std::path::Path;

use bevy::mesh::VertexAttributeValues;
use bevy::prelude::*;
use serde_json::{Value, json};

/// The height of the character, and of each of its joints.
const HEIGHT: f32 = 1.8;
const JOINTS: [f32; 3] = [0.0, 0.5 * HEIGHT, 0.8 * HEIGHT];
/// Length of the clip in seconds, and its keyframes.
const SECONDS: f32 = 2.0;
const KEYS: u8 = 17;

/// The parts of a glTF file.
#[derive(Default)]
struct Parts {
    data: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Parts {
    /// Adds data of one attribute, and returns its accessor.
    fn add(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let (start, view) = (self.data.len(), self.views.len());
        self.views
            .push(json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() }));
        self.accessors.push(
            json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }),
        );
        self.data.extend_from_slice(bytes);
        self.accessors.len() - 1
    }

    fn add_floats<const N: usize>(&mut self, kind: &str, values: &[[f32; N]]) -> usize {
        let floats = values.as_flattened().iter();
        let bytes: Vec<u8> = floats.flat_map(|value| value.to_le_bytes()).collect();
        self.add(kind, 5126, values.len(), &bytes)
    }
}

/// Writes a glTF file with a skinned character that dances, and a `.bin` file beside it.
pub(crate) fn write_dancer(path: &Path) -> io::Result<()> {
    let body = Capsule3d::new(0.25, HEIGHT - 0.5).mesh();
    let body = body.longitudes(48).latitudes(32).rings(24).build();
    let body = body.translated_by(Vec3::Y * HEIGHT / 2.0);
    let attributes = [Mesh::ATTRIBUTE_POSITION, Mesh::ATTRIBUTE_NORMAL].map(|a| body.attribute(a));
    use VertexAttributeValues::Float32x3;
    let ([Some(Float32x3(positions)), Some(Float32x3(normals))], Some(indices)) =
        (attributes, body.indices())
    else {
        return Err(io::Error::other("the body has no indices"));
    };
    let mut parts = Parts::default();
    let position = parts.add_floats("VEC3", positions);
    let [min, max] = [[-0.25, 0.0, -0.25], [0.25, HEIGHT, 0.25]];
    (
        parts.accessors[position]["min"],
        parts.accessors[position]["max"],
    ) = (json!(min), json!(max));
    let normal = parts.add_floats("VEC3", normals);
    // Each vertex follows the two joints that it is between.
    let share = |[_, y, _]: &[f32; 3], from: f32| ((y - from) / (0.3 * HEIGHT)).clamp(0.0, 1.0);
    let weights = positions.iter().map(|at| {
        let [middle, top] = [share(at, 0.3 * HEIGHT), share(at, 0.65 * HEIGHT)];
        [1.0 - middle, middle * (1.0 - top), middle * top, 0.0]
    });
    let weights = parts.add_floats("VEC4", &weights.collect::<Vec<_>>());
    let joints = parts.add(
        "VEC4",
        5121,
        positions.len(),
        &[0, 1, 2, 0].repeat(positions.len()),
    );
    let corners: Vec<u8> = indices
        .iter()
        .flat_map(|index| (index as u32).to_le_bytes())
        .collect();
    let corners = parts.add("SCALAR", 5125, indices.len(), &corners);
    let inverse_binds = JOINTS.map(|y| Mat4::from_translation(-y * Vec3::Y).to_cols_array());
    let inverse_binds = parts.add_floats("MAT4", &inverse_binds);
    let times = (0..KEYS).map(|key| [SECONDS * f32::from(key) / f32::from(KEYS - 1)]);
    let times: Vec<[f32; 1]> = times.collect();
    let turns = [Vec3::Z, Vec3::X].map(|axis| {
        let turn =
            |&[time]: &[f32; 1]| Quat::from_scaled_axis(0.6 * axis * (time * TAU / SECONDS).sin());
        let turns: Vec<[f32; 4]> = times.iter().map(|time| turn(time).to_array()).collect();
        parts.add_floats("VEC4", &turns)
    });
    let times = parts.add_floats("SCALAR", &times);
    (parts.accessors[times]["min"], parts.accessors[times]["max"]) =
        (json!([0.0]), json!([SECONDS]));
    let node = |name: &str, y: f32, children: Value| {
        let translation = [0.0, y, 0.0];
        json!({ "name": name, "translation": translation, "children": children })
    };
    // The joints after the first turn.
    let channels = [0, 1].map(
        |index| json!({ "sampler": index, "target": { "node": index + 2, "path": "rotation" } }),
    );
    let buffer = path.with_extension("bin");
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [
            { "name": "body", "mesh": 0, "skin": 0 },
            node("hip", JOINTS[0], json!([2])),
            node("chest", JOINTS[1] - JOINTS[0], json!([3])),
            { "name": "head", "translation": [0.0, JOINTS[2] - JOINTS[1], 0.0] },
        ],
        "skins": [{ "joints": [1, 2, 3], "inverseBindMatrices": inverse_binds }],
        "animations": [{
            "samplers": turns.map(|turns| json!({ "input": times, "output": turns })),
            "channels": channels,
        }],
        "materials": [{
            "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.5, 0.3, 1.0], "metallicFactor": 0.0 }
        }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights },
            "indices": corners,
            "material": 0,
        }] }],
        "accessors": parts.accessors,
        "bufferViews": parts.views,
        "buffers": [{ "uri": buffer.file_name().map(OsStr::to_string_lossy), "byteLength": parts.data.len() }],
    });
    std::fs::write(&buffer, parts.data)?;
    std::fs::write(path, document.to_string())
}
