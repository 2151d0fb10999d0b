//! One case for each fault of a section whose checksum matches.

use fieldlod_hierarchy::{BakedFile, FileError, InvalidHierarchy};

use crate::common::{Directory, sealed, strip_file};

// Offsets in the first section of the strip: a group and its unit of 4 vertices and 2 triangles.
const GROUP_INDEX: usize = 4;
const FINER_COUNT: usize = GROUP_INDEX + 5 + 12 * 5;
const FINER: usize = GROUP_INDEX + 5 + 15 * 5;
const PRODUCED_BY: usize = FINER + 5 + 7 * 5;
const VERTEX_LIST: usize = GROUP_INDEX + 5 + (15 + 1 + 12) * 5;
const FIRST_CORNERS: usize = VERTEX_LIST + 5;
const SECOND_CORNERS: usize = FIRST_CORNERS + 3;
const THIRD_CORNERS: usize = SECOND_CORNERS + 9;
const VERTEX_ORDER: usize = THIRD_CORNERS + 3;

/// Returns the fault after the bytes `old` of a section are replaced by `new`.
fn fault_with(section: usize, offset: usize, old: &[u8], new: &[u8]) -> FileError {
    let mut bytes = strip_file().to_bytes();
    let offset = Directory::of(&bytes).sections[section].bytes.start + offset;
    assert!(bytes[offset..].starts_with(old), "the layout changed");
    bytes[offset..offset + new.len()].copy_from_slice(new);
    BakedFile::from_bytes(&sealed(bytes)).unwrap_err()
}

/// The section, the offset, old bytes, and new bytes that must give the fault.
macro_rules! rejects {
    ($($name:literal: $what:literal, $section:literal, $offset:ident, $old:expr => $new:expr;)+) => {
        #[test]
        fn rejects_broken_sections_with_matching_checksums() {
            $(let fault = fault_with($section, $offset, &$old, &$new);
            assert_eq!(fault, FileError::Corrupt { what: $what }, $name);)+
        }
    };
}

rejects! {
    "unknown coding": "the groups", 0, GROUP_INDEX, [0, 2] => [9, 2];
    "corrupt packed numbers": "the groups", 0, GROUP_INDEX, [0, 2] => [8, 2];
    "groups with equal indices": "the groups", 2, GROUP_INDEX, [0, 0] => [0, 2];
    "group index beyond the groups": "the groups", 0, GROUP_INDEX, [0, 2] => [0, 4];
    "producer that does not exist": "the units", 2, PRODUCED_BY, [0, 0] => [0, 1];
    "later vertex": "the vertex lists", 0, VERTEX_LIST, [0, 0] => [0, 1];
    "vertices with equal indices":
        "the vertex order", 0, VERTEX_ORDER, [1, 0, 1, 4, 5] => [1, 0, 1, 4, 4];
    "vertex 6 of 6": "the vertex order", 0, VERTEX_ORDER, [1, 0, 1, 4, 5] => [1, 0, 1, 4, 6];
    "corner before 0": "the triangles", 0, FIRST_CORNERS, [1, 0, 3] => [1, 4, 3];
    "corner 4 of 4": "the triangles", 0, THIRD_CORNERS, [1, 5, 0] => [1, 0, 0];
    "unknown number of a corner":
        "the triangles", 0, SECOND_CORNERS, [4, 2, 0, 1, 0] => [4, 3, 0, 1, 0];
}

#[test]
fn rejects_links_to_groups_that_do_not_exist() {
    let mut bytes = strip_file().to_bytes();
    let start = Directory::of(&bytes).sections[2].bytes.start;
    // The group of source geometry gets a finer group.
    bytes[start + FINER_COUNT..][..2].copy_from_slice(&[0, 1]);
    bytes[start + FINER..][..2].copy_from_slice(&[0, 7]);
    let fault = BakedFile::from_bytes(&sealed(bytes)).unwrap_err();
    let is_expected = |fault: &_| matches!(fault, InvalidHierarchy::DanglingReference { .. });
    assert!(
        matches!(&fault, FileError::Invalid { fault, .. } if is_expected(fault)),
        "{fault}"
    );
}
