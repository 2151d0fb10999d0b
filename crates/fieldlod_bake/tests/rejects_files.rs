//! One test for each way in which a glTF file can be wrong.

mod common;

use common::gltf_file::GltfFile;
use fieldlod_bake::{
    AccessorFault, BakeConfig, BakeOutcome, BufferFault, ImportError, MeshError, PrimitiveFault,
    RigFault, SkipReason, bake_file, fixtures, import_gltf,
};
use proptest::prelude::*;
use serde_json::json;

fn bake(path: &std::path::Path) -> Result<BakeOutcome, ImportError> {
    bake_file(path, &BakeConfig::default(), &|_| ())
}

macro_rules! assert_rejects {
    ($path:expr, $pattern:pat) => {
        let error = bake($path).unwrap_err();
        assert!(matches!(error, $pattern), "{error:?}");
        let message = error.to_string();
        assert!(
            !message.contains('\n') && !message.is_empty(),
            "{message:?}"
        );
    };
}

fn square() -> GltfFile {
    GltfFile::of(&fixtures::plane(2))
}

#[test]
fn rejects_a_missing_file() {
    assert_rejects!(&square().folder().join("none.glb"), ImportError::Read(_));
}

#[test]
fn rejects_a_folder() {
    assert_rejects!(square().folder(), ImportError::Read(_));
}

#[test]
fn rejects_an_empty_file() {
    assert_rejects!(&square().write("empty.glb", b""), ImportError::Empty);
}

#[test]
fn rejects_what_is_not_gltf() {
    let file = square();
    assert_rejects!(&file.write("a.glb", b"\x89PNG\r\n"), ImportError::NotGltf);
    assert_rejects!(&file.write("b.gltf", b"  [1]"), ImportError::NotGltf);
}

#[test]
fn rejects_a_glb_cut_anywhere() {
    let mut file = square();
    let bytes = file.glb_bytes();
    for length in 4..bytes.len() {
        assert_rejects!(
            &file.write("cut.glb", &bytes[..length]),
            ImportError::Truncated { .. }
        );
    }
}

#[test]
fn rejects_other_versions() {
    let mut file = square();
    let mut bytes = file.glb_bytes();
    bytes[4] = 1;
    assert_rejects!(&file.write("one.glb", &bytes), ImportError::Version { .. });
    file.json["asset"]["version"] = json!("1.0");
    assert_rejects!(&file.glb(), ImportError::Version { .. });
}

#[test]
fn rejects_broken_json() {
    let file = square();
    assert_rejects!(
        &file.write("a.gltf", b"{ \"asset\": "),
        ImportError::Invalid(_)
    );
    assert_rejects!(&file.write("b.gltf", b"{}"), ImportError::Invalid(_));
}

#[test]
fn rejects_a_glb_without_json() {
    let mut file = square();
    let mut bytes = file.glb_bytes();
    bytes[16..20].copy_from_slice(b"NOPE");
    assert_rejects!(&file.write("a.glb", &bytes), ImportError::Invalid(_));
}

#[test]
fn rejects_references_to_nothing() {
    let mut file = square();
    file.primitive()["attributes"]["POSITION"] = json!(99);
    assert_rejects!(&file.glb(), ImportError::Invalid(_));
    let mut file = square();
    file.primitive()["indices"] = json!(99);
    assert_rejects!(&file.glb(), ImportError::Invalid(_));
    let mut file = square();
    file.accessor_of("POSITION")["bufferView"] = json!(99);
    assert_rejects!(&file.glb(), ImportError::Invalid(_));
    let mut file = square();
    file.json["bufferViews"][0]["buffer"] = json!(99);
    assert_rejects!(&file.glb(), ImportError::Invalid(_));
}

#[test]
fn rejects_a_primitive_without_positions() {
    let mut file = square();
    file.primitive()["attributes"] = json!({});
    assert_rejects!(&file.glb(), ImportError::Invalid(_));
}

#[test]
fn rejects_geometry_behind_an_extension() {
    for name in ["KHR_draco_mesh_compression", "VENDOR_unheard_of"] {
        let mut file = square();
        file.json["extensionsRequired"] = json!([name]);
        let error = bake(&file.glb()).unwrap_err();
        assert!(matches!(&error, ImportError::Extension(extension) if extension == name));
    }
}

