//! Files with characters, for the suites `plugin` and `rendering`.

use glam::Vec3;
use serde_json::json;

use crate::character::character;
use crate::gltf_file::GltfFile;

/// A file with one scene of a bending tube: two primitives with one skin and a morph target.
pub(crate) fn tube() -> GltfFile {
    let mut file = character(2.0);
    file.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    file
}

/// A file with one scene of a ball that grows to one side with its morph target.
pub(crate) fn ball() -> GltfFile {
    let mesh = fieldlod_tests::rock(4, 1);
    let mut file = GltfFile::of(&mesh);
    let deltas = mesh
        .positions
        .iter()
        .map(|p| Vec3::new(p.x.max(0.0), 0.5 * p.y, 0.0));
    let deltas: Vec<f32> = deltas.flat_map(|delta| delta.to_array()).collect();
    let target = file.add_floats(&deltas, "VEC3");
    file.json["accessors"][target]["min"] = json!([0.0, 0.0, 0.0]);
    file.json["accessors"][target]["max"] = json!([0.0, 0.0, 0.0]);
    file.primitive()["targets"] = json!([{ "POSITION": target }]);
    file.json["nodes"] = json!([{ "mesh": 0 }]);
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    file
}
