//! From glTF bytes to a hierarchy file and back.

use std::sync::Mutex;

use crate::common::gltf_file::GltfFile;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use fieldlod_bake::{
    BakeConfig, BakeProgress, SourceMesh, bake_file, bake_mesh_with_report, fixtures, import_gltf,
};
use fieldlod_hierarchy::BakedFile;
use glam::{Vec2, Vec3};
use serde_json::json;

fn import_one(path: &std::path::Path) -> SourceMesh {
    let mut import = import_gltf(path).unwrap();
    assert_eq!((import.primitives.len(), import.skipped.len()), (1, 0));
    import.primitives.remove(0).mesh
}

#[test]
fn glb_import_is_lossless() {
    for mesh in [fixtures::height_field(9), fixtures::rock(2, 3)] {
        assert_eq!(import_one(&GltfFile::of(&mesh).glb()), mesh);
    }
}

#[test]
fn external_buffers_and_data_uris_are_imported() {
    let mesh = fixtures::plane(3);
    let mut file = GltfFile::of(&mesh);
    file.write("a file.bin", &file.binary);
    assert_eq!(import_one(&file.gltf("a%20file.bin")), mesh);
    let text = STANDARD.encode(&file.binary);
    let uri = format!("data:application/octet-stream;base64,{text}");
    assert_eq!(import_one(&file.gltf(&uri)), mesh);
}

#[test]
fn indices_of_every_size_are_imported() {
    let mesh = fixtures::plane(3);
    for (component, bytes_each) in [(5121, 1), (5123, 2), (5125, 4)] {
        let mut file = GltfFile::of(&mesh);
        let bytes = mesh
            .indices
            .iter()
            .flat_map(|i| i.to_le_bytes()[..bytes_each].to_vec());
        let bytes: Vec<u8> = bytes.collect();
        let accessor = file.add_accessor(&bytes, component, "SCALAR", mesh.indices.len());
        file.primitive()["indices"] = json!(accessor);
        assert_eq!(import_one(&file.glb()), mesh);
    }
}

#[test]
fn missing_indices_become_sequential() {
    let mesh = fixtures::plane(2).without_shared_vertices();
    let mut file = GltfFile::of(&mesh);
    file.primitive().as_object_mut().unwrap().remove("indices");
    assert_eq!(import_one(&file.glb()), mesh);
}

/// Bevy does the same, so both hashes agree.
#[test]
fn missing_normals_give_flat_shading() {
    let mut mesh = fixtures::height_field(3);
    mesh.normals.clear();
    let imported = import_one(&GltfFile::of(&mesh).glb());
    assert_eq!(imported.indices, (0..54).collect::<Vec<u32>>());
    for (corner, &vertex) in mesh.indices.iter().enumerate() {
        assert_eq!(imported.positions[corner], mesh.positions[vertex as usize]);
        assert_eq!(imported.uvs[corner], mesh.uvs[vertex as usize]);
    }
    assert_eq!(imported.normals[0], imported.normals[2]);
    assert!((imported.normals[0].length() - 1.0).abs() < 1e-6);
}

#[test]
fn normals_that_bevy_ignores_are_ignored() {
    let mesh = fixtures::plane(2);
    let mut file = GltfFile::of(&mesh);
    file.accessor_of("NORMAL")["componentType"] = json!(5120);
    let imported = import_one(&file.glb());
    assert_eq!(imported, mesh.without_shared_vertices());
}

fn quad_with_mode(mode: u32, corners: &[u32]) -> SourceMesh {
    let mut mesh = fixtures::plane(1);
    mesh.indices = corners.to_vec();
    let mut file = GltfFile::of(&mesh);
    file.primitive()["mode"] = json!(mode);
    import_one(&file.glb())
}

#[test]
fn strips_and_fans_are_unrolled_with_their_winding() {
    let strip = quad_with_mode(5, &[0, 1, 2, 3]);
    assert_eq!(strip.indices, [0, 1, 2, 2, 1, 3]);
    let fan = quad_with_mode(6, &[0, 1, 3, 2]);
    assert_eq!(fan.indices, [0, 1, 3, 0, 3, 2]);
    for mesh in [strip, fan] {
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            assert!((b - a).cross(c - a).y > 0.0);
        }
    }
}

