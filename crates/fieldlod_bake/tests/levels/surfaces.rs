//! Import of materials from glTF files.

use std::sync::Arc;

use crate::common::gltf_file::GltfFile;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use fieldlod_bake::{
    BakeConfig, ImageFault, Import, SourceMesh, Surface, SurfaceAlpha, TextureMapping, UnreadImage,
    bake_file, bake_mesh, fixtures, import_gltf,
};
use glam::{Affine2, UVec2, Vec2, Vec4};
use serde_json::{Value, json};

const SIDE: u32 = 64;
const MASK: SurfaceAlpha = SurfaceAlpha::Mask { cutoff: 0.4 };

/// A leaf whose alpha decreases away from its centre.
fn leaf(x: u32, y: u32) -> [u8; 4] {
    let uv = (Vec2::new(x as f32, y as f32) + 0.5) / SIDE as f32;
    let alpha = 1.6 - ((uv - 0.5) * Vec2::new(3.0, 2.0)).length();
    [60, 3 * x as u8, 30, (alpha.clamp(0.0, 1.0) * 255.0) as u8]
}

fn leaf_png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIDE, SIDE);
    encoder.set_color(png::ColorType::Rgba);
    let texels = (0..SIDE).flat_map(|y| (0..SIDE).flat_map(move |x| leaf(x, y)));
    let texels: Vec<u8> = texels.collect();
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&texels).unwrap();
    writer.finish().unwrap();
    bytes
}

/// A minimal JPEG: 8 × 8 texels of gray 128.
fn gray_jpeg() -> Vec<u8> {
    let segments: [(u8, &[u8]); 5] = [
        (0xdb, &[&[0u8][..], &[1; 64]].concat()),
        (0xc0, &[8, 0, 8, 0, 8, 1, 1, 0x11, 0]),
        (0xc4, &[&[0x00, 1][..], &[0; 16]].concat()),
        (0xc4, &[&[0x10, 1][..], &[0; 16]].concat()),
        (0xda, &[1, 1, 0, 0, 63, 0]),
    ];
    let mut bytes = vec![0xff, 0xd8];
    for (kind, data) in segments {
        bytes.extend([0xff, kind, 0, data.len() as u8 + 2]);
        bytes.extend(data);
    }
    // Two zero coefficients, and the end marker.
    bytes.extend([0x3f, 0xff, 0xd9]);
    bytes
}

