//! Round trips of `.fieldlod` files and bounds of quantization.

use fieldlod_hierarchy::fixtures::{self, Random};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy, Precision, Vertices};
use glam::{Vec2, Vec3, Vec4};
use proptest::prelude::*;

use crate::common::{bytes_of, file_of, strip_file};

#[test]
fn files_round_trip() {
    for file in [
        strip_file(),
        BakedFile::default(),
        file_of(Hierarchy::default()),
        file_of(fixtures::grid_pyramid(0)),
        file_of(fixtures::grid_pyramid(3)),
        file_of(fixtures::grid_pyramid(2).whole_mesh_levels().unwrap()),
    ] {
        assert!(BakedFile::from_bytes(&file.to_bytes()) == Ok(file));
    }
    assert!(strip_file().find(3, 1).is_some());
    assert!(strip_file().find(3, 2).is_none());
}

#[test]
fn unused_vertices_and_missing_attributes_round_trip() {
    let mut hierarchy = fixtures::two_level_strip();
    hierarchy.source_vertex_count += 1;
    hierarchy.vertices.normals.clear();
    hierarchy
        .vertices
        .positions
        .push(Vec3::new(-0.0, f32::MAX, 1e-45));
    hierarchy.vertices.colors = vec![Vec4::new(f32::MIN, -0.0, 1e-45, f32::INFINITY); 7];
    let read = BakedFile::from_bytes(&file_of(hierarchy.clone()).to_bytes()).unwrap();
    let read = &read.primitives[0].hierarchy.vertices;
    assert_eq!(bits(read), bits(&hierarchy.vertices));
    assert!(read.normals.is_empty());
}

/// Hills with random positions, and random bits in all other attributes.
fn scrambled(seed: u64) -> Hierarchy {
    let mut random = Random::new(seed);
    let mut hierarchy = fixtures::grid_pyramid(1);
    let vertices = &mut hierarchy.vertices;
    for position in &mut vertices.positions {
        *position = random.vector() * 1000.0;
    }
    let mut numbers = || f32::from_bits(random.next_u64() as u32);
    let normals = &mut vertices.normals;
    normals.fill_with(|| Vec3::from_array([(); 3].map(|()| numbers())));
    let count = vertices.positions.len();
    for uvs in [&mut vertices.uvs, &mut vertices.uvs_1] {
        uvs.clear();
        uvs.resize_with(count, || Vec2::from_array([(); 2].map(|()| numbers())));
    }
    for values in [&mut vertices.tangents, &mut vertices.colors] {
        values.clear();
        values.resize_with(count, || Vec4::from_array([(); 4].map(|()| numbers())));
    }
    for group in &mut hierarchy.groups {
        group.bounds.radius = 1e4;
    }
    for unit in &mut hierarchy.units {
        (unit.aabb.min, unit.aabb.max) = (Vec3::splat(-1e3), Vec3::splat(1e3));
    }
    hierarchy
}

/// Attributes as bits, because NaN does not equal itself.
fn bits(vertices: &Vertices) -> Vec<u32> {
    let positions = vertices.positions.iter().flat_map(Vec3::to_array);
    let normals = vertices.normals.iter().flat_map(Vec3::to_array);
    let uvs = vertices.uvs.iter().chain(&vertices.uvs_1);
    let uvs = uvs.flat_map(Vec2::to_array);
    let tangents = vertices.tangents.iter().flat_map(Vec4::to_array);
    let colors = vertices.colors.iter().flat_map(Vec4::to_array);
    let all = positions.chain(normals).chain(uvs).chain(tangents);
    all.chain(colors).map(f32::to_bits).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_attributes_round_trip_bit_for_bit(seed: u64, rotation in 0usize..3) {
        let mut hierarchy = scrambled(seed);
        // Triangles keep their first corner.
        for triangle in hierarchy.indices.as_chunks_mut::<3>().0.iter_mut().step_by(2) {
            triangle.rotate_left(rotation);
        }
        let file = file_of(hierarchy);
        let mut read = BakedFile::from_bytes(&file.to_bytes()).unwrap();
        let read = read.primitives.remove(0).hierarchy;
        let expected = &file.primitives[0].hierarchy;
        prop_assert_eq!(bits(&read.vertices), bits(&expected.vertices));
        prop_assert_eq!(&read.indices, &expected.indices);
        prop_assert_eq!(&read.unit_vertices, &expected.unit_vertices);
        prop_assert_eq!(&read.moved_from, &expected.moved_from);
        prop_assert_eq!(&read.groups, &expected.groups);
        prop_assert_eq!(&read.units, &expected.units);
    }
}

