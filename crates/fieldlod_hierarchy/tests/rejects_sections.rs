//! One test for each way in which a section can be wrong although its checksum fits.

mod common;

use common::{Directory, HEADER_BYTES, sealed, strip_file};
use fieldlod_hierarchy::{BakedFile, FileError, Precision};

/// Places in the first section of the strip: a group, its unit of 4 vertices and 2 triangles.
const GROUP_INDEX: usize = 4;
const VERTEX_LIST: usize = GROUP_INDEX + 5 + (15 + 1 + 12) * 5;
const EDGES: usize = VERTEX_LIST + 5;
const CORNERS: usize = EDGES + 3 + 4;
const DISTANCES: usize = CORNERS + 5 + 4;
const VERTEX_ORDER: usize = DISTANCES + 3 + 5;

/// What the reader says if the bytes `before`, which must be there, become `after`.
fn fault_with(section: usize, place: usize, before: &[u8], after: &[u8]) -> FileError {
    let mut bytes = strip_file().to_bytes();
    let place = Directory::of(&bytes).sections[section].bytes.start + place;
    assert_eq!(
        &bytes[place..place + before.len()],
        before,
        "another layout"
    );
    bytes.splice(place..place + before.len(), after.iter().copied());
    BakedFile::from_bytes(&sealed(bytes)).unwrap_err()
}

fn assert_corrupt(fault: &FileError, what: &'static str) {
    assert_eq!(*fault, FileError::Corrupt { what });
}

#[test]
fn rejects_an_unknown_coding() {
    let fault = fault_with(0, GROUP_INDEX, &[0, 2], &[9, 2]);
    assert_corrupt(&fault, "the groups");
}

#[test]
fn rejects_corrupt_packed_numbers() {
    let fault = fault_with(0, GROUP_INDEX, &[0, 2], &[8, 2]);
    assert_corrupt(&fault, "the groups");
}

#[test]
fn rejects_two_groups_at_one_place() {
    let fault = fault_with(2, GROUP_INDEX, &[0, 0], &[0, 2]);
    assert_corrupt(&fault, "the groups");
}

#[test]
fn rejects_vertices_before_they_are_coded() {
    let fault = fault_with(0, VERTEX_LIST, &[0, 0], &[0, 1]);
    assert_corrupt(&fault, "the vertex lists");
}

#[test]
fn rejects_two_vertices_at_one_place() {
    let fault = fault_with(0, VERTEX_ORDER, &[1, 0, 8, 2, 8], &[1, 0, 8, 8, 8]);
    assert_corrupt(&fault, "the vertex order");
}

#[test]
fn rejects_vertices_outside_of_the_source() {
    let fault = fault_with(0, VERTEX_ORDER, &[1, 0, 8, 2, 8], &[1, 0, 8, 2, 80]);
    assert_corrupt(&fault, "the vertex order");
}

/// The first triangle cannot share an edge with one before it.
#[test]
fn rejects_edges_of_no_triangle() {
    let fault = fault_with(0, EDGES, &[1, 48], &[1, 0]);
    assert_corrupt(&fault, "the triangles");
}

/// The first corner can be neither one that was used a moment ago nor one along a border.
#[test]
fn rejects_unused_corners() {
    let fault = fault_with(0, CORNERS, &[1, 0, 19, 19, 0], &[1, 3, 19, 19, 0]);
    assert_corrupt(&fault, "the triangles");
    let fault = fault_with(0, CORNERS, &[1, 0, 19, 19, 0], &[1, 1, 19, 19, 0]);
    assert_corrupt(&fault, "the triangles");
}

#[test]
fn rejects_unknown_corner_codes() {
    let fault = fault_with(0, CORNERS, &[1, 0, 19, 19, 0], &[1, 0, 19, 20, 0]);
    assert_corrupt(&fault, "the triangles");
}

#[test]
fn rejects_missing_corner_distances() {
    let fault = fault_with(0, CORNERS, &[1, 0, 19, 19, 0], &[1, 19, 19, 19, 0]);
    assert_corrupt(&fault, "the triangles");
}

#[test]
fn rejects_corners_outside_of_the_unit() {
    let fault = fault_with(0, DISTANCES, &[1, 4, 1], &[1, 8, 1]);
    assert_corrupt(&fault, "the triangles");
    // The next vertex after the unit's last, which the triangle before it took.
    let fault = fault_with(0, DISTANCES, &[1, 4, 1], &[1, 6, 1]);
    assert_corrupt(&fault, "the triangles");
    // Before the first.
    let fault = fault_with(0, DISTANCES, &[1, 4, 1], &[1, 1, 1]);
    assert_corrupt(&fault, "the triangles");
}

#[test]
fn rejects_a_negative_position_error() {
    let mut bytes = strip_file().to_bytes_with(Precision::Quantized16.into());
    let grids = HEADER_BYTES + 12 + "strip".len() + 8 + 3;
    let error = grids + 11 * 16;
    assert!(f32::from_le_bytes(bytes[error..error + 4].try_into().unwrap()) >= 0.0);
    for value in [-1.0f32, f32::NAN] {
        bytes[error..error + 4].copy_from_slice(&value.to_le_bytes());
        let fault = BakedFile::from_bytes(&sealed(bytes.clone())).unwrap_err();
        assert_corrupt(&fault, "the directory");
    }
}
