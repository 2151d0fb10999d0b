//! Files as exporters write them: shared buffers, unused vertices, invalid primitives and extensions.

use crate::common::gltf_file::GltfFile;
use fieldlod_bake::{
    BakeConfig, BufferFault, ImageFault, ImportError, MeshError, SkipReason, SourceMesh,
    VerifySettings, bake_file, bake_mesh, fixtures, import_gltf, unpack_gltf, verify,
};
use glam::{Vec2, Vec3};
use serde_json::json;

fn without_files(_: &str) -> std::io::Result<Vec<u8>> {
    Err(std::io::ErrorKind::NotFound.into())
}

/// A rock, and the same rock with an unused vertex at the start, in the middle and at the end.
fn with_unused(position: Vec3) -> (SourceMesh, SourceMesh) {
    let rock = fixtures::rock(3, 1);
    let mut whole = rock.clone();
    let middle = rock.positions.len() / 2;
    for at in [middle, 0, rock.positions.len() + 2] {
        whole.positions.insert(at, position);
        whole.normals.insert(at, Vec3::Y);
        if !rock.uvs.is_empty() {
            whole.uvs.insert(at, Vec2::ZERO);
        }
    }
    let moved = |index: &u32| index + 1 + u32::from(*index as usize >= middle);
    whole.indices = rock.indices.iter().map(moved).collect();
    (rock, whole)
}

#[test]
fn unused_vertices_of_files_are_ignored() {
    for position in [Vec3::splat(1e9), Vec3::NAN] {
        let (rock, whole) = with_unused(position);
        let import = import_gltf(&GltfFile::of(&whole).glb()).unwrap();
        assert_eq!(import.primitives[0].mesh, rock);
    }
}

#[test]
fn unused_vertices_of_meshes_are_ignored() {
    for position in [Vec3::splat(1e9), Vec3::NAN] {
        let (rock, whole) = with_unused(position);
        let [used, all] =
            [&rock, &whole].map(|mesh| bake_mesh(mesh, &BakeConfig::default()).unwrap());
        assert_eq!(all.validate(), Ok(()));
        assert_eq!(all.source, whole.source_hash());
        assert_eq!(all.source_vertex_count as usize, whole.positions.len());
        let triangles = |baked: &fieldlod_hierarchy::Hierarchy| -> Vec<[Vec3; 3]> {
            let units = baked.units.iter();
            let triangles = units.flat_map(|unit| baked.triangles_of(unit));
            triangles
                .map(|t| t.map(|v| baked.vertices.positions[v as usize]))
                .collect()
        };
        assert_eq!(triangles(&all), triangles(&used));
        verify(&whole, &all, &VerifySettings::default()).unwrap();
    }
}

#[test]
fn primitives_keep_only_used_vertices() {
    let mesh = fixtures::plane(32);
    let mut file = GltfFile::of(&mesh);
    let first = file.primitive().clone();
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    let primitives = triangles.chunks(64).map(|part| {
        let bytes: Vec<u8> = part
            .as_flattened()
            .iter()
            .flat_map(|i| i.to_le_bytes())
            .collect();
        let mut primitive = first.clone();
        primitive["indices"] = json!(file.add_accessor(&bytes, 5125, "SCALAR", part.len() * 3));
        primitive
    });
    file.json["meshes"][0]["primitives"] = primitives.collect();
    let import = import_gltf(&file.glb()).unwrap();
    assert_eq!(import.primitives.len(), 32);
    let held = import.primitives.iter().map(|p| p.mesh.positions.len());
    assert_eq!(held.sum::<usize>(), 32 * 2 * 33);
    let corner = |p: &SourceMesh, at: usize| p.positions[p.indices[at] as usize];
    let last = &import.primitives[31].mesh;
    assert_eq!(
        corner(last, 5),
        mesh.positions[triangles[31 * 64 + 1][2] as usize]
    );
}

#[test]
fn faulty_primitives_are_skipped_and_reported() {
    let good = fixtures::rock(2, 1);
    let mut bad = good.clone();
    bad.positions[7] = Vec3::NAN;
    let mut partial = good.clone();
    partial.indices.pop();
    let mut file = GltfFile::of(&good);
    for mesh in [&bad, &partial, &good] {
        file.add_mesh(mesh);
    }
    let outcome = bake_file(&file.glb(), &BakeConfig::default(), &|_| ()).unwrap();
    let baked: Vec<u32> = outcome
        .file
        .primitives
        .iter()
        .map(|p| p.mesh_index)
        .collect();
    assert_eq!(baked, [0, 3]);
    let reasons: Vec<String> = outcome
        .skipped
        .iter()
        .map(|s| s.reason.to_string())
        .collect();
    assert!(reasons[0].starts_with("vertex 7 lies at"), "{reasons:?}");
    assert!(matches!(
        &outcome.skipped[1].reason,
        SkipReason::Faulty(fieldlod_bake::PrimitiveFault::Mesh(
            MeshError::PartialTriangle { .. }
        ))
    ));
    let fault = import_gltf(&file.glb()).unwrap().first_fault();
    assert!(
        matches!(fault, Some(ImportError::Primitive { .. })),
        "{fault:?}"
    );
}

