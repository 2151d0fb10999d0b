//! Levels of skinned and morphed meshes.

use crate::common::character::{LENGTH, character, character_of, influence};
use crate::common::gltf_file::GltfFile;
use fieldlod_bake::{
    BakeConfig, Character, ClipFault, Import, MeshError, PrimitiveFault, RigFault, RiggedVerified,
    SkipReason, VerifyError, VerifySettings, bake_import, bake_rigged, clip_poses, deviations,
    fixtures, import_gltf_bytes, verify_rigged,
};
use fieldlod_hierarchy::{BakedFile, Hierarchy};
use glam::{Mat4, Vec3};
use proptest::prelude::*;
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
            (&rig.skins, &rig.joints, &rig.weights),
            (&vec![0], &joints, &weights)
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

#[test]
fn channels_with_surplus_values_are_left_out() {
    let mut file = character(1.0);
    let rotations = file.add_floats(&[0.5; 48], "VEC4");
    file.json["animations"][0]["samplers"][0]["output"] = json!(rotations);
    assert_eq!(import(&mut file).clips.len(), 1);
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
    assert!(a.groups.len() > 3, "{}", a.groups.len());
    assert_eq!(a.groups, b.groups);
    assert_eq!(a.carrier_joint, b.carrier_joint);
    assert_eq!(a.carrier_joint, Some(1));
    for hierarchy in [a, b] {
        hierarchy.validate().unwrap();
        assert_eq!(hierarchy.units.len(), hierarchy.groups.len());
        let source = hierarchy.source_vertex_count as usize;
        assert_eq!(hierarchy.vertices.positions.len(), source);
        assert_eq!(hierarchy.whole_mesh_levels().as_ref(), Some(hierarchy));
        // Levels never get finer, and the coarsest has few triangles.
        let counts: Vec<u32> = hierarchy.units.iter().map(|u| u.triangle_count).collect();
        assert!(counts.is_sorted_by(|a, b| a >= b), "{counts:?}");
        assert!(counts.last() < Some(&40), "{counts:?}");
    }
}

