//! Import of tangents, colours, second texture coordinates and geometry extensions.

use crate::common::gltf_file::GltfFile;
use fieldlod_bake::{
    BakeConfig, ImportError, ImportedPrimitive, PackedViewFault, SourceMesh, bake_file, fixtures,
    import_gltf,
};
use glam::{Vec2, Vec3, Vec4};
use serde_json::{Value, json};

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;

fn import_one(path: &std::path::Path) -> ImportedPrimitive {
    let mut import = import_gltf(path).unwrap();
    assert_eq!((import.primitives.len(), import.skipped.len()), (1, 0));
    import.primitives.remove(0)
}

/// A square of 9 vertices with tangents, second texture coordinates and colours.
fn square_with_all_attributes() -> (SourceMesh, GltfFile) {
    let mesh = fixtures::plane(2);
    let mut file = GltfFile::of(&mesh);
    let numbers = |width: usize| (0..9 * width).map(|i| i as f32).collect::<Vec<_>>();
    let tangents = file.add_floats(&numbers(4), "VEC4");
    let uvs_1 = file.add_floats(&numbers(2), "VEC2");
    let colors: Vec<u8> = (0..9).flat_map(|i| [i * 17, 0, 255, 0]).collect();
    let colors = file.add_strided(&colors, UNSIGNED_BYTE, 4, true);
    let attributes = &mut file.primitive()["attributes"];
    attributes["TANGENT"] = json!(tangents);
    attributes["TEXCOORD_1"] = json!(uvs_1);
    attributes["COLOR_0"] = json!(colors);
    (mesh, file)
}

#[test]
fn attributes_used_by_bevy_are_kept() {
    let (mesh, mut file) = square_with_all_attributes();
    let path = file.glb();
    let imported = import_one(&path);
    let mut plain = imported.mesh.clone();
    plain.tangents.clear();
    plain.uvs_1.clear();
    plain.colors.clear();
    assert_eq!(plain, mesh);
    assert_eq!(imported.mesh.tangents[8], Vec4::new(32.0, 33.0, 34.0, 35.0));
    assert_eq!(imported.mesh.uvs_1[8], Vec2::new(16.0, 17.0));
    let red = 51.0 * 255f32.recip();
    assert_eq!(imported.mesh.colors[3], Vec4::new(red, 0.0, 1.0, 1.0));
    let outcome = bake_file(&path, &BakeConfig::default(), &|_| ()).unwrap();
    let vertices = &outcome.file.primitives[0].hierarchy.vertices;
    assert_eq!(vertices.tangents, imported.mesh.tangents);
    assert_eq!(vertices.uvs_1, imported.mesh.uvs_1);
    assert_eq!(vertices.colors, imported.mesh.colors);
}

/// Further sets and custom attributes are not imported, only reported.
#[test]
fn unsupported_attributes_are_reported() {
    let (_, mut file) = square_with_all_attributes();
    assert!(!import_one(&file.glb()).mesh.has_other_attributes);
    let uvs = file.primitive()["attributes"]["TEXCOORD_0"].clone();
    let colors = file.primitive()["attributes"]["COLOR_0"].clone();
    for (name, accessor) in [("TEXCOORD_2", &uvs), ("COLOR_1", &colors), ("_WIND", &uvs)] {
        file.primitive()["attributes"][name] = accessor.clone();
        let imported = import_one(&file.glb());
        assert!(imported.mesh.has_other_attributes, "{name}");
        file.primitive()["attributes"]
            .as_object_mut()
            .unwrap()
            .remove(name);
    }
}

