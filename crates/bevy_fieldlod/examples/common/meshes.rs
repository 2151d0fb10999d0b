//! Meshes made by the program.

use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use bevy::camera::primitives::Aabb;
use bevy::mesh::{Indices, VertexAttributeValues};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use serde_json::json;

/// A sphere with bumps, with `20 * (subdivisions + 1)²` triangles.
pub(crate) fn rock(subdivisions: u32) -> Mesh {
    let sphere = Sphere::new(1.0).mesh().ico(subdivisions);
    let mut mesh = sphere.expect("few enough subdivisions");
    let positions = mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION);
    if let Some(VertexAttributeValues::Float32x3(positions)) = positions {
        for position in positions {
            let place = Vec3::from_array(*position);
            let bumps = [2.0, 5.0, 11.0, 23.0].map(|frequency: f32| {
                let waves = (frequency * place + place.yzx()).map(f32::sin);
                waves.element_sum() / frequency
            });
            *position = (place * (1.0 + 0.15 * bumps.iter().sum::<f32>())).to_array();
        }
    }
    // `compute_smooth_normals` gives no normals where edges are short.
    mesh.compute_area_weighted_normals();
    mesh
}

/// A startup system: seven rocks with levels of detail at growing distances, and a sun.
pub(crate) fn spawn_rocks(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let mesh = Mesh3d(meshes.add(rock(60)));
    let material = MeshMaterial3d(materials.add(Color::srgb(0.6, 0.5, 0.4)));
    for index in 0..7u8 {
        let place = Vec3::new(1.5 * f32::from(index) - 3.0, 0.0, -f32::from(index * index));
        let place = Transform::from_translation(place);
        commands.spawn((mesh.clone(), material.clone(), place, AutoLod::default()));
    }
    commands.spawn(sun());
}

/// A light without shadows.
pub(crate) fn sun() -> (DirectionalLight, Transform) {
    let direction = Vec3::new(-1.0, -1.0, -0.5);
    let place = Transform::default().looking_to(direction, Vec3::Y);
    (DirectionalLight::default(), place)
}

/// Ground of `2 * (subdivisions + 1)²` triangles with waves of the given frequencies.
pub(crate) fn hills(size: f32, subdivisions: u32, frequencies: &[f32]) -> Mesh {
    let plane = Plane3d::default().mesh().size(size, size);
    let mut mesh = plane.subdivisions(subdivisions).build();
    let positions = mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION);
    if let Some(VertexAttributeValues::Float32x3(positions)) = positions {
        for [x, height, z] in positions {
            let waves = frequencies
                .iter()
                .map(|f| ((f * *x).sin() + (f * *z + *x).cos()) / f);
            *height = 0.25 * waves.sum::<f32>();
        }
    }
    mesh.compute_area_weighted_normals();
    mesh
}

/// Leaves above a small ball: many loose pieces, as plants have. At most 200, with the same area for any number.
pub(crate) fn bush(leaves: u8) -> Mesh {
    let spread = 200.0 / f32::from(leaves);
    let leaf = Vec2::new(0.12, 0.3) * spread.sqrt();
    let leaf = Plane3d::default()
        .mesh()
        .size(leaf.x, leaf.y)
        .subdivisions(1);
    let mut bush = Sphere::new(0.1).mesh().build();
    for index in 0..leaves {
        let index = spread * f32::from(index);
        let turn = Quat::from_rotation_y(2.4 * index) * Quat::from_rotation_x(0.014 * index);
        let place = Transform::from_translation(Vec3::Y + turn * Vec3::new(0.0, 0.2, 0.6));
        let leaf = leaf.build().transformed_by(place.with_rotation(turn));
        bush.merge(&leaf).expect("the same attributes");
    }
    bush
}

/// The folder for the files that the example `name` writes.
pub(crate) fn folder_of(name: &str) -> io::Result<PathBuf> {
    let folder = std::env::temp_dir().join("fieldlod-examples").join(name);
    std::fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// Writes a glTF file with one scene, in which `mesh` stands at `places`, and a `.bin` file beside it. The colour is
/// linear.
pub(crate) fn write_gltf(
    path: &Path,
    mesh: &Mesh,
    places: &[Vec3],
    [red, green, blue]: [f32; 3],
) -> io::Result<()> {
    let positions = mesh.attribute(Mesh::ATTRIBUTE_POSITION);
    let positions = positions.and_then(VertexAttributeValues::as_float3);
    let aabb = positions.and_then(|all| Aabb::enclosing(all.iter().copied().map(Vec3::from)));
    let (Some(Indices::U32(indices)), Some(aabb)) = (mesh.indices(), aabb) else {
        return Err(io::Error::other("the mesh has no 32-bit indices"));
    };
    let mut data = Vec::new();
    for attribute in [Mesh::ATTRIBUTE_POSITION, Mesh::ATTRIBUTE_NORMAL] {
        data.extend_from_slice(mesh.attribute(attribute).map_or(&[], |a| a.get_bytes()));
    }
    data.extend(indices.iter().flat_map(|index| index.to_le_bytes()));
    let count = mesh.count_vertices();
    let nodes = places
        .iter()
        .map(|place| json!({ "mesh": 0, "translation": place.to_array() }));
    let buffer = path.with_extension("bin");
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": Vec::from_iter(0..places.len()) }],
        "nodes": Vec::from_iter(nodes),
        "materials": [{
            "pbrMetallicRoughness": { "baseColorFactor": [red, green, blue, 1.0], "metallicFactor": 0.0 }
        }],
        "meshes": [{
            "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2, "material": 0 }]
        }],
        "accessors": [
            {
                "bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3",
                "min": aabb.min().to_array(), "max": aabb.max().to_array()
            },
            { "bufferView": 1, "componentType": 5126, "count": count, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5125, "count": indices.len(), "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 12 * count },
            { "buffer": 0, "byteOffset": 12 * count, "byteLength": 12 * count },
            { "buffer": 0, "byteOffset": 24 * count, "byteLength": 4 * indices.len() },
        ],
        "buffers": [{ "uri": buffer.file_name().map(OsStr::to_string_lossy), "byteLength": data.len() }],
    });
    std::fs::write(&buffer, data)?;
    std::fs::write(path, document.to_string())
}
