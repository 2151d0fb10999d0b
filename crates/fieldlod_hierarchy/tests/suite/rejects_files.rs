//! One case for each fault of a `.fieldlod` file.

use fieldlod_hierarchy::{BakedFile, FORMAT_VERSION, FileError, Precision, fixtures};
use proptest::prelude::*;

use crate::common::{Directory, HEADER_BYTES, bytes_of, sealed, strip_file};

fn fault_of(bytes: &[u8]) -> FileError {
    BakedFile::from_bytes(bytes).unwrap_err()
}

/// Returns the fault after bytes at `offset` are replaced and all checksums are updated.
fn fault_with(mut bytes: Vec<u8>, offset: usize, new: &[u8]) -> FileError {
    bytes[offset..offset + new.len()].copy_from_slice(new);
    fault_of(&sealed(bytes))
}

/// Offset of the attribute bits of the first directory entry.
const ATTRIBUTES: usize = HEADER_BYTES + 12 + "strip".len() + 8;
const GRIDS: usize = ATTRIBUTES + 3;
const POSITION_ERROR: usize = GRIDS + 11 * 16;

#[test]
fn rejects_other_file_types_and_versions() {
    for bytes in [&b""[..], b"glTF", b"FLDLOD\n\n"] {
        assert_eq!(fault_of(bytes), FileError::NotFieldlod);
    }
    for found in [0, FORMAT_VERSION + 1, u32::MAX] {
        let mut bytes = strip_file().to_bytes();
        bytes[8..12].copy_from_slice(&found.to_le_bytes());
        assert_eq!(fault_of(&bytes), FileError::Version { found });
    }
}

#[test]
fn rejects_truncated_files() {
    let bytes = strip_file().to_bytes();
    for length in 8..bytes.len() {
        let fault = fault_of(&bytes[..length]);
        assert!(
            matches!(fault, FileError::Truncated { .. }),
            "{length}: {fault}"
        );
    }
}

#[test]
fn rejects_bytes_after_the_end() {
    let mut bytes = strip_file().to_bytes();
    bytes.push(0);
    assert_eq!(fault_of(&bytes), FileError::TrailingBytes { extra: 1 });
}

#[test]
fn rejects_bytes_after_the_directory() {
    let mut bytes = strip_file().to_bytes();
    let directory = Directory::of(&bytes);
    bytes.splice(directory.end..directory.end, [0; 3]);
    let length = (directory.end - HEADER_BYTES) as u64 + 3;
    bytes[16..24].copy_from_slice(&length.to_le_bytes());
    let fault = fault_of(&sealed(bytes));
    assert_eq!(fault, FileError::TrailingBytes { extra: 3 });
}

#[test]
fn rejects_bytes_after_the_end_of_a_section() {
    let mut bytes = strip_file().to_bytes();
    let first = &Directory::of(&bytes).sections[0];
    bytes.insert(first.bytes.end, 1);
    let length = first.bytes.len() as u64 + 1;
    bytes[first.entry..first.entry + 8].copy_from_slice(&length.to_le_bytes());
    let fault = fault_of(&sealed(bytes));
    let what = "the end of a section";
    assert_eq!(fault, FileError::Corrupt { what });
}

#[test]
fn rejects_any_flipped_bit() {
    let bytes = strip_file().to_bytes();
    for offset in 0..bytes.len() {
        let mut flipped = bytes.clone();
        flipped[offset] ^= 1 << (offset % 8);
        let fault = fault_of(&flipped);
        let is_header = offset < HEADER_BYTES;
        assert!(
            is_header || fault == FileError::Checksum,
            "{offset}: {fault}"
        );
    }
}

/// The bytes of a file, an offset, and new bytes that must give the fault.
macro_rules! rejects {
    ($($name:literal: $file:ident, $offset:expr, $new:expr => $fault:pat,)+) => {
        $(let fault = fault_with($file.clone(), $offset, &$new);
        assert!(matches!(fault, $fault), "{}: {fault}", $name);)+
    };
}