#[test]
fn accepts_extensions_that_leave_geometry_alone() {
    let mut file = square();
    file.json["extensionsRequired"] = json!(["KHR_texture_transform", "KHR_materials_unlit"]);
    bake(&file.glb()).unwrap();
}

macro_rules! assert_rejects_buffer {
    ($path:expr, $pattern:pat) => {
        assert_rejects!(
            $path,
            ImportError::Buffer {
                buffer: 0,
                fault: $pattern
            }
        );
    };
}

#[test]
fn rejects_a_missing_external_buffer() {
    assert_rejects_buffer!(&square().gltf("gone.bin"), BufferFault::Read { .. });
}

#[test]
fn rejects_a_buffer_elsewhere() {
    let mut file = square();
    assert_rejects_buffer!(
        &file.gltf("https://example.org/a.bin"),
        BufferFault::Elsewhere { .. }
    );
}

#[test]
fn rejects_a_truncated_external_buffer() {
    let mut file = square();
    file.write("short.bin", &file.binary[..file.binary.len() - 1]);
    assert_rejects_buffer!(&file.gltf("short.bin"), BufferFault::Truncated { .. });
}

#[test]
fn rejects_garbled_data_uris() {
    for uri in ["data:application/octet-stream;base64,%%%", "data:nothing"] {
        assert_rejects_buffer!(&square().gltf(uri), BufferFault::DataUri(_));
    }
}

#[test]
fn rejects_a_missing_binary_chunk() {
    let mut file = square();
    file.json["buffers"] = json!([{ "byteLength": 4 }]);
    let text = file.json.to_string();
    assert_rejects_buffer!(
        &file.write("a.gltf", text.as_bytes()),
        BufferFault::NoBinaryChunk
    );
}

macro_rules! assert_rejects_accessor {
    ($path:expr, $pattern:pat) => {
        assert_rejects!(
            $path,
            ImportError::Accessor {
                fault: $pattern,
                ..
            }
        );
    };
}

#[test]
fn rejects_accessors_out_of_bounds() {
    for count in [10u64, 1 << 20] {
        let mut file = square();
        file.accessor_of("POSITION")["count"] = json!(count);
        assert_rejects_accessor!(&file.glb(), AccessorFault::OutOfBounds { .. });
    }
    for (field, value) in [
        ("byteOffset", u64::MAX),
        ("byteLength", u64::MAX),
        ("byteLength", 7),
    ] {
        let mut file = square();
        file.json["bufferViews"][0][field] = json!(value);
        assert_rejects_accessor!(&file.glb(), AccessorFault::OutOfBounds { .. });
    }
    let mut file = square();
    file.accessor_of("NORMAL")["byteOffset"] = json!(u64::MAX);
    assert_rejects_accessor!(&file.glb(), AccessorFault::OutOfBounds { .. });
}

#[test]
fn rejects_overlapping_elements() {
    let mut file = square();
    file.json["bufferViews"][0]["byteStride"] = json!(4);
    assert_rejects_accessor!(&file.glb(), AccessorFault::Stride { .. });
}

