//! What a `.fieldlod` file keeps, and how much of it must be read.

mod common;

use std::collections::HashSet;
use std::sync::Arc;

use common::{Directory, strip_file, whole_hills_with_cards, with_cards};
use fieldlod_hierarchy::fixtures::{self, Random};
use fieldlod_hierarchy::{
    BakedFile, BakedPrimitive, CardPicture, FileOptions, Hierarchy, Precision, Vertices,
};
use glam::{Vec2, Vec3, Vec4};
use proptest::prelude::*;

fn file_of(hierarchy: Hierarchy) -> BakedFile {
    BakedFile {
        primitives: vec![BakedPrimitive::new(0, 0, "", hierarchy)],
    }
}

#[test]
fn what_was_written_is_read() {
    for file in [
        strip_file(),
        BakedFile::default(),
        file_of(Hierarchy::default()),
        file_of(fixtures::grid_pyramid(0)),
        file_of(fixtures::grid_pyramid(3)),
        file_of(with_cards(fixtures::grid_pyramid(1), 64)),
        file_of(whole_hills_with_cards(2)),
        file_of(with_cards(Hierarchy::default(), 4)),
    ] {
        assert!(BakedFile::from_bytes(&file.to_bytes()) == Ok(file));
    }
    assert!(strip_file().find(3, 1).is_some());
    assert!(strip_file().find(3, 2).is_none());
}

/// Attributes that are missing, numbers without a meaning, vertices without a use.
#[test]
fn odd_vertices_are_kept_bit_for_bit() {
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
    let bits = |v: &[Vec3]| {
        v.iter()
            .flat_map(Vec3::to_array)
            .map(f32::to_bits)
            .collect::<Vec<_>>()
    };
    assert_eq!(bits(&read.positions), bits(&hierarchy.vertices.positions));
    assert_eq!(read.colors, hierarchy.vertices.colors);
    assert!(read.normals.is_empty());
}

#[test]
fn the_same_contents_give_the_same_bytes() {
    for precision in [Precision::Lossless, Precision::Quantized16] {
        let bytes = || file_of(fixtures::grid_pyramid(2)).to_bytes_with(precision.into());
        assert_eq!(bytes(), bytes());
    }
}

/// The same hills with attributes that mean nothing, and places at random within bounds that hold
/// them all.
fn scrambled(seed: u64) -> Hierarchy {
    let mut random = Random::new(seed);
    let mut hierarchy = fixtures::grid_pyramid(1);
    let vertices = &mut hierarchy.vertices;
    for position in &mut vertices.positions {
        *position = random.vector() * 1000.0;
    }
    let mut numbers = || f32::from_bits(random.next_u64() as u32);
    vertices
        .normals
        .fill_with(|| Vec3::from_array([(); 3].map(|()| numbers())));
    vertices
        .uvs
        .fill_with(|| Vec2::from_array([(); 2].map(|()| numbers())));
    vertices
        .tangents
        .fill_with(|| Vec4::from_array([(); 4].map(|()| numbers())));
    for group in &mut hierarchy.groups {
        group.bounds.radius = 1e4;
    }
    for unit in &mut hierarchy.units {
        (unit.aabb.min, unit.aabb.max) = (Vec3::splat(-1e3), Vec3::splat(1e3));
    }
    hierarchy
}

/// All numbers of the vertices, bit for bit: NaN equals itself.
fn bits(vertices: &Vertices) -> Vec<u32> {
    let positions = vertices.positions.iter().flat_map(Vec3::to_array);
    let normals = vertices.normals.iter().flat_map(Vec3::to_array);
    let uvs = vertices.uvs.iter().flat_map(Vec2::to_array);
    let tangents = vertices.tangents.iter().flat_map(Vec4::to_array);
    let all = positions.chain(normals).chain(uvs).chain(tangents);
    all.map(f32::to_bits).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_numbers_come_back_bit_for_bit(seed: u64, turned in 0usize..3) {
        let mut hierarchy = scrambled(seed);
        // Triangles keep the corner at which they begin.
        for triangle in hierarchy.indices.as_chunks_mut::<3>().0.iter_mut().step_by(2) {
            triangle.rotate_left(turned);
        }
        let file = file_of(hierarchy);
        let source = file.primitives[0].hierarchy.source_vertices();
        for beside_source in [false, true] {
            let options = FileOptions { beside_source, ..FileOptions::default() };
            let bytes = file.to_bytes_with(options);
            let mut read = BakedFile::from_bytes_beside_source(&bytes).unwrap();
            let read = read.primitives.remove(0).hierarchy;
            let read = read.with_source_vertices(&source).unwrap();
            let expected = &file.primitives[0].hierarchy;
            prop_assert_eq!(bits(&read.vertices), bits(&expected.vertices));
            prop_assert_eq!(&read.indices, &expected.indices);
            prop_assert_eq!(&read.unit_vertices, &expected.unit_vertices);
            prop_assert_eq!(&read.moved_from, &expected.moved_from);
            prop_assert_eq!(&read.groups, &expected.groups);
            prop_assert_eq!(&read.units, &expected.units);
        }
    }
}

