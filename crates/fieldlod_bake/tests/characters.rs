//! Levels of skinned and morphed meshes.

mod common;

use common::character::{LENGTH, character, influence};
use common::gltf_file::GltfFile;
use fieldlod_bake::{BakeConfig, Import, bake_import, bake_rigged, import_gltf_bytes};
use fieldlod_hierarchy::{BakedFile, Hierarchy};
use glam::Vec3;
use serde_json::json;

fn import(file: &mut GltfFile) -> Import {
    import_gltf_bytes(&file.glb_bytes(), &|_| unreachable!("one file")).unwrap()
}

fn bake(import: &Import) -> Vec<Hierarchy> {
    let baked = bake_rigged(import, &BakeConfig::default()).into_iter();
    baked.map(|(_, baked)| baked.unwrap().0).collect()
}

#[test]
fn importer_reads_joints_weights_targets_and_clips() {
    let import = import(&mut character(1.0));
    assert_eq!(import.skipped, []);
    assert_eq!(import.primitives.len(), 2);
    for primitive in &import.primitives {
        let rig = primitive.rig.as_ref().unwrap();
        let positions = primitive.mesh.positions.iter();
        let (joints, weights): (Vec<_>, Vec<_>) = positions.map(|p| influence(*p)).unzip();
        assert_eq!(
            (rig.skin, &rig.joints, &rig.weights),
            (Some(0), &joints, &weights)
        );
        let deltas = primitive
            .mesh
            .positions
            .iter()
            .map(|p| Vec3::X * (p.y * 0.2));
        assert_eq!(rig.targets, [deltas.collect::<Vec<_>>()]);
    }
    assert_eq!(import.skins[0].joints, [1, 2, 3]);
    let tip = import.skins[0].inverse_binds[2].transform_point3(Vec3::Y * LENGTH);
    assert!(tip.length() < 1e-6, "{tip}");
    assert_eq!(import.nodes[3].parent, Some(2));
    let names: Vec<&str> = import.clips.iter().map(|clip| &*clip.name).collect();
    assert_eq!(names, ["bend", "twist"]);
    assert_eq!(import.clips[0].channels[0].values.len(), 44);
}

/// Bevy gives each triangle of a mesh without normals its own vertices.
#[test]
fn joints_follow_vertices_that_are_split() {
    let mut file = character(1.0);
    for part in 0..2 {
        let primitive = &mut file.json["meshes"][0]["primitives"][part];
        primitive["attributes"]
            .as_object_mut()
            .unwrap()
            .remove("NORMAL");
        primitive.as_object_mut().unwrap().remove("targets");
    }
    for primitive in import(&mut file).primitives {
        assert_eq!(primitive.mesh.positions.len(), primitive.mesh.indices.len());
        let rig = primitive.rig.unwrap();
        for (at, joints) in primitive.mesh.positions.iter().zip(rig.joints) {
            assert_eq!(joints, influence(*at).0);
        }
    }
}

#[test]
fn parts_of_a_character_have_equal_levels() {
    let [a, b] = &bake(&import(&mut character(1.0)))[..] else {
        panic!("two primitives");
    };
    assert!(a.groups.len() > 4, "{}", a.groups.len());
    assert_eq!(a.groups, b.groups);
    assert_eq!(a.carrier_joint, b.carrier_joint);
    assert_eq!(a.carrier_joint, Some(1));
    for hierarchy in [a, b] {
        hierarchy.validate().unwrap();
        assert_eq!(hierarchy.units.len(), hierarchy.groups.len());
        let source = hierarchy.source_vertex_count as usize;
        assert_eq!(hierarchy.vertices.positions.len(), source);
        assert_eq!(hierarchy.whole_mesh_levels().as_ref(), Some(hierarchy));
    }
}

#[test]
fn source_hash_holds_joints_and_targets() {
    let import = import(&mut character(1.0));
    let hierarchies = bake(&import);
    for (primitive, hierarchy) in import.primitives.iter().zip(&hierarchies) {
        let rig = primitive.rig.as_ref().unwrap();
        let vertices = primitive.mesh.source_hash();
        let joints = vertices.with_joints(&rig.joints, &rig.weights);
        assert_eq!(hierarchy.source, joints.with_morph_target(&rig.targets[0]));
        assert_ne!(hierarchy.source, joints);
        assert_ne!(joints, vertices);
    }
}

#[test]
fn files_hold_characters_beside_static_meshes() {
    let mut file = character(1.0);
    file.add_mesh(&fieldlod_bake::fixtures::icosphere(3));
    file.list("nodes").push(json!({ "mesh": 1 }));
    let config = BakeConfig::default();
    let outcome = bake_import(import(&mut file), &config, &|_| ()).unwrap();
    let primitives = &outcome.file.primitives;
    let places = primitives.iter().map(|p| [p.mesh_index, p.primitive_index]);
    assert!(places.eq([[0, 0], [0, 1], [1, 0]]));
    let joints = primitives.iter().map(|p| p.hierarchy.carrier_joint);
    assert!(joints.eq([Some(1), Some(1), None]));
    let bytes = outcome.file.to_bytes();
    assert_eq!(BakedFile::from_bytes(&bytes).unwrap(), outcome.file);
}
