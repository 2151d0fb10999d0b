//! Hierarchies with moved vertices on the Bevy meshes that they were baked from.

use bevy::asset::AssetId;
use bevy::gltf::GltfAssetLabel;
use bevy::math::{Vec2, Vec3, Vec4};
use bevy::mesh::morph::MorphAttributes;
use bevy::mesh::{Mesh, MeshVertexAttribute, VertexAttributeValues, VertexFormat};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy, SourceHash, Unit, fixtures};

use super::changing::ChangingMeshes;
use super::source_arrays::{SourceArrays, place_in_gltf};
use crate::api::events::LodError;
use crate::scene::unit_mesh::{UnitMeshes, source_indices, source_mesh, unit_mesh};

const WIND: MeshVertexAttribute =
    MeshVertexAttribute::new("Vertex_Wind", 988_540_917, VertexFormat::Float32);

fn pyramid() -> Hierarchy {
    fixtures::grid_pyramid(2)
}

/// The mesh that `hierarchy` was baked from.
fn source_of(hierarchy: &Hierarchy) -> Mesh {
    source_mesh(hierarchy, source_indices(hierarchy))
}

/// The mesh with a custom attribute: the index of each vertex.
fn with_wind(mesh: Mesh) -> Mesh {
    let count = mesh.count_vertices();
    let wind: Vec<f32> = (0..count).map(|vertex| vertex as f32).collect();
    mesh.with_inserted_attribute(WIND, wind)
}

/// The mesh with joints, weights and two morph targets that contain the index of each vertex.
fn with_rig(mesh: Mesh) -> Mesh {
    let count = mesh.count_vertices();
    let joints: Vec<[u16; 4]> = (0..count as u16).map(|v| [v, 1, 2, 3]).collect();
    let weights: Vec<[f32; 4]> = (0..count).map(|v| [v as f32, 0.0, 0.0, 1.0]).collect();
    let targets = (0..2 * count).map(|at| MorphAttributes {
        position: Vec3::splat(at as f32),
        normal: Vec3::X * at as f32,
        ..MorphAttributes::default()
    });
    mesh.with_inserted_attribute(
        Mesh::ATTRIBUTE_JOINT_INDEX,
        VertexAttributeValues::Uint16x4(joints),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, weights)
    .with_morph_targets(targets.collect())
}

fn source_hash(mesh: &Mesh) -> SourceHash {
    let source = SourceArrays::of(mesh).unwrap();
    let hash = source.vertices.source_hash(&source.indices);
    source.rig.add_to(hash)
}

/// Turns the hierarchy into that of a mesh without tangents.
fn lose_tangents(hierarchy: &mut Hierarchy) {
    let mut mesh = source_of(hierarchy);
    mesh.remove_attribute(Mesh::ATTRIBUTE_TANGENT);
    hierarchy.source = source_hash(&mesh);
    hierarchy.vertices.tangents.clear();
}

fn file_of(hierarchy: &Hierarchy) -> BakedFile {
    let file = BakedFile {
        primitives: vec![BakedPrimitive::new(0, 0, "", hierarchy.clone())],
    };
    BakedFile::from_bytes(&file.to_bytes()).unwrap()
}

fn find(mesh: &Mesh, file: &BakedFile) -> Result<Hierarchy, LodError> {
    SourceArrays::of(mesh)?.find_hierarchy(file, None, "pyramid")
}

fn cut(mesh: &Mesh, hierarchy: &Hierarchy, unit: &Unit) -> Mesh {
    let made = unit_mesh(mesh, hierarchy, 0, unit).unwrap();
    let index = hierarchy.units.iter().position(|other| other == unit);
    let units = UnitMeshes::new(hierarchy.clone());
    let later = units.make(mesh, index.unwrap() as u32).unwrap();
    assert!(later.attributes().eq(made.attributes()) && later.indices() == made.indices());
    made
}