/// The first sections alone, and no byte after them, are a whole and coarser hierarchy.
#[test]
fn a_reader_may_stop_after_any_level() {
    let hierarchy = fixtures::grid_pyramid(4);
    for precision in [Precision::Lossless, Precision::Quantized16] {
        let bytes = file_of(hierarchy.clone()).to_bytes_with(precision.into());
        let sections = Directory::of(&bytes).sections;
        assert_eq!(sections.len(), 5);
        for (number, section) in sections.iter().enumerate() {
            let start = &bytes[..section.bytes.end];
            let read = BakedFile::from_bytes_coarse(start, number + 1).unwrap();
            let read = &read.primitives[0].hierarchy;
            read.validate().unwrap();
            assert_eq!(read.level_count(), number as u32 + 1);
            // Each tile of 512 triangles becomes four.
            assert_eq!(read.source_triangle_count(), 512 << (2 * number));
            // Nothing but what is in use, and whatever is coarser than the finest counts as its.
            let used: HashSet<u32> = read.unit_vertices.iter().copied().collect();
            assert_eq!(read.vertices.positions.len(), used.len());
            let is_whole = number == 4;
            assert_eq!(read.source_vertex_count as usize == used.len(), !is_whole);
            assert_eq!(read.moved_from.is_empty(), !is_whole);
            assert_eq!(read.source, hierarchy.source);
            let cut = BakedFile::from_bytes_coarse(&start[..start.len() - 1], number + 1);
            assert!(cut.is_err());
        }
        let all = BakedFile::from_bytes_coarse(&bytes, usize::MAX);
        assert!(all == BakedFile::from_bytes(&bytes));
    }
}

/// The promises at [`Precision::Quantized16`].
#[test]
fn quantized_attributes_stay_near() {
    let hierarchy = fixtures::grid_pyramid(3);
    let bytes = file_of(hierarchy.clone()).to_bytes_with(Precision::Quantized16.into());
    let read = BakedFile::from_bytes(&bytes).unwrap().primitives.remove(0);
    let (new, old) = (&read.hierarchy.vertices, &hierarchy.vertices);
    let extent = hierarchy.aabb().unwrap();
    let half_a_step = (extent.max - extent.min).length() / 65_535.0 / 2.0;
    assert!(read.position_error_in_local > 0.0);
    assert!(read.position_error_in_local <= half_a_step * 1.01);
    for (new, old) in new.positions.iter().zip(&old.positions) {
        assert!(new.distance(*old) <= read.position_error_in_local);
    }
    let near_enough = |new: Vec3, old: Vec3| new.distance(old).to_degrees() <= 0.125;
    assert!(
        new.normals
            .iter()
            .zip(&old.normals)
            .all(|(n, o)| near_enough(*n, *o))
    );
    for (new, old) in new.tangents.iter().zip(&old.tangents) {
        assert!(near_enough(new.truncate(), old.truncate()) && new.w == old.w);
    }
    for (new, old) in new.uvs_1.iter().zip(&old.uvs_1) {
        assert!((new - old).abs().max_element() <= 7.0 / 65_535.0 * 0.51);
    }
    for (new, old) in new.colors.iter().zip(&old.colors) {
        assert!((new - old).abs().max_element() <= 1.0 / 65_535.0 * 0.51);
    }
    // The triangles are the same.
    assert_eq!(read.hierarchy.indices, hierarchy.indices);
    assert_eq!(read.hierarchy.unit_vertices, hierarchy.unit_vertices);
}

#[test]
fn directions_come_back_on_the_axes_and_never_as_nan() {
    let mut hierarchy = fixtures::two_level_strip();
    hierarchy.vertices.normals = vec![
        Vec3::X,
        Vec3::NEG_Y,
        Vec3::NEG_Z,
        Vec3::ZERO,
        Vec3::splat(f32::NAN),
        Vec3::Z,
    ];
    let bytes = file_of(hierarchy).to_bytes_with(Precision::Quantized16.into());
    let read = BakedFile::from_bytes(&bytes).unwrap().primitives.remove(0);
    let expected = [
        Vec3::X,
        Vec3::NEG_Y,
        Vec3::NEG_Z,
        Vec3::ZERO,
        Vec3::ZERO,
        Vec3::Z,
    ];
    assert_eq!(read.hierarchy.vertices.normals, expected);
}

/// Hills of 131,072 triangles: position, normal and texture coordinates of all levels.
#[test]
fn a_file_is_small() {
    let mut hierarchy = fixtures::grid_pyramid(4);
    hierarchy.vertices.tangents.clear();
    hierarchy.vertices.uvs_1.clear();
    hierarchy.vertices.colors.clear();
    let triangles = hierarchy.source_triangle_count() as f64;
    let file = file_of(hierarchy);
    let bytes_each =
        |precision: Precision| file.to_bytes_with(precision.into()).len() as f64 / triangles;
    let [lossless, quantized] = [Precision::Lossless, Precision::Quantized16].map(bytes_each);
    println!("{lossless:.2} bytes a triangle lossless, {quantized:.2} quantized");
    assert!(lossless <= 20.0 && quantized <= 10.0);
}