/// Bevy computes missing tangents if a normal map needs them.
#[test]
fn tangents_that_bevy_adds_are_reported() {
    let mut file = GltfFile::of(&fixtures::rock(2, 1));
    file.json["images"] = json!([{ "uri": "bumps.png" }]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file.json["materials"] = json!([{ "normalTexture": { "index": 0 } }, {}]);
    for (material, expected) in [(0, true), (1, false)] {
        file.primitive()["material"] = json!(material);
        assert_eq!(import_one(&file.glb()).mesh.has_other_attributes, expected);
    }
}

/// Unsharing vertices for flat normals must copy all their attributes.
#[test]
fn unshared_vertices_keep_their_attributes() {
    let (mesh, mut file) = square_with_all_attributes();
    let attributes = file.primitive()["attributes"].as_object_mut().unwrap();
    attributes.remove("NORMAL");
    let imported = import_one(&file.glb());
    assert_eq!(imported.mesh.positions.len(), mesh.indices.len());
    for (corner, &vertex) in mesh.indices.iter().enumerate() {
        let first = vertex as f32;
        assert_eq!(imported.mesh.tangents[corner].x, first * 4.0);
        assert_eq!(imported.mesh.uvs_1[corner].x, first * 2.0);
        let red = first * 17.0 * 255f32.recip();
        assert_eq!(imported.mesh.colors[corner].x, red);
    }
}

#[test]
fn rejects_incomplete_attributes() {
    for name in ["TANGENT", "TEXCOORD_1", "COLOR_0"] {
        let (_, mut file) = square_with_all_attributes();
        file.accessor_of(name)["count"] = json!(8);
        let error = bake_file(&file.glb(), &BakeConfig::default(), &|_| ()).unwrap_err();
        assert!(
            matches!(error, ImportError::Primitive { .. }),
            "{name}: {error}"
        );
    }
}

#[test]
fn quantized_attributes_are_imported() {
    let mesh = fixtures::plane(2);
    let mut file = GltfFile::of(&mesh);
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let shorts = |v: &Vec3| v.to_array().map(|x| (x * 1000.0) as i16);
    let bytes = mesh
        .positions
        .iter()
        .flat_map(|v| [&shorts(v)[..], &[0]].concat());
    let bytes: Vec<u8> = bytes.flat_map(i16::to_le_bytes).collect();
    let positions = file.add_strided(&bytes, SHORT, 8, false);
    let normals = file.add_strided(&[0u8, 127, 0, 0].repeat(9), BYTE, 4, true);
    let attributes = &mut file.primitive()["attributes"];
    (attributes["POSITION"], attributes["NORMAL"]) = (json!(positions), json!(normals));
    let imported = import_one(&file.glb()).mesh;
    for (imported, position) in imported.positions.iter().zip(&mesh.positions) {
        assert_eq!(imported.to_array(), shorts(position).map(f32::from));
    }
    assert_eq!(imported.normals, vec![Vec3::Y; 9]);
    assert_eq!(imported.indices, mesh.indices);

    file.json["accessors"][positions]["normalized"] = json!(true);
    let imported = import_one(&file.glb()).mesh;
    let expected = shorts(&mesh.positions[5]).map(|x| f32::from(x) / 32_767.0);
    assert_eq!(imported.positions[5].to_array(), expected);
}

/// A mesh is baked in its local space, whatever the transforms of its nodes.
#[test]
fn node_transforms_are_not_applied() {
    let mesh = fixtures::rock(2, 3);
    let mut file = GltfFile::of(&mesh);
    file.json["nodes"] = json!([
        { "mesh": 0, "scale": [-1, 2, 3], "translation": [4, 5, 6] },
        { "mesh": 0, "scale": [0, 0, 0] },
    ]);
    assert_eq!(import_one(&file.glb()).mesh, mesh);
}

fn packed_square(extension: &str) -> (SourceMesh, GltfFile) {
    let mut mesh = fixtures::plane(40);
    mesh.uvs.clear();
    let mut file = GltfFile::of(&mesh);
    let (bytes, count) = (file.binary.clone(), mesh.positions.len());
    file.binary.clear();
    for view in 0..2 {
        let vectors: Vec<[u8; 12]> = bytes[view * count * 12..][..count * 12]
            .as_chunks()
            .0
            .to_vec();
        let packed = meshopt::encode_vertex_buffer(&vectors).unwrap();
        let object = json!({ "byteStride": 12, "count": count, "mode": "ATTRIBUTES" });
        file.json["bufferViews"][view]["byteStride"] = json!(12);
        file.pack(view, extension, &packed, object);
    }
    let packed = meshopt::encode_index_buffer(&mesh.indices, count).unwrap();
    let object = json!({ "byteStride": 4, "count": mesh.indices.len(), "mode": "TRIANGLES" });
    file.pack(2, extension, &packed, object);
    file.json["extensionsRequired"] = json!([extension]);
    (mesh, file)
}

#[test]
fn meshopt_compressed_views_are_imported() {
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let (mut mesh, mut file) = packed_square(extension);
        let mut imported = import_one(&file.glb()).mesh;
        // The codec may rotate the corners of a triangle.
        for mesh in [&mut mesh, &mut imported] {
            let (triangles, _) = mesh.indices.as_chunks_mut::<3>();
            for triangle in triangles {
                let first = (0..3).min_by_key(|&k| triangle[k]).unwrap();
                triangle.rotate_left(first);
            }
        }
        assert_eq!(imported, mesh);
    }
}