#[test]
fn interleaved_and_sparse_attributes_are_imported() {
    let mesh = fixtures::plane(2);
    let mut file = GltfFile::of(&mesh);
    let floats = mesh.positions.iter().zip(&mesh.normals);
    let bytes = floats.flat_map(|(p, n)| [p.to_array(), n.to_array()].concat());
    let bytes: Vec<u8> = bytes.flat_map(f32::to_le_bytes).collect();
    let accessor = file.add_accessor(&bytes, 5126, "VEC3", mesh.positions.len());
    let view = file.json["accessors"][accessor]["bufferView"].clone();
    file.json["bufferViews"][view.as_u64().unwrap() as usize]["byteStride"] = json!(24);
    file.accessor_of("POSITION")["bufferView"] = view.clone();
    file.accessor_of("NORMAL")["bufferView"] = view;
    file.accessor_of("NORMAL")["byteOffset"] = json!(12);
    assert_eq!(import_one(&file.glb()), mesh);

    let places = file.add_accessor(&[3, 5], 5121, "SCALAR", 2);
    let values = file.add_floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "VEC3");
    let places = file.json["accessors"][places]["bufferView"].clone();
    let values = file.json["accessors"][values]["bufferView"].clone();
    file.accessor_of("POSITION")["sparse"] = json!({ "count": 2,
        "indices": { "bufferView": places, "componentType": 5121 },
        "values": { "bufferView": values } });
    let imported = import_one(&file.glb());
    assert_eq!(imported.positions[3], Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(imported.positions[5], Vec3::new(4.0, 5.0, 6.0));
    assert_eq!(imported.positions[4], mesh.positions[4]);
}

#[test]
fn texture_coordinates_of_every_format_are_imported() {
    let mesh = fixtures::plane(1);
    for (component, normalized, expected) in [
        // The same values as in Bevy.
        (5121, true, Some(Vec2::new(1.0, 51.0 * 255f32.recip()))),
        (
            5123,
            true,
            Some(Vec2::new(1.0, 13_107.0 * 65_535f32.recip())),
        ),
        (5123, false, None),
    ] {
        let pair: &[u8] = if component == 5121 {
            &[255, 51, 0, 0]
        } else {
            &[255, 255, 51, 51]
        };
        let mut file = GltfFile::of(&mesh);
        let accessor = file.add_accessor(&pair.repeat(4), component, "VEC2", 4);
        let view = file.json["accessors"][accessor]["bufferView"]
            .as_u64()
            .unwrap() as usize;
        file.json["bufferViews"][view]["byteStride"] = json!(4);
        file.json["accessors"][accessor]["normalized"] = json!(normalized);
        file.primitive()["attributes"]["TEXCOORD_0"] = json!(accessor);
        assert_eq!(import_one(&file.glb()).uvs.first().copied(), expected);
    }
}

#[test]
fn several_meshes_bake_in_file_order() {
    let mut file = GltfFile::empty();
    let meshes = [
        fixtures::rock(4, 1),
        fixtures::plane(40),
        fixtures::one_triangle(),
    ];
    for mesh in &meshes {
        file.add_mesh(mesh);
    }
    let reports: Mutex<Vec<BakeProgress>> = Mutex::default();
    let on_progress = |progress| reports.lock().unwrap().push(progress);
    let outcome = bake_file(&file.glb(), &BakeConfig::default(), &on_progress).unwrap();
    assert_eq!(outcome.file.primitives.len(), 3);
    assert_eq!(outcome.reports.len(), 3);
    for (index, mesh) in meshes.iter().take(2).enumerate() {
        let baked = outcome.file.find(index as u32, 0).unwrap();
        assert_eq!(baked.name, "part");
        assert_eq!(baked.hierarchy.source, mesh.source_hash());
        let (alone, report) = bake_mesh_with_report(mesh, &BakeConfig::default()).unwrap();
        assert!(baked.hierarchy == alone);
        assert_eq!(outcome.reports[index], report);
    }
    let reports = reports.into_inner().unwrap();
    let done = reports.iter().map(|progress| progress.triangles_done).max();
    let total = reports
        .iter()
        .map(|progress| progress.triangles_total)
        .max();
    assert_eq!(done, total);
    assert!(
        reports
            .iter()
            .all(|progress| progress.triangles_done <= progress.triangles_total)
    );

    let bytes = outcome.file.to_bytes();
    assert!(BakedFile::from_bytes(&bytes).unwrap() == outcome.file);
}
