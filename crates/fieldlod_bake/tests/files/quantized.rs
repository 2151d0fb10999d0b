//! Files with positions rounded to 16 bits.

use std::collections::BTreeMap;

use crate::common::character::character_of;
use crate::common::gltf_file::GltfFile;
use fieldlod_bake::{
    BakeConfig, Import, SourceMesh, VerifySettings, bake_import, fixtures, import_gltf_bytes,
    verify, verify_rigged,
};
use fieldlod_hierarchy::{BakedFile, Hierarchy, Precision};
use glam::Vec3;

fn import(file: &mut GltfFile) -> Import {
    import_gltf_bytes(&file.glb_bytes(), &|_| unreachable!("one file")).unwrap()
}

/// Bakes a file, writes it with rounded positions, and reads it.
fn quantized(file: &mut GltfFile) -> (Import, BakedFile) {
    let config = BakeConfig::default();
    let outcome = bake_import(import(file), &config, &|_| ()).unwrap();
    let bytes = outcome.file.to_bytes_with(Precision::Quantized16);
    (import(file), BakedFile::from_bytes(&bytes).unwrap())
}

/// A plane of squares with a bump between two values of x.
fn tile(cells: u32, size: f32, from: f32, to: f32) -> SourceMesh {
    let mut mesh = fixtures::plane(cells);
    let [a, b] = [from, to].map(|x| x * size);
    for position in &mut mesh.positions {
        *position *= size;
        position.x += a;
        let across = (position.x - a) / (b - a);
        position.y += 0.02 * size * (across * 9.0).sin() * (position.z * 7.0 / size).sin();
    }
    mesh
}

/// Flat regions have no deviation but the rounding. Thirds are on no grid.
#[test]
fn stated_deviation_contains_the_rounding() {
    let mut flat = fixtures::plane(24);
    for position in &mut flat.positions {
        let [x, _, z] = (*position / 3.0).to_array();
        *position = Vec3::new(x, (x * 0.7 + z * 0.3) / 7.0, z) * 1000.0;
    }
    let (import, file) = quantized(&mut GltfFile::of(&flat));
    let hierarchy = &file.primitives[0].hierarchy;
    assert!(hierarchy.vertices.positions != flat.positions);
    let settings = VerifySettings::default();
    let verified = verify(&import.primitives[0].mesh, hierarchy, &settings).unwrap();
    assert!(verified.simplified_to_source <= 1.0 && verified.source_to_simplified <= 1.0);
    let mut understated = hierarchy.clone();
    let groups = understated.groups.iter_mut();
    let error = file.primitives[0].position_error_in_local;
    groups.for_each(|group| group.deviation_in_local -= error);
    assert!(verify(&import.primitives[0].mesh, &understated, &settings).is_err());
}

/// The tiles have different boxes.
#[test]
fn meshes_that_meet_share_rounded_borders() {
    let (near, far) = (tile(16, 1.0, 0.0, 1.0), tile(16, 1.0, 1.0, 2.0));
    let mut file = GltfFile::of(&near);
    file.add_mesh(&far);
    file.add_mesh(&fixtures::icosphere(2));
    for mesh in 0..2 {
        file.list("nodes").push(serde_json::json!({ "mesh": mesh }));
    }
    let moved = serde_json::json!({ "mesh": 2, "translation": [0.0, 5.0, 0.0] });
    file.list("nodes").push(moved);
    let (_, baked) = quantized(&mut file);
    let exact = [&near, &far].map(|mesh| mesh.positions.iter());
    let mut rounded: BTreeMap<[u32; 3], Vec3> = BTreeMap::new();
    let mut shared = 0;
    for (exact, baked) in exact.into_iter().zip(&baked.primitives) {
        for (exact, stored) in exact.zip(&baked.hierarchy.vertices.positions) {
            let key = exact.to_array().map(f32::to_bits);
            let first = *rounded.entry(key).or_insert(*stored);
            shared += u32::from(exact.x == 1.0);
            assert_eq!(first, *stored, "{exact}");
        }
    }
    assert!(shared >= 34, "{shared}");
    let errors = baked.primitives.iter().map(|p| p.position_error_in_local);
    let errors: Vec<f32> = errors.collect();
    assert!(
        errors[0] == errors[1] && errors[0] != errors[2],
        "{errors:?}"
    );
}

#[test]
fn rounded_parts_of_characters_have_equal_levels() {
    let (import, file) = quantized(&mut character_of(16, 1.0));
    let [a, b] = &file.primitives[..] else {
        panic!("two primitives");
    };
    assert_eq!(a.hierarchy.groups, b.hierarchy.groups);
    let parts: Vec<Option<Hierarchy>> = [a, b].map(|p| Some(p.hierarchy.clone())).into();
    for (_, verified) in verify_rigged(&import, &parts, &VerifySettings::default()) {
        verified.unwrap();
    }
}