/// Exponential filters and index sequences.
#[test]
fn filtered_views_are_imported() {
    let (mesh, mut file) = packed_square("EXT_meshopt_compression");
    let count = mesh.positions.len();
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(Vec3::to_array).collect();
    let words = meshopt::encode_filter_exp(&positions, 15, meshopt::EncodeExpMode::Separate);
    let packed = meshopt::encode_vertex_buffer(&words).unwrap();
    let object = json!({ "byteStride": 12, "count": count, "mode": "ATTRIBUTES",
        "filter": "EXPONENTIAL" });
    file.pack(0, "EXT_meshopt_compression", &packed, object);
    let packed = meshopt::encode_index_sequence(&mesh.indices, count).unwrap();
    let object = json!({ "byteStride": 4, "count": mesh.indices.len(), "mode": "INDICES" });
    file.pack(2, "EXT_meshopt_compression", &packed, object);
    let imported = import_one(&file.glb()).mesh;
    assert_eq!(imported.indices, mesh.indices);
    for (imported, position) in imported.positions.iter().zip(&mesh.positions) {
        assert!(imported.distance(*position) < 0.01, "{imported} {position}");
    }
}

#[test]
fn rejects_corrupt_packed_views() {
    let fault_of = |change: &dyn Fn(&mut Value)| {
        let (_, mut file) = packed_square("EXT_meshopt_compression");
        change(&mut file.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]);
        let error = import_gltf(&file.glb()).unwrap_err();
        assert!(!error.to_string().contains('\n'));
        let ImportError::PackedView { view: 0, fault } = error else {
            panic!("{error}")
        };
        fault
    };
    let cases: [(&str, Value, &str); 9] = [
        ("mode", json!("SQUARE"), "mode"),
        ("mode", json!("TRIANGLES"), "byteStride"),
        ("filter", json!("BLUR"), "filter"),
        ("filter", json!("OCTAHEDRAL"), "filter"),
        ("byteStride", json!(0), "byteStride"),
        ("byteStride", json!(260), "byteStride"),
        ("byteStride", json!(-4), "byteStride"),
        ("count", json!(u64::MAX), "count"),
        ("count", json!(1u64 << 40), "count"),
    ];
    for (property, value, named) in cases {
        let fault = fault_of(&|object| object[property] = value.clone());
        assert_eq!(fault, PackedViewFault::Property { property: named });
    }
    for (property, value) in [
        ("buffer", 7u64),
        ("byteOffset", u64::MAX),
        ("byteLength", 1 << 40),
    ] {
        let fault = fault_of(&|object| object[property] = json!(value));
        assert!(
            matches!(fault, PackedViewFault::OutOfBounds { .. }),
            "{fault}"
        );
    }
    assert_eq!(
        fault_of(&|object| object["byteLength"] = json!(3)),
        PackedViewFault::Corrupt
    );
}