/// The bounds are documented at [`Precision::Quantized16`].
#[test]
fn quantized_attributes_are_within_documented_bounds() {
    let hierarchy = fixtures::grid_pyramid(3);
    let bytes = bytes_of(&hierarchy, Precision::Quantized16);
    assert!(
        bytes == bytes_of(&hierarchy, Precision::Quantized16),
        "equal contents"
    );
    let read = BakedFile::from_bytes(&bytes).unwrap().primitives.remove(0);
    let (new, old) = (&read.hierarchy.vertices, &hierarchy.vertices);
    let extent = hierarchy.aabb().unwrap();
    let half_a_step = (extent.max - extent.min).length() / 65_535.0 / 2.0;
    assert!(read.position_error_in_local > 0.0);
    assert!(read.position_error_in_local <= half_a_step * 1.01);
    for (new, old) in new.positions.iter().zip(&old.positions) {
        assert!(new.distance(*old) <= read.position_error_in_local);
    }
    for (new, old) in read.hierarchy.groups.iter().zip(&hierarchy.groups) {
        let grown = |old: f32| old + read.position_error_in_local;
        assert_eq!(new.deviation_in_local, grown(old.deviation_in_local));
        assert_eq!(new.bounds.radius, grown(old.bounds.radius));
    }
    let is_near = |new: Vec3, old: Vec3| new.distance(old).to_degrees() <= 0.125;
    for (new, old) in new.normals.iter().zip(&old.normals) {
        assert!(is_near(*new, *old));
    }
    for (new, old) in new.tangents.iter().zip(&old.tangents) {
        assert!(is_near(new.truncate(), old.truncate()) && new.w == old.w);
    }
    for (new, old) in new.uvs_1.iter().zip(&old.uvs_1) {
        assert!((new - old).abs().max_element() <= 7.0 / 65_535.0 * 0.51);
    }
    for (new, old) in new.colors.iter().zip(&old.colors) {
        assert!((new - old).abs().max_element() <= 1.0 / 65_535.0 * 0.51);
    }
    assert_eq!(read.hierarchy.indices, hierarchy.indices);
    assert_eq!(read.hierarchy.unit_vertices, hierarchy.unit_vertices);
}

#[test]
fn lossless_files_keep_the_position_error() {
    let bytes = bytes_of(&fixtures::grid_pyramid(1), Precision::Quantized16);
    let read = BakedFile::from_bytes(&bytes).unwrap();
    assert!(read.primitives[0].position_error_in_local > 0.0);
    assert!(BakedFile::from_bytes(&read.to_bytes()) == Ok(read));
}

/// As the parts of a character, which change their levels together.
#[test]
fn primitives_with_one_box_have_equal_rounding() {
    let mut file = BakedFile::default();
    for levels in [3, 1] {
        let hierarchy = fixtures::grid_pyramid(levels);
        let mut primitive = BakedPrimitive::new(0, 0, "", hierarchy);
        primitive.grid_box = file
            .primitives
            .first()
            .and_then(|p: &BakedPrimitive| p.hierarchy.aabb());
        file.primitives.push(primitive);
    }
    let bytes = file.to_bytes_with(Precision::Quantized16);
    let read = BakedFile::from_bytes(&bytes).unwrap();
    let [large, small] = &read.primitives[..] else {
        panic!("two primitives");
    };
    assert_eq!(large.position_error_in_local, small.position_error_in_local);
    let again = read.to_bytes_with(Precision::Quantized16);
    let again = BakedFile::from_bytes(&again).unwrap();
    assert_eq!(again.primitives[0].hierarchy.groups, large.hierarchy.groups);
}

#[test]
fn quantized_directions_are_exact_on_axes() {
    let mut hierarchy = fixtures::two_level_strip();
    let mut normals = vec![
        Vec3::X,
        Vec3::NEG_Y,
        Vec3::NEG_Z,
        Vec3::Z,
        Vec3::ZERO,
        Vec3::NAN,
    ];
    hierarchy.vertices.normals.clone_from(&normals);
    let bytes = bytes_of(&hierarchy, Precision::Quantized16);
    let read = BakedFile::from_bytes(&bytes).unwrap().primitives.remove(0);
    normals[5] = Vec3::ZERO;
    assert_eq!(read.hierarchy.vertices.normals, normals);
}