/// Levels have source vertices only, and vertices at one position have the same joints. A border that is closed in the
/// bind pose is therefore closed in all poses.
#[test]
fn parts_of_characters_stay_closed_where_they_meet() {
    let parts = bake(&import(&mut character(1.0)));
    let positions: Vec<Vec3> = parts
        .iter()
        .flat_map(|part| part.vertices.positions.iter().copied())
        .collect();
    let weld = crate::common::weld(&positions);
    for level in 0..parts[0].units.len() {
        let mut first = 0;
        let mut triangles = Vec::new();
        for part in &parts {
            let own = part.triangles_of(&part.units[level]);
            triangles.extend(own.map(|triangle| triangle.map(|vertex| first + vertex)));
            first += part.vertices.positions.len() as u32;
        }
        // The ends of the tube are open in the source.
        let is_end = |vertex: u32| !(1e-3..=LENGTH - 1e-3).contains(&positions[vertex as usize].y);
        for ((a, b), _) in crate::common::open_edges(&triangles, &weld) {
            assert!(is_end(a) && is_end(b), "level {level}");
        }
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
    let mut outcome = bake_import(import(&mut file), &config, &|_| ()).unwrap();
    let primitives = &mut outcome.file.primitives;
    // Files do not hold the boxes.
    let boxes = primitives.iter_mut().map(|p| p.grid_box.take());
    let boxes: Vec<_> = boxes.collect();
    assert!(boxes[0].is_some() && boxes[0] == boxes[1] && boxes[2].is_none());
    let places = primitives.iter().map(|p| [p.mesh_index, p.primitive_index]);
    assert!(places.eq([[0, 0], [0, 1], [1, 0]]));
    let joints = primitives.iter().map(|p| p.hierarchy.carrier_joint);
    assert!(joints.eq([Some(1), Some(1), None]));
    let bytes = outcome.file.to_bytes();
    assert_eq!(BakedFile::from_bytes(&bytes).unwrap(), outcome.file);
}

/// The bake uses bent joints instead of clips. Deviations are measured in clips.
#[test]
fn stated_deviation_holds_in_held_out_clips() {
    let mut import = import(&mut character(1.0));
    let clips = std::mem::take(&mut import.clips);
    let baked = bake(&import);
    let character = &Character::all_of(&import)[0];
    let poses = clip_poses(character, &import, &clips);
    assert!(poses.len() > 20, "{}", poses.len());
    let parts: Vec<&Hierarchy> = baked.iter().collect();
    let levels = (0..baked[0].units.len()).map(|level| character.triangles_at(&parts, level));
    let levels: Vec<Vec<[u32; 3]>> = levels.collect();
    let measured = deviations(character, &poses, &levels);
    for (level, &deviation) in measured.iter().enumerate().skip(1) {
        let stated = baked[0].groups[level - 1].deviation_in_local;
        assert!(deviation > 0.0);
        assert!(deviation <= stated, "{level}: {deviation} {stated}");
    }
}

#[test]
fn spheres_hold_the_character_in_clips_and_targets() {
    let import = import(&mut character(1.0));
    let sphere = bake(&import)[0].groups[0].bounds;
    let character = &Character::all_of(&import)[0];
    for pose in clip_poses(character, &import, &import.clips) {
        for position in pose.positions(character) {
            assert!(position.distance(sphere.center) <= sphere.radius * 1.1);
        }
    }
    assert!(sphere.contains(Vec3::new(0.2 * LENGTH, LENGTH, 0.0)));
}

/// The second part is a copy of the first that follows another joint.
#[test]
fn triangles_that_coincide_in_bind_pose_are_measured() {
    let mut file = character_of(4, 1.0);
    let mut copy = file.primitive().clone();
    let count = file.accessor_of("JOINTS_0")["count"].as_u64().unwrap() as usize;
    let joints = file.add_accessor(&vec![2; count * 4], 5121, "VEC4", count);
    copy["attributes"]["JOINTS_0"] = json!(joints);
    file.json["meshes"][0]["primitives"][1] = copy;
    let import = import(&mut file);
    let character = &Character::all_of(&import)[0];
    let poses = clip_poses(character, &import, &import.clips);
    let measured = deviations(character, &poses, &[character.triangles()]);
    assert!(measured[0] < 1e-4, "{measured:?}");
}

#[test]
fn nodes_with_other_morph_weights_are_posed() {
    let mut file = character_of(4, 1.0);
    let instance = json!({ "mesh": 0, "skin": 0, "weights": [5.0] });
    file.list("nodes").push(instance);
    let import = import(&mut file);
    let sphere = bake(&import)[0].groups[0].bounds;
    assert!(sphere.contains(Vec3::new(LENGTH, LENGTH, 0.0)));
}

#[test]
fn clips_of_other_files_move_nodes_by_name() {
    let clips = import(&mut character_of(2, 1.0));
    let mut file = character_of(2, 1.0);
    file.json["animations"] = json!([]);
    let mut plain = import(&mut file);
    plain.add_clips(clips.clone()).unwrap();
    assert_eq!(plain.clips, clips.clips);
    file.json["nodes"][0]["name"] = json!("middle");
    let ambiguous = import(&mut file).add_clips(clips.clone());
    let fault = ClipFault::AmbiguousNode("middle".into());
    assert_eq!(ambiguous, Err(fault));
    for node in 1..4 {
        file.json["nodes"][node]["name"] = json!("other");
    }
    file.json["nodes"][0]["name"] = json!("other");
    let unknown = import(&mut file).add_clips(clips);
    assert_eq!(unknown, Err(ClipFault::NoNode));
}

#[test]
fn rigged_primitives_beyond_16_bit_indices_are_skipped() {
    let mut file = character_of(4_100, 1.0);
    file.add_mesh(&fixtures::rock(2, 1));
    let outcome = bake_import(import(&mut file), &BakeConfig::default(), &|_| ()).unwrap();
    assert_eq!(
        (outcome.file.primitives.len(), outcome.skipped.len()),
        (1, 2)
    );
    let vertices = 4_101 * 16;
    let fault = PrimitiveFault::Mesh(MeshError::TooLargeForRig { vertices });
    for skipped in outcome.skipped {
        assert_eq!(skipped.reason, SkipReason::Faulty(fault.clone()));
    }
}

/// Changes the parts of a baked character, and verifies the first.
fn verified_after(change: impl FnOnce(&mut [Hierarchy])) -> Result<RiggedVerified, VerifyError> {
    let import = import(&mut character(1.0));
    let mut baked = bake(&import);
    change(&mut baked);
    let baked: Vec<Option<Hierarchy>> = baked.into_iter().map(Some).collect();
    let mut verified = verify_rigged(&import, &baked, &VerifySettings::default());
    verified.swap_remove(0).1
}

#[test]
fn verify_finds_changed_levels() {
    let share = verified_after(|_| ()).unwrap().share;
    assert!(share > 0.0 && share <= 1.0, "{share}");
    let differs = |change: fn(&mut [Hierarchy])| {
        assert_eq!(verified_after(change), Err(VerifyError::PartsDiffer));
    };
    differs(|parts| parts[0].carrier_joint = Some(2));
    differs(|parts| parts[0].carrier_joint = None);
    differs(|parts| parts[0].groups[0].deviation_in_local *= 0.5);
    let empty = verified_after(|parts| {
        let source = parts[0].source;
        parts[0] = Hierarchy::default();
        parts[0].source = source;
    });
    assert!(empty.is_err());
    let understated = verified_after(|parts| {
        let groups = parts.iter_mut().flat_map(|part| &mut part.groups);
        groups.for_each(|group| group.deviation_in_local *= 0.5);
    });
    let is_expected = matches!(understated, Err(VerifyError::SourceTooFar { .. }));
    assert!(is_expected, "{understated:?}");
}

/// The scale of inverse bind matrices does not scale the mesh.
#[test]
fn scaled_inverse_binds_do_not_scale_levels() {
    let plain = &bake(&import(&mut character(1.0)))[0];
    for scale in [0.01, 100.0] {
        let scaled = &bake(&import(&mut character(scale)))[0];
        assert_eq!(scaled.units.len(), plain.units.len());
        for (scaled, plain) in scaled.groups.iter().zip(&plain.groups) {
            let ratio = scaled.bounds.radius / plain.bounds.radius;
            assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
            if !plain.is_terminal() {
                let ratio = scaled.deviation_in_local / plain.deviation_in_local;
                assert!((0.5..2.0).contains(&ratio), "{ratio}");
            }
        }
    }
}

#[test]
fn equal_files_give_equal_levels() {
    assert_eq!(
        bake(&import(&mut character(1.0))),
        bake(&import(&mut character(1.0)))
    );
}

/// The faults of both primitives of a character with a change.
fn faults(change: impl FnOnce(&mut GltfFile)) -> Vec<PrimitiveFault> {
    let mut file = character_of(2, 1.0);
    change(&mut file);
    let skipped = import(&mut file).skipped.into_iter();
    let fault = skipped.map(|skipped| match skipped.reason {
        SkipReason::Faulty(fault) => fault,
        reason => panic!("{reason}"),
    });
    fault.collect()
}

/// Replaces the numbers of an attribute of the first primitive.
fn with_floats(file: &mut GltfFile, attribute: &str, float: f32) {
    let count = file.accessor_of(attribute)["count"].as_u64().unwrap() as usize;
    let floats = file.add_floats(&vec![float; count * 4], "VEC4");
    file.primitive()["attributes"][attribute] = json!(floats);
}

#[test]
fn faulty_rigs_are_skipped() {
    for weight in [f32::NAN, -1.0, 0.0, f32::INFINITY] {
        let found = faults(|file| with_floats(file, "WEIGHTS_0", weight));
        assert_eq!(found, [RigFault::BadWeights.into()]);
    }
    let found = faults(|file| set_binds(file, &[Mat4::ZERO; 3]));
    assert_eq!(found[0], RigFault::BadWeights.into());
    let found = faults(|file| file.json["skins"][0]["joints"] = json!([1]));
    // Vertices of the first half use the first joint.
    assert_eq!(found, [RigFault::BadWeights.into()]);
    let found = faults(|file| file.json["skins"][0]["joints"] = json!(vec![1; 300]));
    assert_eq!(found[0], RigFault::TooManyJoints { joints: 300 }.into());
    let found = faults(|file| {
        let target = file.primitive()["targets"][0].clone();
        file.primitive()["targets"] = json!(vec![target; 2000]);
    });
    assert_eq!(found, [RigFault::TooManyTargets { count: 2000 }.into()]);
    let found = faults(|file| file.list("nodes").push(json!({ "mesh": 0 })));
    assert_eq!(found[0], RigFault::PartlySkinned.into());
}

fn set_binds(file: &mut GltfFile, binds: &[Mat4]) {
    let numbers = binds.iter().flat_map(Mat4::to_cols_array);
    let bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
    let accessor = file.add_accessor(&bytes, 5126, "MAT4", binds.len());
    file.json["skins"][0]["inverseBindMatrices"] = json!(accessor);
}

/// The inverse bind matrices of [`character`], followed by others.
fn binds_and(others: &[Mat4]) -> Vec<Mat4> {
    let bind = |k: usize| Mat4::from_translation(Vec3::NEG_Y * (LENGTH * k as f32 / 2.0));
    let binds = (0..3).map(bind).chain(others.iter().copied());
    binds.collect()
}

/// Replaces joints and weights of a vertex of the first primitive.
fn set_influence(file: &mut GltfFile, vertex: usize, joint: u8, weights: [f32; 4]) {
    let mut at = |attribute: &str, size: usize| {
        let view = file.accessor_of(attribute)["bufferView"].as_u64().unwrap() as usize;
        let start = file.json["bufferViews"][view]["byteOffset"]
            .as_u64()
            .unwrap();
        start as usize + vertex * size
    };
    let (joints, floats) = (at("JOINTS_0", 4), at("WEIGHTS_0", 16));
    file.binary[joints] = joint;
    let bytes: Vec<u8> = weights.into_iter().flat_map(f32::to_le_bytes).collect();
    file.binary[floats..floats + 16].copy_from_slice(&bytes);
}

/// Checks that a character has levels that verify, and returns the first part.
fn baked_well(file: &mut GltfFile) -> Hierarchy {
    let import = import(file);
    assert_eq!(import.skipped, []);
    let baked = bake(&import);
    let coarsest = baked[0].units.last().unwrap().triangle_count;
    assert!(coarsest < 40 && baked[0].units.len() > 4, "{coarsest}");
    let all: Vec<Option<Hierarchy>> = baked.iter().cloned().map(Some).collect();
    for (_, verified) in verify_rigged(&import, &all, &VerifySettings::default()) {
        assert!(verified.unwrap().share <= 1.0);
    }
    baked.into_iter().next().unwrap()
}

/// Bevy draws such a vertex at the origin of the world, at no place, or by matrices of other meshes.
#[test]
fn odd_vertex_keeps_its_triangles_at_all_levels() {
    let odd = 100;
    let nan = [0.5, f32::NAN, 0.0, 0.0];
    for (joint, weights) in [
        (0, [0.0; 4]),
        (0, nan),
        (0, [0.1; 4]),
        (200, [1.0, 0.0, 0.0, 0.0]),
    ] {
        let mut file = character_of(16, 1.0);
        set_influence(&mut file, odd, joint, weights);
        let baked = baked_well(&mut file);
        for unit in &baked.units {
            let triangles = baked.triangles_of(unit);
            let at_odd = triangles.filter(|triangle| triangle.contains(&(odd as u32)));
            assert_eq!(at_odd.count(), 6, "{joint} {weights:?}");
        }
        // The vertex does not move the spheres of the others.
        assert!(baked.groups[0].bounds.radius < LENGTH * 1.1);
    }
}

#[test]
fn tiny_negative_weights_change_no_level() {
    let mut file = character_of(16, 1.0);
    let plain = baked_well(&mut file);
    let ([_, _, ..], weights) = influence(import(&mut file).primitives[0].mesh.positions[100]);
    set_influence(&mut file, 100, 0, [weights[0], weights[1], 0.0, -1e-9]);
    let baked = baked_well(&mut file);
    assert_eq!((baked.units, baked.indices), (plain.units, plain.indices));
}

#[test]
fn joints_without_vertices_may_have_any_matrix() {
    let plain = baked_well(&mut character_of(16, 1.0));
    for others in [
        vec![Mat4::ZERO],
        vec![Mat4::NAN],
        vec![],
        vec![Mat4::IDENTITY; 2],
    ] {
        let mut file = character_of(16, 1.0);
        file.json["skins"][0]["joints"] = json!([1, 2, 3, 0]);
        set_binds(&mut file, &binds_and(&others));
        let baked = baked_well(&mut file);
        assert_eq!(baked.indices, plain.indices);
    }
}

/// The first joint has most of the weight, but no inverse.
#[test]
fn flattened_joint_carries_no_character() {
    let mut file = character_of(16, 1.0);
    let mut binds = binds_and(&[]);
    binds[1] *= Mat4::from_scale(Vec3::new(1.0, 1.0, 0.0));
    set_binds(&mut file, &binds);
    assert_ne!(baked_well(&mut file).carrier_joint, Some(1));
}

/// Only the second skin is animated, and its joints are longer.
#[test]
fn mesh_of_two_skins_has_levels_for_both() {
    let mut file = character_of(16, 1.0);
    let plain = baked_well(&mut file);
    let step = json!([0.0, LENGTH, 0.0]);
    let skin = json!({ "joints": [5, 6, 7], "inverseBindMatrices": file.json["skins"][0]["inverseBindMatrices"] });
    file.list("skins").push(skin);
    file.list("nodes").extend([
        json!({ "mesh": 0, "skin": 1 }),
        json!({ "children": [6], "translation": [9.0, 0.0, 0.0] }),
        json!({ "children": [7], "translation": step }),
        json!({ "translation": step }),
    ]);
    let both = baked_well(&mut file);
    let imported = import(&mut file);
    assert_eq!(imported.primitives[0].rig.as_ref().unwrap().skins, [0, 1]);
    assert_eq!(both.source, plain.source);
    // The sphere holds the longer character.
    assert!(both.groups[0].bounds.radius > plain.groups[0].bounds.radius * 1.2);
}

/// A tube whose parts follow joints that are apart, and that share a place in the bind pose.
#[test]
fn parts_at_one_place_have_levels_as_if_apart() {
    let stacked = |copies: usize, apart: f32| {
        let ball = fixtures::icosphere(3);
        let count = ball.positions.len();
        let mut mesh = ball.clone();
        for copy in 1..copies {
            let moved = ball
                .positions
                .iter()
                .map(|p| *p + Vec3::X * (apart * copy as f32));
            mesh.positions.extend(moved);
            mesh.normals.extend(&ball.normals);
            let first = (copy * count) as u32;
            mesh.indices
                .extend(ball.indices.iter().map(|index| first + index));
        }
        let mut file = GltfFile::of(&mesh);
        let joints = (0..copies).flat_map(|copy| vec![[copy as u8, 0, 0, 0]; count]);
        let joints: Vec<u8> = joints.flatten().collect();
        let joints = file.add_accessor(&joints, 5121, "VEC4", copies * count);
        let weights = file.add_floats(&[1.0, 0.0, 0.0, 0.0].repeat(copies * count), "VEC4");
        let attributes = &mut file.primitive()["attributes"];
        attributes["JOINTS_0"] = json!(joints);
        attributes["WEIGHTS_0"] = json!(weights);
        let nodes: Vec<usize> = (1..=copies).collect();
        file.json["skins"] = json!([{ "joints": nodes }]);
        let bind = |copy: usize| Mat4::from_translation(Vec3::NEG_X * (apart * copy as f32));
        set_binds(&mut file, &(0..copies).map(bind).collect::<Vec<_>>());
        let joint = |copy: usize| json!({ "translation": [2.1 * copy as f32, 0.0, 0.0] });
        let nodes = [json!({ "mesh": 0, "skin": 0 })].into_iter();
        file.json["nodes"] = nodes.chain((0..copies).map(joint)).collect();
        let imported = import(&mut file);
        bake(&imported).remove(0)
    };
    let (together, apart) = (stacked(5, 0.0), stacked(5, 2.1));
    assert_eq!(together.units.len(), apart.units.len());
    for (together, apart) in together.groups.iter().zip(&apart.groups) {
        let most = apart.deviation_in_local * 1.25;
        assert!(
            together.deviation_in_local <= most,
            "{together:?} {apart:?}"
        );
    }
}

/// Rigs without inverse bind matrices, without clips, with one joint, and with a cycle of nodes.
#[test]
fn odd_rigs_are_baked() {
    let changes: [fn(&mut GltfFile); 4] = [
        |file| {
            _ = file.json["skins"][0]
                .as_object_mut()
                .unwrap()
                .remove("inverseBindMatrices");
        },
        |file| file.json["animations"] = json!([]),
        |file| {
            let count = file.accessor_of("JOINTS_0")["count"].as_u64().unwrap() as usize;
            let joints = file.add_accessor(&vec![0; count * 4], 5121, "VEC4", count);
            for part in 0..2 {
                let primitive = &mut file.json["meshes"][0]["primitives"][part];
                primitive["attributes"]["JOINTS_0"] = json!(joints);
            }
            file.json["skins"][0]["joints"] = json!([1]);
        },
        |file| file.json["nodes"][3]["children"] = json!([1]),
    ];
    for change in changes {
        let mut file = character_of(4, 1.0);
        change(&mut file);
        for hierarchy in bake(&import(&mut file)) {
            hierarchy.validate().unwrap();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Any bytes give a result or an error, never a panic.
    #[test]
    fn survives_any_change(changes in prop::collection::vec((any::<u16>(), any::<u8>()), 1..8)) {
        let mut bytes = character_of(2, 1.0).glb_bytes();
        for (place, value) in changes {
            let place = usize::from(place) * bytes.len() / (usize::from(u16::MAX) + 1);
            bytes[place] = value;
        }
        let nothing = |_: &str| Err(std::io::ErrorKind::NotFound.into());
        if let Ok(import) = import_gltf_bytes(&bytes, &nothing) {
            for (_, baked) in bake_rigged(&import, &BakeConfig::default()) {
                baked.unwrap().0.validate().unwrap();
            }
        }
    }
}
