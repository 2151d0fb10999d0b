//! A `.fieldlod` file inside a `.glb` file.
//!
//! Readers ignore chunks of unknown types after the JSON and the BIN chunk (glTF 2.0, §4.4.3). Chunks are padded to four
//! bytes, so our chunk begins with the exact length of the `.fieldlod` file.

#[cfg(feature = "bake")]
use fieldlod_hierarchy::glb::{BIN, MAGIC, file_of};
use fieldlod_hierarchy::glb::{Chunks, HEADER_BYTES};

const FIELDLOD: [u8; 4] = *b"FLOD";

/// The bytes of the `.fieldlod` file in `glb`, if it has one.
pub(crate) fn find_chunk(glb: &[u8]) -> Option<&[u8]> {
    let mut chunks = Chunks(glb.get(HEADER_BYTES..)?);
    let bytes = chunks.find_map(|(kind, bytes)| (kind == FIELDLOD).then_some(bytes))?;
    let (length, file) = bytes.split_first_chunk::<4>()?;
    file.get(..u32::from_le_bytes(*length) as usize)
}

/// Adds `file` to `glb`; `None` if `glb` is not binary glTF or the result is longer than 4 GiB.
#[cfg(feature = "bake")]
pub(crate) fn with_chunk(glb: &[u8], file: &[u8]) -> Option<Vec<u8>> {
    let mut chunks = Chunks(glb.strip_prefix(MAGIC)?.get(HEADER_BYTES - MAGIC.len()..)?);
    let json = chunks.next()?;
    // glTF readers require the BIN chunk before chunks of other types.
    let bin = chunks.next().filter(|(kind, _)| *kind == BIN);
    let length = u32::try_from(file.len()).ok()?;
    let own = [&length.to_le_bytes(), file].concat();
    file_of(&[json, bin.unwrap_or((BIN, &[])), (FIELDLOD, &own)]).ok()
}

#[cfg(all(test, feature = "bake"))]
mod tests {
    use super::*;

    use fieldlod_hierarchy::glb::JSON;

    #[test]
    fn added_chunk_is_found() {
        let plain = file_of(&[(JSON, b"{}"), (BIN, &[1, 2, 3, 4])]).unwrap();
        assert_eq!(find_chunk(&plain), None);
        let with = with_chunk(&plain, b"levels..").unwrap();
        assert_eq!(find_chunk(&with), Some(&b"levels.."[..]));
        assert_eq!(with[8..12], (with.len() as u32).to_le_bytes());
        assert_eq!(with[HEADER_BYTES..plain.len()], plain[HEADER_BYTES..]);
        // Adding again replaces the chunk.
        let again = with_chunk(&with, b"other").unwrap();
        assert_eq!(find_chunk(&again), Some(&b"other"[..]));
    }

    #[test]
    fn missing_bin_chunk_is_added() {
        let with = with_chunk(&file_of(&[(JSON, b"{}")]).unwrap(), b"file").unwrap();
        let kinds: Vec<[u8; 4]> = Chunks(&with[HEADER_BYTES..])
            .map(|(kind, _)| kind)
            .collect();
        assert_eq!(kinds, [JSON, BIN, FIELDLOD]);
    }

    #[test]
    fn truncated_and_other_files_are_rejected() {
        let with = with_chunk(&file_of(&[(JSON, b"{}")]).unwrap(), b"file").unwrap();
        for end in 0..with.len() {
            assert_eq!(find_chunk(&with[..end]), None, "{end}");
        }
        assert_eq!(with_chunk(b"GLTF and so on and on", b""), None);
    }
}