#[test]
fn rejects_absurd_counts() {
    let mut file = square();
    file.accessor_of("POSITION")["count"] = json!(u64::MAX);
    assert_rejects_accessor!(&file.glb(), AccessorFault::TooMany { .. });
    // Without a view it would be zeros for free.
    let mut file = square();
    let sparse = json!({ "count": 1, "indices": { "bufferView": 0, "componentType": 5121 },
        "values": { "bufferView": 0 } });
    *file.accessor_of("POSITION") = json!({ "count": 1u64 << 31, "componentType": 5126,
        "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0], "sparse": sparse });
    assert_rejects_accessor!(&file.glb(), AccessorFault::TooMany { .. });
}

#[test]
fn rejects_indices_that_are_not_unsigned() {
    for (component, kind) in [(5126, "SCALAR"), (5122, "SCALAR"), (5125, "VEC2")] {
        let mut file = square();
        file.index_accessor()["componentType"] = json!(component);
        file.index_accessor()["type"] = json!(kind);
        assert_rejects_accessor!(&file.glb(), AccessorFault::NotIndices { .. });
    }
}

#[test]
fn rejects_sparse_places_out_of_bounds() {
    let mut file = square();
    let places = file.add_accessor(&[200], 5121, "SCALAR", 1);
    let values = file.add_floats(&[1.0, 2.0, 3.0], "VEC3");
    let view =
        |accessor: usize, file: &GltfFile| file.json["accessors"][accessor]["bufferView"].clone();
    let (places, values) = (view(places, &file), view(values, &file));
    file.accessor_of("POSITION")["sparse"] = json!({ "count": 1,
        "indices": { "bufferView": places, "componentType": 5121 }, "values": { "bufferView": values } });
    assert_rejects_accessor!(&file.glb(), AccessorFault::OutOfBounds { .. });
}

#[test]
fn rejects_nan_positions_in_a_file() {
    let mut mesh = fixtures::plane(2);
    mesh.positions[5].y = f32::NAN;
    let error = bake(&GltfFile::of(&mesh).glb()).unwrap_err();
    assert!(matches!(
        &error,
        ImportError::Mesh {
            fault: MeshError::BadPosition { .. },
            ..
        }
    ));
    assert!(
        error
            .to_string()
            .starts_with("mesh 0 (\"part\"), primitive 0: vertex 5 "),
        "{error}"
    );
}

#[test]
fn rejects_indices_out_of_range_in_a_file() {
    let mut mesh = fixtures::plane(2);
    mesh.indices[7] = 1_000;
    let with_normals = bake(&GltfFile::of(&mesh).glb()).unwrap_err();
    mesh.normals.clear();
    let without_normals = bake(&GltfFile::of(&mesh).glb()).unwrap_err();
    for error in [with_normals, without_normals] {
        let ImportError::Mesh { fault, .. } = error else {
            panic!("{error}")
        };
        assert!(
            matches!(fault, MeshError::IndexOutOfRange { position: 7, .. }),
            "{fault}"
        );
    }
}

#[test]
fn rejects_a_file_without_meshes() {
    assert_rejects!(&GltfFile::empty().glb(), ImportError::NoMeshes);
}

fn skip_reason_of(path: &std::path::Path) -> SkipReason {
    let import = import_gltf(path).unwrap();
    assert!(import.primitives.is_empty());
    let error = bake(path).unwrap_err();
    assert!(
        matches!(error, ImportError::AllSkipped { count: 1, .. }),
        "{error:?}"
    );
    import.skipped[0].reason.clone()
}

#[test]
fn skips_points_and_lines() {
    for mode in 0..4 {
        let mut file = square();
        file.primitive()["mode"] = json!(mode);
        assert_eq!(skip_reason_of(&file.glb()), SkipReason::NotTriangles);
    }
}

#[test]
fn skips_skinned_meshes_without_joints() {
    let mut file = square();
    file.json["nodes"] = json!([{ "mesh": 0, "skin": 0 }]);
    file.json["skins"] = json!([{ "joints": [0] }]);
    let fault = RigFault::Format("joints or weights");
    let fault = SkipReason::Faulty(PrimitiveFault::Rig(fault));
    assert_eq!(import_gltf(&file.glb()).unwrap().skipped[0].reason, fault);
}

#[test]
fn skips_positions_of_unknown_format() {
    let mut file = square();
    file.accessor_of("POSITION")["componentType"] = json!(5125);
    assert_eq!(skip_reason_of(&file.glb()), SkipReason::PositionFormat);
}

#[test]
fn skips_a_primitive_without_triangles() {
    let mut file = square();
    file.index_accessor()["count"] = json!(0);
    assert_eq!(skip_reason_of(&file.glb()), SkipReason::NoTriangles);
}

/// A change of a file: at a share of its length, either any byte or one that keeps numbers numbers.
fn change() -> impl Strategy<Value = (u16, u8)> {
    (
        any::<u16>(),
        prop_oneof![any::<u8>(), b'0'..=b'9', b'0'..=b'9'],
    )
}

proptest! {
    /// An answer, whatever the bytes, and never a panic.
    #[test]
    fn survives_any_change(changes in prop::collection::vec(change(), 1..4)) {
        let mut file = square();
        let mut bytes = file.glb_bytes();
        for (place, value) in changes {
            let place = usize::from(place) * bytes.len() / (usize::from(u16::MAX) + 1);
            bytes[place] = value;
        }
        if let Ok(outcome) = bake(&file.write("changed.glb", &bytes)) {
            for primitive in outcome.file.primitives {
                primitive.hierarchy.validate().unwrap();
            }
        }
    }
}