/// The value at each vertex of `unit`.
fn of_unit<V: Copy, A: From<V>>(hierarchy: &Hierarchy, unit: &Unit, values: &[V]) -> Vec<A> {
    let vertices = hierarchy.vertices_of(unit).iter();
    vertices.map(|&v| values[v as usize].into()).collect()
}

/// For each vertex of `unit`, the source vertex that it came from.
fn origins(hierarchy: &Hierarchy, unit: &Unit) -> Vec<usize> {
    let first = hierarchy.source_vertex_count;
    let origin = |&v: &u32| match v.checked_sub(first) {
        Some(moved) => hierarchy.moved_from[moved as usize] as usize,
        None => v as usize,
    };
    hierarchy.vertices_of(unit).iter().map(origin).collect()
}

fn assert_cut(mesh: &Mesh, hierarchy: &Hierarchy) {
    let held = &hierarchy.vertices;
    let mut moved = 0;
    for unit in &hierarchy.units {
        let cut = cut(mesh, hierarchy, unit);
        let origins = origins(hierarchy, unit);
        use VertexAttributeValues::{Float32, Float32x2, Float32x3, Float32x4};
        let of_2 = |values: &[Vec2]| Float32x2(of_unit(hierarchy, unit, values));
        let of_3 = |values: &[Vec3]| Float32x3(of_unit(hierarchy, unit, values));
        let of_4 = |values: &[Vec4]| Float32x4(of_unit(hierarchy, unit, values));
        let expected = [
            (Mesh::ATTRIBUTE_POSITION, of_3(&held.positions)),
            (Mesh::ATTRIBUTE_NORMAL, of_3(&held.normals)),
            (Mesh::ATTRIBUTE_UV_0, of_2(&held.uvs)),
            (Mesh::ATTRIBUTE_UV_1, of_2(&held.uvs_1)),
            (Mesh::ATTRIBUTE_TANGENT, of_4(&held.tangents)),
            (Mesh::ATTRIBUTE_COLOR, of_4(&held.colors)),
            (WIND, Float32(origins.iter().map(|&v| v as f32).collect())),
        ];
        assert_eq!(cut.attributes().count(), expected.len());
        for (attribute, values) in expected {
            let same = cut.attribute(attribute.id) == Some(&values);
            assert!(same, "{}", attribute.name);
        }
        let first = hierarchy.source_vertex_count;
        let vertices = hierarchy.vertices_of(unit).iter();
        moved += vertices.filter(|&&vertex| vertex >= first).count();
    }
    assert!(moved > 0);
}

#[test]
fn moved_vertices_use_baked_attributes() {
    let hierarchy = pyramid();
    let mesh = with_wind(source_of(&hierarchy));
    assert_cut(&mesh, &hierarchy);
    assert_cut(&mesh, &hierarchy.whole_mesh_levels().unwrap());
}

#[test]
fn rigged_levels_have_rig_of_source_vertices() {
    let hierarchy = pyramid().whole_mesh_levels().unwrap();
    let mesh = with_rig(source_of(&hierarchy));
    let count = mesh.count_vertices();
    for unit in &hierarchy.units {
        let level = cut(&mesh, &hierarchy, unit);
        let origins = origins(&hierarchy, unit);
        let joints = origins.iter().map(|&v| [v as u16, 1, 2, 3]).collect();
        let joints = VertexAttributeValues::Uint16x4(joints);
        assert_eq!(level.attribute(Mesh::ATTRIBUTE_JOINT_INDEX), Some(&joints));
        let weights = origins.iter().map(|&v| [v as f32, 0.0, 0.0, 1.0]).collect();
        let weights = VertexAttributeValues::Float32x4(weights);
        assert_eq!(
            level.attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT),
            Some(&weights)
        );
        let all = mesh.morph_targets().unwrap();
        let targets = [0, count].map(|first| origins.iter().map(move |&v| all[first + v]));
        let targets: Vec<MorphAttributes> = targets.into_iter().flatten().collect();
        assert_eq!(level.morph_targets(), Some(&targets));
    }
}

