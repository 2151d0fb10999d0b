//! A generated character: a tube along y with two primitives, three joints, a morph target and two clips.

use fieldlod_bake::SourceMesh;
use glam::{Mat4, Quat, Vec3};
use serde_json::{Value, json};

use super::gltf_file::GltfFile;

pub(crate) const LENGTH: f32 = 4.0;
const SIDES: u32 = 16;

/// The part of the tube between two shares of the length. Bumps make the sides of the tube differ.
fn tube(rings: u32, from: f32, to: f32) -> SourceMesh {
    let mut mesh = SourceMesh::default();
    for ring in 0..=rings {
        let y = (from + (to - from) * ring as f32 / rings as f32) * LENGTH;
        for side in 0..SIDES {
            let angle = side as f32 / SIDES as f32 * std::f32::consts::TAU;
            let normal = Vec3::new(angle.cos(), 0.0, angle.sin());
            let radius = 0.3 + 0.05 * (5.0 * y).sin() * (3.0 * angle).cos();
            mesh.positions.push(normal * radius + Vec3::Y * y);
            mesh.normals.push(normal);
        }
    }
    for ring in 0..rings {
        for side in 0..SIDES {
            let next = (side + 1) % SIDES;
            let [a, b] = [side, next].map(|side| ring * SIDES + side);
            let [c, d] = [a + SIDES, b + SIDES];
            mesh.indices.extend([a, c, b, b, c, d]);
        }
    }
    mesh
}

/// Joints and weights of a vertex: the joints below and above the vertex.
pub(crate) fn influence(position: Vec3) -> ([u16; 4], [f32; 4]) {
    let along = (position.y / LENGTH * 2.0).clamp(0.0, 2.0);
    let first = (along as u16).min(1);
    let share = along - f32::from(first);
    // Smooth weights give a round bend instead of a kink.
    let share = share * share * (3.0 - 2.0 * share);
    ([first, first + 1, 0, 0], [1.0 - share, share, 0.0, 0.0])
}

/// The character's file. Joint `k` is at `k / 2` of the length; its inverse bind matrix is scaled by `scale`.
pub(crate) fn character(scale: f32) -> GltfFile {
    character_of(32, scale)
}

/// [`character`] with `rings` rings of quads in each half.
pub(crate) fn character_of(rings: u32, scale: f32) -> GltfFile {
    let mut file = GltfFile::empty();
    for half in 0..2 {
        let mesh = tube(rings, half as f32 * 0.5, half as f32 * 0.5 + 0.5);
        file.add_mesh(&mesh);
        let influences = mesh.positions.iter().map(|p| influence(*p));
        let (joints, weights): (Vec<_>, Vec<_>) = influences.unzip();
        let bytes: Vec<u8> = joints
            .as_flattened()
            .iter()
            .map(|&j: &u16| j as u8)
            .collect();
        let joints = file.add_accessor(&bytes, 5121, "VEC4", mesh.positions.len());
        let weights = file.add_floats(weights.as_flattened(), "VEC4");
        let deltas = mesh.positions.iter().map(|p| Vec3::X * (p.y * 0.2));
        let deltas: Vec<f32> = deltas.flat_map(|delta| delta.to_array()).collect();
        let target = file.add_floats(&deltas, "VEC3");
        file.json["accessors"][target]["min"] = json!([0.0, 0.0, 0.0]);
        file.json["accessors"][target]["max"] = json!([0.0, 0.0, 0.0]);
        let primitive = &mut file.json["meshes"][half]["primitives"][0];
        primitive["attributes"]["JOINTS_0"] = json!(joints);
        primitive["attributes"]["WEIGHTS_0"] = json!(weights);
        primitive["targets"] = json!([{ "POSITION": target }]);
    }
    file.join_meshes();
    let joint = |k: usize| Vec3::Y * (LENGTH * k as f32 / 2.0);
    let inverse_binds = (0..3).flat_map(|k| {
        let bind = Mat4::from_translation(joint(k)) * Mat4::from_scale(Vec3::splat(1.0 / scale));
        bind.inverse().to_cols_array()
    });
    let inverse_binds: Vec<f32> = inverse_binds.collect();
    let bytes: Vec<u8> = inverse_binds.iter().flat_map(|x| x.to_le_bytes()).collect();
    let inverse_binds = file.add_accessor(&bytes, 5126, "MAT4", 3);
    file.json["skins"] = json!([{ "joints": [1, 2, 3], "inverseBindMatrices": inverse_binds }]);
    let step = json!([0.0, LENGTH / 2.0 * scale, 0.0]);
    file.json["nodes"] = json!([
        { "mesh": 0, "skin": 0 },
        { "name": "root", "children": [2], "scale": [1.0 / scale, 1.0 / scale, 1.0 / scale] },
        { "name": "middle", "children": [3], "translation": step },
        { "name": "tip", "translation": step },
    ]);
    file.json["animations"] = json!([]);
    for (name, node, axis) in [("bend", 2, Vec3::Z), ("twist", 3, Vec3::X)] {
        let clip = clip(&mut file, name, node, axis);
        file.list("animations").push(clip);
    }
    file
}

/// A clip of one second that rotates a node by up to 1.2 radians about an axis.
fn clip(file: &mut GltfFile, name: &str, node: usize, axis: Vec3) -> Value {
    let times: Vec<f32> = (0..=10).map(|k| k as f32 / 10.0).collect();
    let rotation = |time: &f32| Quat::from_axis_angle(axis, 1.2 * (time * 6.0).sin()).to_array();
    let rotations: Vec<f32> = times.iter().flat_map(rotation).collect();
    let (input, output) = (
        file.add_floats(&times, "SCALAR"),
        file.add_floats(&rotations, "VEC4"),
    );
    json!({
        "name": name,
        "samplers": [{ "input": input, "output": output }],
        "channels": [{ "sampler": 0, "target": { "node": node, "path": "rotation" } }],
    })
}
