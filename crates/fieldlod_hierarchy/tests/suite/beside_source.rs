//! Files that omit source vertices.

use fieldlod_hierarchy::{
    BakedFile, BakedPrimitive, FileError, FileOptions, Hierarchy, InvalidHierarchy, Precision,
    Vertices, fixtures,
};
use glam::{Vec2, Vec3};

use crate::common::{Directory, bytes_of, sealed, strip_file};

const LOSSLESS: FileOptions = FileOptions {
    precision: Precision::Lossless,
    beside_source: true,
};

fn read(bytes: &[u8]) -> BakedPrimitive {
    let file = BakedFile::from_bytes_beside_source(bytes);
    file.unwrap().primitives.remove(0)
}

/// Returns the fault of reading a pyramid with a changed source.
fn fault_with(change: impl FnOnce(&mut Vertices)) -> InvalidHierarchy {
    let hierarchy = fixtures::grid_pyramid(1);
    let mut source = hierarchy.source_vertices();
    change(&mut source);
    let incomplete = read(&bytes_of(&hierarchy, LOSSLESS)).hierarchy;
    incomplete.with_source_vertices(&source).unwrap_err()
}

#[test]
fn lossless_files_round_trip() {
    for hierarchy in [
        Hierarchy::default(),
        fixtures::two_level_strip(),
        fixtures::grid_pyramid(3),
    ] {
        let found = read(&bytes_of(&hierarchy, LOSSLESS)).hierarchy;
        let has_source = hierarchy.source_vertex_count > 0;
        assert_eq!(found.lacks_source_vertices(), has_source);
        let source = hierarchy.source_vertices();
        assert!(found.with_source_vertices(&source) == Ok(hierarchy));
    }
}

#[test]
fn quantized_files_have_exact_source_vertices() {
    let hierarchy = fixtures::grid_pyramid(3);
    let source = hierarchy.source_vertices();
    let quantized = FileOptions {
        precision: Precision::Quantized16,
        ..LOSSLESS
    };
    let found = read(&bytes_of(&hierarchy, quantized));
    let error_in_local = found.position_error_in_local;
    let whole = found.hierarchy.with_source_vertices(&source).unwrap();
    assert!(whole.source_vertices() == source);
    assert_eq!(whole.moved_from, hierarchy.moved_from);
    assert_eq!(whole.indices, hierarchy.indices);
    assert_eq!(whole.unit_vertices, hierarchy.unit_vertices);
    let positions = whole.vertices.positions.iter();
    let pairs = positions.zip(&hierarchy.vertices.positions);
    let distances = pairs.map(|(found, exact)| found.distance(*exact));
    let largest = distances.fold(0.0, f32::max);
    assert!(largest > 0.0 && largest <= error_in_local);
}

#[test]
fn bytes_are_independent_of_source_vertices() {
    let hierarchy = fixtures::grid_pyramid(2);
    let mut other = hierarchy.clone();
    let count = other.source_vertex_count as usize;
    other.vertices.uvs[..count].fill(Vec2::ONE);
    assert!(bytes_of(&other, LOSSLESS) == bytes_of(&hierarchy, LOSSLESS));
}

#[test]
fn complete_files_can_be_read_beside_their_source() {
    let file = strip_file();
    let read = BakedFile::from_bytes_beside_source(&file.to_bytes()).unwrap();
    assert!(read == file);
    let strip = fixtures::two_level_strip();
    assert!(strip.clone().with_source_vertices(&Vertices::default()) == Ok(strip));
}

#[test]
fn rejects_missing_source_vertices() {
    let bytes = strip_file().to_bytes_with(LOSSLESS);
    let fault = FileError::SourceVerticesLeftOut { primitive: 0 };
    assert_eq!(BakedFile::from_bytes(&bytes), Err(fault));
    let hierarchy = read(&bytes_of(&fixtures::grid_pyramid(1), LOSSLESS)).hierarchy;
    let fault = InvalidHierarchy::LacksSourceVertices;
    assert_eq!(hierarchy.validate(), Err(fault));
}

#[test]
fn rejects_other_sources() {
    use InvalidHierarchy::{OtherAttributes, OtherSource, PositionNotFinite};
    let (vertices, expected) = (33 * 33 + 1, 33 * 33);
    let fault = fault_with(|source| source.positions.push(Vec3::ZERO));
    assert_eq!(fault, OtherSource { vertices, expected });
    let fault = fault_with(|source| source.positions[40].y = f32::INFINITY);
    assert_eq!(fault, PositionNotFinite { vertex: 40 });
    let without: [(_, fn(&mut Vertices)); 5] = [
        ("normals", |source| source.normals.clear()),
        ("uvs", |source| source.uvs.clear()),
        ("tangents", |source| source.tangents.clear()),
        ("second uvs", |source| source.uvs_1.clear()),
        ("colors", |source| source.colors.clear()),
    ];
    for (attribute, change) in without {
        assert_eq!(fault_with(change), OtherAttributes { attribute });
    }
    let fault = fault_with(|source| source.positions[40].y += 0.5);
    let expected = matches!(fault, InvalidHierarchy::TrianglesOutsideBounds { .. });
    assert!(expected, "{fault}");
    // The source has an attribute that the hierarchy lacks.
    let mut hierarchy = fixtures::two_level_strip();
    let source = hierarchy.source_vertices();
    hierarchy.vertices.normals.clear();
    let incomplete = read(&bytes_of(&hierarchy, LOSSLESS)).hierarchy;
    let attribute = "normals";
    let fault = incomplete.with_source_vertices(&source).unwrap_err();
    assert_eq!(fault, OtherAttributes { attribute });
}

/// Reading runs all checks that do not need source vertices.
#[test]
fn rejects_broken_graphs_without_their_source() {
    let mut bytes = strip_file().to_bytes_with(LOSSLESS);
    let section = Directory::of(&bytes).sections[0].bytes.clone();
    // The error of the terminal group.
    let infinite = f32::INFINITY.to_le_bytes();
    let windows = bytes[section.clone()].windows(4);
    let place = section.start + windows.into_iter().position(|w| w == infinite).unwrap();
    bytes[place..place + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let fault = BakedFile::from_bytes_beside_source(&sealed(bytes)).unwrap_err();
    assert!(matches!(fault, FileError::Invalid { .. }), "{fault}");
}

#[test]
fn rejects_bad_positions_without_source_vertices() {
    let mut hierarchy = Hierarchy::default();
    hierarchy.vertices.positions.push(Vec3::ZERO);
    let bytes = bytes_of(&hierarchy, LOSSLESS);
    for at in Directory::of(&bytes).sections[0].bytes.clone() {
        let mut bytes = bytes.clone();
        bytes[at] = 0xff;
        // The highest byte of a coordinate makes it infinite. An accepted file can be written.
        if let Ok(file) = BakedFile::from_bytes(&sealed(bytes)) {
            let _ = file.to_bytes();
        }
    }
}