#[test]
fn hash_includes_joints_and_morph_targets() {
    let plain = source_of(&pyramid());
    let rigged = with_rig(plain.clone());
    let mut hierarchy = pyramid();
    assert!(find(&rigged, &file_of(&hierarchy)).is_err());
    hierarchy.source = source_hash(&rigged);
    let file = file_of(&hierarchy);
    assert!(find(&plain, &file).is_err());
    assert!(find(&rigged, &file).is_ok());
    let mut other_weight = rigged.clone();
    let weights = other_weight.attribute_mut(Mesh::ATTRIBUTE_JOINT_WEIGHT);
    let Some(VertexAttributeValues::Float32x4(weights)) = weights else {
        panic!("weights are four floats");
    };
    weights[5][0] += 0.1;
    let mut targets = rigged.morph_targets().unwrap().clone();
    targets[7].position.y += 0.1;
    let other_target = rigged.clone().with_morph_targets(targets);
    for other in [other_weight, other_target] {
        assert!(matches!(find(&other, &file), Err(LodError::Stale { .. })));
    }
}

#[test]
fn contents_include_everything_that_levels_have() {
    let mesh = with_rig(with_wind(source_of(&pyramid())));
    let id = AssetId::default();
    let mut meshes = ChangingMeshes::default();
    assert!(!meshes.has_contents(id, &mesh));
    meshes.note_contents(id, &mesh);
    assert!(meshes.has_contents(id, &mesh.clone()));
    let mut other_wind = mesh.clone();
    let wind = vec![0.0f32; mesh.count_vertices()];
    other_wind.insert_attribute(WIND, wind);
    let mut other_target = mesh.morph_targets().unwrap().clone();
    other_target[7].normal.y += 0.1;
    let other_target = mesh.clone().with_morph_targets(other_target);
    let mut no_indices = mesh.clone();
    no_indices.remove_indices();
    let moved = mesh.clone().translated_by(Vec3::X);
    for other in [other_wind, other_target, no_indices, moved] {
        assert!(!meshes.has_contents(id, &other));
    }
    meshes.remove(id);
    assert!(!meshes.has_contents(id, &mesh));
}

#[test]
fn source_arrays_hold_all_baked_attributes() {
    let hierarchy = pyramid();
    let source = SourceArrays::of(&source_of(&hierarchy)).unwrap();
    let expected = hierarchy.source_vertices();
    assert!(!expected.uvs_1.is_empty() && !expected.tangents.is_empty());
    assert!(source.vertices == expected && !source.has_other_attributes);
    assert_eq!(source_hash(&source_of(&hierarchy)), hierarchy.source);
    let windy = SourceArrays::of(&with_wind(source_of(&hierarchy))).unwrap();
    assert!(windy.has_other_attributes);
}

#[test]
fn file_of_same_mesh_is_found() {
    let hierarchy = pyramid();
    let mesh = source_of(&hierarchy);
    assert!(find(&mesh, &file_of(&hierarchy)) == Ok(hierarchy));
}

#[test]
fn rejects_file_without_attribute_of_moved_vertices() {
    let missing = Err(LodError::MissingAttributes {
        file: "pyramid".into(),
    });
    let mut hierarchy = pyramid();
    let mesh = source_of(&hierarchy);
    hierarchy.moved_from.clear();
    let file = file_of(&hierarchy);
    assert!(find(&mesh, &file) == Ok(hierarchy.clone()));
    assert!(find(&with_wind(mesh.clone()), &file) == missing);
    lose_tangents(&mut hierarchy);
    assert!(find(&mesh, &file_of(&hierarchy)) == missing);
}