/// Leaves with a textured material that uses `image`.
fn leaves_with(image: Value) -> GltfFile {
    let mut file = GltfFile::of(&fixtures::cards(300, 3));
    file.json["images"] = json!([image]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file.json["materials"] = json!([{
        "alphaMode": "MASK",
        "alphaCutoff": 0.4,
        "pbrMetallicRoughness": {
            "baseColorFactor": [1.0, 0.5, 0.25, 0.75],
            "baseColorTexture": { "index": 0 },
        },
    }]);
    file.primitive()["material"] = json!(0);
    file
}

/// Leaves with an image in a buffer view.
fn leaves_with_bytes(bytes: &[u8]) -> GltfFile {
    let mut file = leaves_with(json!({ "mimeType": "image/png", "name": "leaf" }));
    let accessor = file.add_accessor(bytes, 5121, "SCALAR", bytes.len());
    file.json["images"][0]["bufferView"] = file.json["accessors"][accessor]["bufferView"].take();
    file.list("accessors").pop();
    file
}

fn plain() -> Surface {
    Surface::new(Vec4::new(1.0, 0.5, 0.25, 0.75), MASK)
}

fn expected(mapping: TextureMapping) -> Surface {
    plain().with_texture(UVec2::splat(SIDE), mapping, leaf)
}

fn import(file: &mut GltfFile) -> Import {
    import_gltf(&file.glb()).unwrap()
}

fn surface_of(file: &mut GltfFile) -> Option<Arc<Surface>> {
    let import = import(file);
    assert_eq!(import.unread_images, []);
    import.primitives[0].mesh.surface.clone()
}

/// Returns the only unread image. Asserts that the bake equals a bake with an unknown surface.
fn unread(mut file: GltfFile) -> UnreadImage {
    let outcome = bake_file(&file.glb(), &BakeConfig::default(), &|_| ()).unwrap();
    let cards = fixtures::cards(300, 3);
    let unknown = bake_mesh(&cards, &BakeConfig::default()).unwrap();
    assert!(outcome.file.primitives[0].hierarchy == unknown);
    let [unread] = &outcome.unread_images[..] else {
        panic!("{:?}", outcome.unread_images);
    };
    unread.clone()
}

#[test]
fn textures_are_read_from_buffers_and_uris() {
    let png = leaf_png();
    let uri = format!("data:image/png;base64,{}", STANDARD.encode(&png));
    let beside = leaves_with(json!({ "uri": "green%20leaf.png" }));
    beside.write("green leaf.png", &png);
    for mut file in [
        leaves_with_bytes(&png),
        leaves_with(json!({ "uri": uri })),
        beside,
    ] {
        let surface = surface_of(&mut file).unwrap();
        assert!(*surface == expected(TextureMapping::default()));
    }
}

#[test]
fn textures_change_the_bake_of_a_file() {
    let mut file = leaves_with_bytes(&leaf_png());
    let outcome = bake_file(&file.glb(), &BakeConfig::default(), &|_| ()).unwrap();
    let unknown = fixtures::cards(300, 3);
    let known = SourceMesh {
        surface: Some(Arc::new(expected(TextureMapping::default()))),
        ..unknown.clone()
    };
    let baked = |mesh: &SourceMesh| bake_mesh(mesh, &BakeConfig::default()).unwrap();
    assert!(outcome.file.primitives[0].hierarchy == baked(&known));
    assert!(outcome.file.primitives[0].hierarchy != baked(&unknown));
}

#[test]
fn a_jpeg_is_opaque() {
    let mut file = leaves_with_bytes(&gray_jpeg());
    let gray = |_, _| [128, 128, 128, 255];
    let expected = plain().with_texture(UVec2::splat(8), TextureMapping::default(), gray);
    assert!(*surface_of(&mut file).unwrap() == expected);
}

#[test]
fn texture_mappings_are_read() {
    let mut file = leaves_with_bytes(&leaf_png());
    let texture = |file: &mut GltfFile, value: Value| {
        file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = value;
    };
    texture(&mut file, json!({ "index": 0, "texCoord": 1 }));
    let mapping = TextureMapping {
        uses_uvs_1: true,
        ..TextureMapping::default()
    };
    assert!(*surface_of(&mut file).unwrap() == expected(mapping));
    let transform = json!({ "offset": [0.5, 0.25], "rotation": 0.5, "scale": [2.0, 3.0] });
    let extensions = json!({ "KHR_texture_transform": transform });
    texture(&mut file, json!({ "index": 0, "extensions": extensions }));
    let surface = surface_of(&mut file).unwrap();
    // The same transform as in Bevy.
    let (scale, offset) = (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.25));
    let transform = Affine2::from_scale_angle_translation(scale, -0.5, offset);
    let mapping = surface.mapping().unwrap();
    assert!(mapping.transform.abs_diff_eq(transform, 1e-6) && !mapping.uses_uvs_1);
    // A third set of texture coordinates is not supported.
    texture(&mut file, json!({ "index": 0, "texCoord": 2 }));
    assert!(surface_of(&mut file).is_none());
}

#[test]
fn primitives_without_material_have_no_surface() {
    let mut file = leaves_with_bytes(&leaf_png());
    file.json["materials"] = json!([{ "name": "paint" }]);
    let paint = Surface::new(Vec4::ONE, SurfaceAlpha::Opaque);
    assert!(*surface_of(&mut file).unwrap() == paint);
    file.primitive().as_object_mut().unwrap().remove("material");
    assert!(surface_of(&mut file).is_none());
}

