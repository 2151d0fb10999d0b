//! One test for each fault of a section whose checksum matches.

mod common;

use common::{Directory, sealed, strip_file};
use fieldlod_hierarchy::{BakedFile, FileError};

// Offsets in the first section of the strip: a group and its unit of 4 vertices and 2 triangles.
const GROUP_INDEX: usize = 4;
const VERTEX_LIST: usize = GROUP_INDEX + 5 + (15 + 1 + 12) * 5;
const EDGES: usize = VERTEX_LIST + 5;
const CORNERS: usize = EDGES + 3 + 4;
const DISTANCES: usize = CORNERS + 5 + 4;
const VERTEX_ORDER: usize = DISTANCES + 3 + 5;

/// Returns the fault after the bytes `old` of a section are replaced by `new`.
fn fault_with(section: usize, offset: usize, old: &[u8], new: &[u8]) -> FileError {
    let mut bytes = strip_file().to_bytes();
    let offset = Directory::of(&bytes).sections[section].bytes.start + offset;
    assert_eq!(
        &bytes[offset..offset + old.len()],
        old,
        "the layout changed"
    );
    bytes[offset..offset + new.len()].copy_from_slice(new);
    BakedFile::from_bytes(&sealed(bytes)).unwrap_err()
}

/// Declares tests: section, offset, old bytes, and new bytes that must give the fault.
macro_rules! rejects {
    ($($name:ident: $what:literal, $section:literal, $offset:ident, $old:expr => $($new:expr),+;)+) => {
        $(#[test]
        fn $name() {
            $(let fault = fault_with($section, $offset, &$old, &$new);
            assert_eq!(fault, FileError::Corrupt { what: $what });)+
        })+
    };
}

rejects! {
    rejects_unknown_codings: "the groups", 0, GROUP_INDEX, [0, 2] => [9, 2];
    rejects_corrupt_packed_numbers: "the groups", 0, GROUP_INDEX, [0, 2] => [8, 2];
    rejects_groups_with_equal_indices: "the groups", 2, GROUP_INDEX, [0, 0] => [0, 2];
    rejects_references_to_later_vertices: "the vertex lists", 0, VERTEX_LIST, [0, 0] => [0, 1];
    rejects_vertices_with_equal_indices:
        "the vertex order", 0, VERTEX_ORDER, [1, 0, 8, 2, 8] => [1, 0, 8, 8, 8];
    rejects_source_vertices_out_of_range:
        "the vertex order", 0, VERTEX_ORDER, [1, 0, 8, 2, 8] => [1, 0, 8, 2, 80];
    rejects_shared_edges_of_the_first_triangle: "the triangles", 0, EDGES, [1, 48] => [1, 0];
    rejects_recent_and_border_vertices_of_the_first_triangle:
        "the triangles", 0, CORNERS, [1, 0, 19, 19, 0] => [1, 3, 19, 19, 0], [1, 1, 19, 19, 0];
    rejects_unknown_corner_symbols:
        "the triangles", 0, CORNERS, [1, 0, 19, 19, 0] => [1, 0, 19, 20, 0];
    rejects_missing_corner_distances:
        "the triangles", 0, CORNERS, [1, 0, 19, 19, 0] => [1, 19, 19, 19, 0];
    rejects_corners_outside_of_the_unit:
        "the triangles", 0, DISTANCES, [1, 4, 1] => [1, 8, 1], [1, 6, 1], [1, 1, 1];
}