#[test]
fn rejects_broken_directories_with_matching_checksums() {
    use FileError::{Corrupt, Name, Truncated};
    let exact = strip_file().to_bytes();
    let quantized = strip_file().to_bytes_with(Precision::Quantized16);
    let sections = Directory::of(&exact).sections;
    // `entry` starts with the length of the second section. The first section starts with the number of its groups.
    let (entry, start) = (sections[1].entry, sections[0].bytes.start);
    rejects! {
        "name that is not text": exact, HEADER_BYTES + 12, [0xff] => Name { primitive: 0 },
        "name longer than the file":
            exact, HEADER_BYTES + 8, [0xff; 4] => Truncated { what: "a name", .. },
        "unknown attribute": exact, ATTRIBUTES, [0xff] => Corrupt { what: "the directory" },
        "unknown precision": exact, ATTRIBUTES + 1, [0xff] => Corrupt { what: "the directory" },
        "unknown flag": exact, ATTRIBUTES + 2, [0xff] => Corrupt { what: "the directory" },
        "grid that is not finite": quantized, GRIDS, f64::NAN.to_le_bytes() => Corrupt { what: "the directory" },
        "NaN error": quantized, POSITION_ERROR, f32::NAN.to_le_bytes() => Corrupt { what: "the directory" },
        "infinite error": quantized, POSITION_ERROR, f32::INFINITY.to_le_bytes() => Corrupt { what: "the directory" },
        "negative error": quantized, POSITION_ERROR, (-1.0f32).to_le_bytes() => Corrupt { what: "the directory" },
        "more groups": exact, ATTRIBUTES + 3, [3] => Corrupt { what: "the groups" },
        "more vertices": exact, ATTRIBUTES + 7, [7] => Corrupt { what: "the vertex order" },
        "more primitives": exact, 12, [0xff; 4] => Truncated { .. },
        "section longer than the file": exact, entry, (1u64 << 20).to_le_bytes() => Truncated { .. },
        "endless section": exact, entry, u64::MAX.to_le_bytes() => Truncated { .. },
        // A small file with large counts must not allocate much memory.
        "1024 groups": exact, start, (1u32 << 10).to_le_bytes() => Corrupt { what: "the number of elements" },
        "a million groups": exact, start, (1u32 << 20).to_le_bytes() => Corrupt { what: "the number of elements" },
        "all groups": exact, start, u32::MAX.to_le_bytes() => Corrupt { what: "the number of elements" },
    }
}

#[test]
fn rejects_truncated_sections() {
    let bytes = strip_file().to_bytes();
    let directory = Directory::of(&bytes);
    let first = directory.sections[0].clone();
    for kept in 0..first.bytes.len() {
        let mut bytes = bytes.clone();
        bytes.drain(first.bytes.start + kept..first.bytes.end);
        bytes[first.entry..first.entry + 8].copy_from_slice(&(kept as u64).to_le_bytes());
        let fault = fault_of(&sealed(bytes));
        let is_expected = matches!(
            fault,
            FileError::Truncated { .. } | FileError::Corrupt { .. }
        );
        assert!(is_expected, "{kept}: {fault}");
    }
}

#[test]
fn rejects_invalid_hierarchies() {
    let bytes = strip_file().to_bytes();
    // The mean normal gets a length of 2.
    let section = Directory::of(&bytes).sections[0].bytes.clone();
    let one = [&[0][..], &1.0f32.to_le_bytes()].concat();
    let windows = bytes[section.clone()].windows(5);
    let offset = section.start + windows.into_iter().position(|w| w == one).unwrap() + 1;
    let fault = fault_with(bytes, offset, &2.0f32.to_le_bytes());
    assert!(
        matches!(fault, FileError::Invalid { primitive: 0, .. }),
        "{fault}"
    );
}

#[test]
#[should_panic(expected = "only valid hierarchies")]
fn writing_an_invalid_hierarchy_panics() {
    let mut file = strip_file();
    file.primitives[1].hierarchy.units[0].consumed_by = 7;
    let _ = file.to_bytes();
}

/// A changed byte: its position as a share of the file, and its new value.
fn change() -> impl Strategy<Value = (u16, u8)> {
    (any::<u16>(), prop_oneof![any::<u8>(), 0u8..10])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// Malformed files with matching checksums do not panic. Accepted files can be written again.
    #[test]
    fn changed_files_do_not_panic(changes in prop::collection::vec(change(), 1..6), kind in 0..4) {
        let hills = fixtures::grid_pyramid(1);
        let mut bytes = match kind {
            0 => strip_file().to_bytes(),
            1 => bytes_of(&hills, Precision::Lossless),
            2 => bytes_of(&hills, Precision::Quantized16),
            _ => bytes_of(&hills.whole_mesh_levels().unwrap(), Precision::Lossless),
        };
        for (offset, value) in changes {
            let length = bytes.len() - HEADER_BYTES;
            bytes[HEADER_BYTES + usize::from(offset) * length / 0x10000] = value;
        }
        let bytes = sealed(bytes);
        if let Ok(file) = BakedFile::from_bytes(&bytes) {
            let again = BakedFile::from_bytes(&file.to_bytes()).unwrap();
            for (again, first) in again.primitives.iter().zip(&file.primitives) {
                prop_assert_eq!(&again.hierarchy.groups, &first.hierarchy.groups);
                let _ = first.hierarchy.whole_mesh_levels();
            }
        }
    }
}

#[test]
fn rejects_broken_graphs() {
    let mut bytes = strip_file().to_bytes();
    let section = Directory::of(&bytes).sections[0].bytes.clone();
    // The error of the terminal group.
    let infinite = f32::INFINITY.to_le_bytes();
    let windows = bytes[section.clone()].windows(4);
    let place = section.start + windows.into_iter().position(|w| w == infinite).unwrap();
    bytes[place..place + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let fault = BakedFile::from_bytes(&sealed(bytes)).unwrap_err();
    assert!(matches!(fault, FileError::Invalid { .. }), "{fault}");
}