#[test]
fn cards_are_exact_at_any_precision() {
    let hierarchies = [
        with_cards(fixtures::grid_pyramid(1), 32),
        whole_hills_with_cards(1),
    ];
    for (hierarchy, precision) in hierarchies.iter().flat_map(|hierarchy| {
        [Precision::Lossless, Precision::Quantized16].map(|precision| (hierarchy, precision))
    }) {
        let source = hierarchy.source_vertices();
        for beside_source in [false, true] {
            let options = FileOptions {
                precision,
                beside_source,
            };
            let bytes = file_of(hierarchy.clone()).to_bytes_with(options);
            let mut file = BakedFile::from_bytes_beside_source(&bytes).unwrap();
            let read = file.primitives.remove(0).hierarchy;
            let read = read.with_source_vertices(&source).unwrap();
            assert!(read.cards.is_some() && read.cards == hierarchy.cards);
        }
    }
}

/// What was read of whole meshes is what they are made of again: nothing more is to be added.
#[test]
fn whole_meshes_end_with_their_cards() {
    let whole = whole_hills_with_cards(2);
    let levels = whole.cards.clone().unwrap().levels;
    let last = &whole.units[whole.units.len() - levels.len()..];
    for (unit, level) in last.iter().zip(&levels) {
        assert_eq!(unit.triangle_count as usize, 2 * level.cards.len());
    }
    let bytes = file_of(whole.clone()).to_bytes_with(Precision::Quantized16.into());
    let read = BakedFile::from_bytes(&bytes).unwrap().primitives.remove(0);
    let read = read.hierarchy;
    assert_eq!(read.units.len(), whole.units.len());
    assert!(read.whole_mesh_levels() == Some(read));
}

/// Cards are the coarsest: all of them, unless units that were not read are the finest of them.
#[test]
fn coarse_levels_are_read_with_their_cards() {
    let file = file_of(with_cards(fixtures::grid_pyramid(2), 16));
    let cards = file.primitives[0].hierarchy.cards.clone();
    let bytes = file.to_bytes();
    for place in &Directory::of(&bytes).sections {
        let read = BakedFile::from_bytes_coarse(&bytes[..place.bytes.end], 1).unwrap();
        let read = &read.primitives[0].hierarchy;
        assert!(read.cards == cards && read.card_units().is_empty());
    }
    let whole = whole_hills_with_cards(2);
    let all = whole.cards.clone().unwrap();
    let bytes = file_of(whole.clone()).to_bytes();
    for sections in 1..=whole.units.len() {
        let read = BakedFile::from_bytes_coarse(&bytes, sections).unwrap();
        let read = &read.primitives[0].hierarchy;
        assert_eq!(read.units.len(), sections);
        let cards = read.cards.clone().unwrap();
        let left_out = all.levels.len().saturating_sub(sections);
        assert_eq!(cards.levels, all.levels[left_out..]);
        assert_eq!(cards.picture, all.picture);
        // Though there be nothing else.
        let first = sections - cards.levels.len();
        assert_eq!(read.card_units(), first..sections);
        assert!(read.whole_mesh_levels().as_ref() == Some(read));
    }
}

/// A mesh that looks like its coarsest cards, and has finer ones.
#[test]
fn a_mesh_with_fewer_units_than_levels_of_cards_keeps_them() {
    let strip = file_of(fixtures::two_level_strip()).to_bytes();
    let coarse = BakedFile::from_bytes_coarse(&strip, 1).unwrap();
    let mut hierarchy = with_cards(coarse.primitives[0].hierarchy.clone(), 8);
    hierarchy.cards.as_mut().unwrap().levels[1]
        .cards
        .truncate(1);
    assert!(hierarchy.card_units().is_empty());
    let file = file_of(hierarchy);
    assert!(BakedFile::from_bytes(&file.to_bytes()) == Ok(file));
}

/// A picture of 256 x 256 texels of flat leaves, of which a third is covered.
#[test]
fn pictures_of_cards_are_small() {
    let bytes_with =
        |hierarchy: Hierarchy| file_of(hierarchy).to_bytes_with(Precision::Quantized16.into());
    let strip = fixtures::two_level_strip();
    let bytes = bytes_with(with_cards(strip.clone(), 256)).len() - bytes_with(strip).len();
    println!("{bytes} bytes of cards");
    assert!(bytes <= 64 << 10);
}

/// Of one colour, so that the bytes that grant its memory are most of all.
#[test]
fn the_largest_picture_is_read() {
    let mut hierarchy = with_cards(fixtures::two_level_strip(), 4);
    let side_texels = CardPicture::MOST_SIDE_TEXELS;
    let texels = side_texels.pow(2) as usize;
    if let Some(cards) = &mut hierarchy.cards {
        cards.picture = Arc::new(CardPicture {
            side_texels,
            colors: vec![[1, 2, 3, 4]; texels],
            normals: vec![[5, 6, 7]; texels],
            turns_over: false,
            tint: Vec3::ONE,
        });
    }
    let file = file_of(hierarchy);
    assert!(BakedFile::from_bytes(&file.to_bytes()) == Ok(file));
}