/// Two materials share an image through different textures, one has another image, and one has none.
#[test]
fn materials_that_share_an_image_stay_separate() {
    let file_of = |image: &[u8], materials: &[usize]| {
        let mut file = leaves_with_bytes(image);
        file.write("gray.jpg", &gray_jpeg());
        file.list("images").push(json!({ "uri": "gray.jpg" }));
        file.json["textures"] = json!([{ "source": 0 }, { "source": 1 }, { "source": 0 }]);
        let material = |red: f32, texture: Value| {
            json!({ "alphaMode": "MASK", "pbrMetallicRoughness": {
                "baseColorFactor": [red, 1.0, 1.0, 1.0], "baseColorTexture": texture,
            } })
        };
        let turned = json!({ "KHR_texture_transform": { "rotation": 0.5 } });
        file.json["materials"] = json!([
            material(0.25, json!({ "index": 0 })),
            material(0.5, json!({ "index": 1 })),
            material(0.75, json!({ "index": 2, "extensions": turned })),
            material(1.0, Value::Null),
        ]);
        let primitive = file.primitive().clone();
        file.json["meshes"][0]["primitives"] = json!([]);
        for material in materials {
            let mut primitive = primitive.clone();
            primitive["material"] = json!(material);
            file.list("meshes")[0]["primitives"]
                .as_array_mut()
                .unwrap()
                .push(primitive);
        }
        import(&mut file)
    };
    let surfaces = |import: Import| {
        let primitives = import.primitives.into_iter();
        primitives.map(|p| p.mesh.surface).collect::<Vec<_>>()
    };
    let all = [2, 0, 3, 1, 2];
    let png = leaf_png();
    let alone = all.map(|material| surfaces(file_of(&png, &[material])).remove(0));
    assert!(alone.iter().all(Option::is_some) && alone[0] != alone[1]);
    assert!(surfaces(file_of(&png, &all)) == alone);
    // A broken image is reported once; other materials stay known.
    let broken = file_of(&png[..png.len() / 2], &all);
    assert_eq!(broken.unread_images.len(), 1);
    let [_, _, plain, gray, _] = alone;
    assert!(surfaces(broken) == [None, None, plain, gray, None]);
}

#[test]
fn unreadable_images_are_reported_and_ignored() {
    let name = |unread: &UnreadImage| unread.to_string();
    let unread_bytes = |bytes: &[u8]| unread(leaves_with_bytes(bytes));
    let png = leaf_png();
    // Unsupported format.
    let ktx = unread_bytes(b"\xabKTX 20\xbb\r\n\x1a\n");
    assert_eq!(ktx.fault, ImageFault::Format);
    assert_eq!(
        name(&ktx),
        "image 0 (\"leaf\") is ignored: it is neither PNG nor JPEG"
    );
    assert_eq!(unread_bytes(&[]).fault, ImageFault::Format);
    // Truncated.
    let broken = unread_bytes(&png[..png.len() / 2]).fault;
    assert!(matches!(broken, ImageFault::Broken(_)), "{broken}");
    let broken = unread_bytes(&gray_jpeg()[..40]).fault;
    assert!(matches!(broken, ImageFault::Broken(_)), "{broken}");
    // Missing or remote.
    for uri in ["none.png", "https://example.org/leaf.png"] {
        let missing = unread(leaves_with(json!({ "uri": uri })));
        assert!(matches!(missing.fault, ImageFault::Unavailable(_)));
        assert!(name(&missing).contains(uri), "{missing}");
    }
    let missing = unread(leaves_with(json!({ "uri": "data:image/png;base64,?" })));
    assert!(matches!(missing.fault, ImageFault::Unavailable(_)));
    let missing = unread(leaves_with(json!({ "name": "nowhere" })));
    assert_eq!(missing.fault, ImageFault::Missing);
    // A valid header with a size that is too large.
    let mut large = Vec::new();
    let mut encoder = png::Encoder::new(&mut large, 100_000, 1);
    encoder.set_color(png::ColorType::Grayscale);
    drop(encoder.write_header().unwrap());
    assert_eq!(unread_bytes(&large).fault, ImageFault::TooLarge(100_000, 1));
}

#[test]
fn damaged_images_do_not_panic() {
    for image in [leaf_png(), gray_jpeg()] {
        for at in 0..image.len() {
            let mut bytes = image.clone();
            bytes[at] ^= 1 << (at % 8);
            let _ = import(&mut leaves_with_bytes(&bytes));
        }
    }
}
