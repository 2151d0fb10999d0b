//! A `.fieldlod` file inside a `.glb` file.
//!
//! Binary glTF is a header of twelve bytes and a sequence of chunks, `length u32 | type u32 | bytes`. Readers ignore
//! chunks of unknown types after the JSON and the BIN chunk (glTF 2.0, §4.4.3). Chunks are padded to four bytes, so our
//! chunk begins with the exact length of the `.fieldlod` file.

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
#[cfg(feature = "bake")]
const BIN: [u8; 4] = *b"BIN\0";
const FIELDLOD: [u8; 4] = *b"FLOD";

/// The bytes of the `.fieldlod` file in `glb`, if it has one.
pub(crate) fn find_chunk(glb: &[u8]) -> Option<&[u8]> {
    let mut chunks = Chunks(glb.get(HEADER..)?);
    let bytes = chunks.find_map(|(kind, bytes)| (kind == FIELDLOD).then_some(bytes))?;
    let (length, file) = bytes.split_first_chunk::<4>()?;
    file.get(..u32::from_le_bytes(*length) as usize)
}

/// Adds `file` to `glb`; `None` if `glb` is not binary glTF or the result is longer than 4 GiB.
#[cfg(feature = "bake")]
pub(crate) fn with_chunk(glb: &[u8], file: &[u8]) -> Option<Vec<u8>> {
    if !glb.starts_with(b"glTF") {
        return None;
    }
    let mut chunks = Chunks(glb.get(HEADER..)?);
    let mut with = glb[..HEADER].to_vec();
    let (kind, json) = chunks.next()?;
    push(&mut with, kind, json, b' ');
    match chunks.next() {
        Some((BIN, bytes)) => push(&mut with, BIN, bytes, 0),
        // glTF readers require the BIN chunk before chunks of other types.
        _ => push(&mut with, BIN, &[], 0),
    }
    let length = u32::try_from(file.len()).ok()?;
    push(
        &mut with,
        FIELDLOD,
        &[&length.to_le_bytes(), file].concat(),
        0,
    );
    let length = u32::try_from(with.len()).ok()?;
    with[8..HEADER].copy_from_slice(&length.to_le_bytes());
    Some(with)
}

#[cfg(feature = "bake")]
fn push(glb: &mut Vec<u8>, kind: [u8; 4], bytes: &[u8], padding: u8) {
    let padded = bytes.len().next_multiple_of(4);
    glb.extend((padded as u32).to_le_bytes());
    glb.extend(kind);
    glb.extend(bytes);
    glb.extend(std::iter::repeat_n(padding, padded - bytes.len()));
}

/// Iterates over chunks, and ends at a truncated chunk.
struct Chunks<'a>(&'a [u8]);

impl<'a> Iterator for Chunks<'a> {
    type Item = ([u8; 4], &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (length, rest) = self.0.split_first_chunk::<4>()?;
        let (kind, rest) = rest.split_first_chunk::<4>()?;
        let length = u32::from_le_bytes(*length) as usize;
        let bytes = rest.get(..length)?;
        self.0 = &self.0[CHUNK_HEADER + length..];
        Some((*kind, bytes))
    }
}

#[cfg(all(test, feature = "bake"))]
mod tests {
    use super::*;

    fn glb(chunks: &[([u8; 4], &[u8])]) -> Vec<u8> {
        let mut glb = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, bytes) in chunks {
            push(&mut glb, *kind, bytes, b' ');
        }
        let length = glb.len() as u32;
        glb[8..12].copy_from_slice(&length.to_le_bytes());
        glb
    }

    #[test]
    fn added_chunk_is_found() {
        let plain = glb(&[(*b"JSON", b"{}"), (BIN, &[1, 2, 3, 4])]);
        assert_eq!(find_chunk(&plain), None);
        let with = with_chunk(&plain, b"levels..").unwrap();
        assert_eq!(find_chunk(&with), Some(&b"levels.."[..]));
        assert_eq!(with[8..12], (with.len() as u32).to_le_bytes());
        assert_eq!(with[HEADER..plain.len()], plain[HEADER..]);
        // Adding again replaces the chunk.
        let again = with_chunk(&with, b"other").unwrap();
        assert_eq!(find_chunk(&again), Some(&b"other"[..]));
    }

    #[test]
    fn missing_bin_chunk_is_added() {
        let with = with_chunk(&glb(&[(*b"JSON", b"{}")]), b"file").unwrap();
        let kinds: Vec<[u8; 4]> = Chunks(&with[HEADER..]).map(|(kind, _)| kind).collect();
        assert_eq!(kinds, [*b"JSON", BIN, FIELDLOD]);
    }

    #[test]
    fn truncated_and_other_files_are_rejected() {
        let with = with_chunk(&glb(&[(*b"JSON", b"{}")]), b"file").unwrap();
        for end in 0..with.len() {
            assert_eq!(find_chunk(&with[..end]), None, "{end}");
        }
        assert_eq!(with_chunk(b"GLTF and so on and on", b""), None);
    }
}