#[test]
fn rejects_file_of_another_mesh() {
    let stale = || {
        Err(LodError::Stale {
            file: "pyramid".into(),
        })
    };
    let mesh = source_of(&pyramid());
    let other = fixtures::grid_pyramid(1);
    assert!(find(&mesh, &file_of(&other)) == stale());
    // A file with the hash of this mesh.
    let claiming = Hierarchy {
        source: pyramid().source,
        ..other
    };
    assert!(find(&mesh, &file_of(&claiming)) == stale());
    // A mesh without an attribute of the levels.
    let mut bare = mesh.clone();
    bare.remove_attribute(Mesh::ATTRIBUTE_NORMAL);
    assert!(find(&bare, &file_of(&pyramid())) == stale());
}

#[test]
fn meshes_with_unused_vertices_find_their_levels() {
    let hierarchy = pyramid();
    let used = SourceArrays::of(&source_of(&hierarchy)).unwrap();
    // A vertex far away before all others.
    let mut whole = SourceArrays::of(&source_of(&hierarchy)).unwrap();
    let with_first: Vec<u32> = std::iter::once(0)
        .chain(0..hierarchy.source_vertex_count)
        .collect();
    whole.vertices = used.vertices.at(&with_first);
    whole.vertices.positions[0] = Vec3::splat(1e9);
    whole.indices.iter_mut().for_each(|index| *index += 1);
    let file = file_of(&hierarchy);
    let found = whole.find_hierarchy(&file, None, "pyramid").unwrap();
    assert_eq!(found.validate(), Ok(()));
    assert_eq!(found.source_vertex_count, hierarchy.source_vertex_count + 1);
    let pairs = found.units.iter().zip(&hierarchy.units);
    for (found_unit, unit) in pairs {
        let positions: Vec<Vec3> = of_unit(&found, found_unit, &found.vertices.positions);
        let expected: Vec<Vec3> = of_unit(&hierarchy, unit, &hierarchy.vertices.positions);
        assert!(positions == expected);
    }
}

/// For example, two trees may share a trunk and have different levels of it.
#[test]
fn equal_meshes_find_levels_of_their_own_place() {
    let mut file = file_of(&pyramid());
    let mut other = file.primitives[0].clone();
    (other.mesh_index, other.primitive_index) = (2, 1);
    other.hierarchy.groups[0].deviation_in_local *= 0.5;
    file.primitives.push(other);
    let mesh = SourceArrays::of(&source_of(&pyramid())).unwrap();
    let found = |place| mesh.find_hierarchy(&file, place, "pyramid").unwrap();
    let [first, second] = [0, 1].map(|index: usize| &file.primitives[index].hierarchy.groups);
    assert!(first != second);
    assert!(found(Some([0, 0])).groups == *first && found(Some([2, 1])).groups == *second);
    // Other places use the first hierarchy that fits.
    assert!(found(Some([1, 1])).groups == *first && found(None).groups == *first);
}

#[test]
fn place_is_parsed_from_gltf_label() {
    let label = |mesh, primitive| GltfAssetLabel::Primitive { mesh, primitive }.to_string();
    assert_eq!(place_in_gltf(&label(12, 3)), Some([12, 3]));
    for other in ["Mesh12", "Scene0", "Mesh1/Primitive", "Mesh/Primitive1", ""] {
        assert_eq!(place_in_gltf(other), None);
    }
}

#[test]
fn rejects_missing_vertices() {
    let mesh = source_of(&pyramid());
    let mut broken = file_of(&pyramid());
    broken.primitives[0].hierarchy.unit_vertices[3] = 1_000_000;
    assert!(matches!(find(&mesh, &broken), Err(LodError::Stale { .. })));
}

#[test]
fn rejects_attributes_of_different_length() {
    let mesh = source_of(&pyramid()).with_inserted_attribute(WIND, vec![0.0f32; 5]);
    let attribute = WIND.name;
    let error = SourceArrays::of(&mesh).err();
    assert_eq!(error, Some(LodError::AttributeCount { attribute }));
}
