//! The plants as glTF files, for `fieldlod` and `fieldlod-lab`.

use std::path::Path;

use serde_json::json;

use crate::shapes::{Shape, ShapeId};

const PLANTS: [(&str, ShapeId); 5] = [
    ("oak", ShapeId::Oak(0)),
    ("pine", ShapeId::Pine(0)),
    ("cypress", ShapeId::Cypress),
    ("bush", ShapeId::Bush),
    ("tuft", ShapeId::Tuft),
];

/// Writes one binary glTF file for each plant into `directory`.
pub(crate) fn write_plants(directory: &Path) -> Result<(), String> {
    std::fs::create_dir_all(directory)
        .map_err(|error| format!("{}: {error}", directory.display()))?;
    for (name, id) in PLANTS {
        let path = directory.join(name).with_extension("glb");
        std::fs::write(&path, glb_of(&id.generate(1)))
            .map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}

/// A binary glTF file of one mesh: positions, normals, colours, triangles.
fn glb_of(shape: &Shape) -> Vec<u8> {
    // The arrays follow each other in one buffer.
    let mut buffer = Vec::new();
    let mut views = Vec::new();
    let mut add_view = |numbers: Vec<[u8; 4]>| {
        let bytes = numbers.as_flattened();
        views.push(json!({"buffer": 0, "byteOffset": buffer.len(), "byteLength": bytes.len()}));
        buffer.extend_from_slice(bytes);
    };
    for vectors in [&shape.positions, &shape.normals, &shape.colors] {
        let numbers = vectors.iter().flat_map(bevy::prelude::Vec3::to_array);
        add_view(numbers.map(f32::to_le_bytes).collect());
    }
    add_view(shape.indices.iter().map(|i| i.to_le_bytes()).collect());
    // What they are.
    let count = shape.positions.len();
    let vectors = |view: u32| {
        let (float, kind) = (5126, "VEC3");
        json!({"bufferView": view, "componentType": float, "count": count, "type": kind})
    };
    let corner = |pick: fn(bevy::math::Vec3, bevy::math::Vec3) -> bevy::math::Vec3| {
        shape
            .positions
            .iter()
            .copied()
            .reduce(pick)
            .unwrap_or_default()
            .to_array()
    };
    let mut positions = vectors(0);
    positions["min"] = json!(corner(bevy::math::Vec3::min));
    positions["max"] = json!(corner(bevy::math::Vec3::max));
    let unsigned = 5125;
    let indices = json!({"bufferView": 3, "componentType": unsigned, "count": shape.indices.len(), "type": "SCALAR"});
    let attributes = json!({"POSITION": 0, "NORMAL": 1, "COLOR_0": 2});
    let document = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": buffer.len()}],
        "bufferViews": views,
        "accessors": [positions, vectors(1), vectors(2), indices],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 3}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    });
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    // Header, and a chunk each for the document and the buffer.
    let mut file = b"glTF".to_vec();
    let length = 12 + 8 + json.len() + 8 + buffer.len();
    for number in [2, length as u32, json.len() as u32] {
        file.extend(number.to_le_bytes());
    }
    file.extend(b"JSON");
    file.extend(json);
    file.extend((buffer.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(buffer);
    file
}