#[test]
fn trailing_bytes_and_byte_order_marks_are_ignored() {
    let mesh = fixtures::rock(2, 1);
    let mut file = GltfFile::of(&mesh);
    let mut bytes = file.glb_bytes();
    bytes.extend(b"\n");
    let import = import_gltf(&file.write("tail.glb", &bytes)).unwrap();
    assert_eq!(import.primitives[0].mesh, mesh);
    let text = file.json.to_string();
    let marked = [b"\xef\xbb\xbf", text.as_bytes()].concat();
    // The JSON after the mark is read: only the bytes of the buffer are missing.
    let fault = import_gltf(&file.write("mark.gltf", &marked)).unwrap_err();
    assert!(matches!(fault, ImportError::Buffer { .. }), "{fault}");
}

#[test]
fn unsupported_image_and_animation_extensions_are_ignored() {
    let mesh = fixtures::plane(8);
    let mut file = GltfFile::of(&mesh);
    file.json["extensionsRequired"] = json!(["EXT_texture_webp", "KHR_animation_pointer"]);
    file.write("a.webp", b"RIFF....WEBPVP8 ");
    file.json["images"] = json!([{ "uri": "a.webp" }]);
    file.json["materials"] =
        json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
    file.primitive()["material"] = json!(0);
    file.json["animations"] = json!([{
        "channels": [{ "sampler": 0, "target": { "path": "pointer", "extensions": {
            "KHR_animation_pointer": { "pointer": "/nodes/0/scale" } } } }],
        "samplers": [{ "input": 0, "output": 0 }],
    }]);
    let extension = json!({ "EXT_texture_webp": { "source": 0 } });
    for (texture, fault) in [
        (json!({ "extensions": extension }), ImageFault::Format),
        (json!({}), ImageFault::Missing),
    ] {
        file.json["textures"] = json!([texture]);
        let import = import_gltf(&file.glb()).unwrap();
        assert_eq!(import.primitives[0].mesh, mesh);
        assert_eq!(import.unread_images[0].fault, fault);
    }
}

#[test]
fn errors_truncate_long_uris() {
    let mut file = GltfFile::of(&fixtures::plane(2));
    let garbled = format!(
        "DATA:application/octet-stream;base64,{}",
        "%".repeat(10_000)
    );
    let long = format!("https://example.org/{}", "a".repeat(10_000));
    for (uri, is_data) in [(garbled, true), (long, false)] {
        let error = import_gltf(&file.gltf(&uri)).unwrap_err();
        assert!(error.to_string().len() < 300, "{error}");
        let ImportError::Buffer { fault, .. } = error else {
            panic!("{error}")
        };
        assert_eq!(matches!(fault, BufferFault::DataUri(_)), is_data, "{fault}");
    }
}

/// The bake imports the same primitives from the packed and from the unpacked file.
#[test]
fn unpacked_file_has_floats_in_one_buffer() {
    let mesh = fixtures::plane(8);
    let mut file = GltfFile::of(&mesh);
    let shorts = mesh.positions.iter().map(|p| {
        let [x, y, z] = p.to_array().map(|x| (x * 1000.0) as i16);
        [x, y, z, 0].map(i16::to_le_bytes)
    });
    let shorts: Vec<[[u8; 2]; 4]> = shorts.collect();
    let bytes = shorts.as_flattened().as_flattened();
    let packed = meshopt::encode_vertex_buffer(&shorts).unwrap();
    let positions = file.add_strided(bytes, 5122, 8, false);
    let view = file.json["accessors"][positions]["bufferView"].as_u64();
    let object = json!({ "byteStride": 8, "count": shorts.len(), "mode": "ATTRIBUTES" });
    file.pack(
        view.unwrap() as usize,
        "EXT_meshopt_compression",
        &packed,
        object,
    );
    file.primitive()["attributes"]["POSITION"] = json!(positions);
    let names = json!([
        "KHR_mesh_quantization",
        "EXT_meshopt_compression",
        "KHR_materials_unlit"
    ]);
    file.json["extensionsRequired"] = names.clone();
    file.json["extensionsUsed"] = names;
    let packed = file.glb_bytes();
    let unpacked = unpack_gltf(&packed, &without_files).unwrap();
    let [before, after] = [&packed, &unpacked.to_glb().unwrap()]
        .map(|bytes| import_gltf(&file.write("a.glb", bytes)).unwrap().primitives);
    assert_eq!(before, after);
    let json = unpacked.json;
    assert_eq!(json["extensionsRequired"], json!(["KHR_materials_unlit"]));
    let accessor = &json["accessors"][positions];
    assert_eq!(
        (&accessor["componentType"], &accessor["max"]),
        (&json!(5126), &json!([1000.0, 0.0, 1000.0]))
    );
    assert_eq!(json["buffers"].as_array().unwrap().len(), 1);
}
