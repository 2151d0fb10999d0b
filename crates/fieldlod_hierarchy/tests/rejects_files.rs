//! One test for each way in which a `.fieldlod` file can be wrong.

use fieldlod_hierarchy::{
    BakedFile, BakedPrimitive, FORMAT_VERSION, FileError, InvalidHierarchy, fixtures,
};
use proptest::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

const HEADER_BYTES: usize = 32;

fn strip_file() -> BakedFile {
    let primitive = |index| BakedPrimitive::new(3, index, "strip", fixtures::two_level_strip());
    BakedFile {
        primitives: vec![primitive(0), primitive(1)],
    }
}

/// Makes the header fit a payload that a test has changed.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let payload_bytes = (bytes.len() - HEADER_BYTES) as u64;
    let checksum = xxh3_64(&bytes[HEADER_BYTES..]);
    bytes[16..24].copy_from_slice(&payload_bytes.to_le_bytes());
    bytes[24..32].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

fn fault_of(bytes: &[u8]) -> FileError {
    let fault = BakedFile::from_bytes(bytes).unwrap_err();
    let message = fault.to_string();
    assert!(
        !message.is_empty() && !message.contains('\n'),
        "{message:?}"
    );
    fault
}

#[test]
fn accepts_what_it_wrote() {
    for file in [strip_file(), BakedFile::default()] {
        assert_eq!(BakedFile::from_bytes(&file.to_bytes()), Ok(file));
    }
    assert!(strip_file().find(3, 1).is_some());
    assert!(strip_file().find(3, 2).is_none());
}

#[test]
fn rejects_another_kind_of_file() {
    for bytes in [&b""[..], b"glTF", b"FLDLOD\n\n"] {
        assert_eq!(fault_of(bytes), FileError::NotFieldlod);
    }
}

#[test]
fn rejects_another_version() {
    for found in [0, FORMAT_VERSION + 1] {
        let mut bytes = strip_file().to_bytes();
        bytes[8..12].copy_from_slice(&found.to_le_bytes());
        assert_eq!(fault_of(&bytes), FileError::Version { found });
    }
}

#[test]
fn rejects_a_file_cut_anywhere() {
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
    // The same, but announced: what remains after the last primitive.
    bytes.extend([0; 3]);
    assert_eq!(
        fault_of(&sealed(bytes)),
        FileError::TrailingBytes { extra: 4 }
    );
}

#[test]
fn rejects_any_flipped_bit_of_the_payload() {
    let bytes = strip_file().to_bytes();
    for place in HEADER_BYTES..bytes.len() {
        let mut flipped = bytes.clone();
        flipped[place] ^= 1 << (place % 8);
        assert_eq!(fault_of(&flipped), FileError::Checksum);
    }
}

#[test]
fn rejects_a_name_that_is_not_text() {
    let mut bytes = strip_file().to_bytes();
    let name = HEADER_BYTES + 4 + 4 + 8;
    assert_eq!(&bytes[name..name + 5], b"strip");
    bytes[name] = 0xff;
    assert_eq!(fault_of(&sealed(bytes)), FileError::Name { primitive: 0 });
}

#[test]
fn rejects_arrays_longer_than_the_file() {
    for count in [1 << 20, u64::MAX, u64::MAX / 12 + 2] {
        let mut bytes = strip_file().to_bytes();
        // The count of the first primitive's positions.
        let place = HEADER_BYTES + 4 + 4 + 8 + "strip".len() + 8;
        bytes[place..place + 8].copy_from_slice(&count.to_le_bytes());
        let fault = fault_of(&sealed(bytes));
        assert!(
            matches!(
                fault,
                FileError::Truncated {
                    what: "the positions",
                    ..
                }
            ),
            "{fault}"
        );
    }
}

#[test]
fn rejects_more_primitives_than_there_are() {
    let mut bytes = strip_file().to_bytes();
    bytes[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(matches!(fault_of(&bytes), FileError::Truncated { .. }));
}

#[test]
fn rejects_a_broken_hierarchy_with_a_right_checksum() {
    let mut file = strip_file();
    file.primitives[1].hierarchy.units[0].consumed_by = 7;
    let fault = fault_of(&file.to_bytes());
    let FileError::Invalid {
        primitive: 1,
        fault,
    } = fault
    else {
        panic!("{fault}");
    };
    assert!(
        matches!(fault, InvalidHierarchy::DanglingReference { target: 7, .. }),
        "{fault}"
    );
}

proptest! {
    /// Whatever was changed, with the checksum made to fit: an answer, and never a panic. What is
    /// accepted is valid and is written back byte for byte.
    #[test]
    fn survives_any_change(changes in prop::collection::vec((any::<u16>(), any::<u8>()), 1..6)) {
        let mut bytes = strip_file().to_bytes();
        for (place, value) in changes {
            let payload_bytes = bytes.len() - HEADER_BYTES;
            bytes[HEADER_BYTES + usize::from(place) % payload_bytes] = value;
        }
        let bytes = sealed(bytes);
        if let Ok(file) = BakedFile::from_bytes(&bytes) {
            prop_assert_eq!(file.to_bytes(), bytes);
        }
    }

    #[test]
    fn survives_any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut file = strip_file().to_bytes();
        file.truncate(HEADER_BYTES);
        file.extend(bytes);
        let _ = BakedFile::from_bytes(&sealed(file));
    }
}
