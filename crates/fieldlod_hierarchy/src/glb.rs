//! Binary glTF: a header of twelve bytes, and chunks `length u32 | type u32 | bytes`, padded to four bytes (glTF 2.0,
//! §4.4).

/// The bytes that a file begins with.
pub const MAGIC: &[u8; 4] = b"glTF";
/// Length of the header: magic, version and length of the file.
pub const HEADER_BYTES: usize = 12;
/// Type of the chunk of JSON.
pub const JSON: [u8; 4] = *b"JSON";
/// Type of the chunk of buffers.
pub const BIN: [u8; 4] = *b"BIN\0";
const CHUNK_HEADER_BYTES: usize = 8;

/// Type and bytes of a chunk.
pub type Chunk<'a> = ([u8; 4], &'a [u8]);

/// Iterates over the chunks in the bytes after the header. It ends at a truncated chunk, whose bytes are the rest.
#[derive(Clone, Debug)]
pub struct Chunks<'a>(pub &'a [u8]);

impl<'a> Iterator for Chunks<'a> {
    type Item = Chunk<'a>;

    fn next(&mut self) -> Option<Self::Item> {
        let (length, rest) = self.0.split_first_chunk::<4>()?;
        let (kind, rest) = rest.split_first_chunk::<4>()?;
        let length = u32::from_le_bytes(*length) as usize;
        let bytes = rest.get(..length)?;
        self.0 = &rest[length..];
        Some((*kind, bytes))
    }
}

/// A file of version 2 with these chunks.
///
/// # Errors
/// The length of the file, if its header has too few bits for it.
pub fn file_of(chunks: &[Chunk<'_>]) -> Result<Vec<u8>, u64> {
    let length = length_of(chunks.iter().map(|(_, bytes)| bytes.len() as u64))?;
    let mut glb = Vec::with_capacity(length as usize);
    glb.extend(MAGIC);
    glb.extend(2u32.to_le_bytes());
    glb.extend(length.to_le_bytes());
    for (kind, bytes) in chunks {
        let padded = bytes.len().next_multiple_of(4);
        glb.extend((padded as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(*bytes);
        let padding = if *kind == JSON { b' ' } else { 0 };
        glb.resize(glb.len() + padded - bytes.len(), padding);
    }
    Ok(glb)
}

fn length_of(chunks: impl Iterator<Item = u64>) -> Result<u32, u64> {
    let padded = chunks.map(|length| CHUNK_HEADER_BYTES as u64 + length.next_multiple_of(4));
    let bytes = HEADER_BYTES as u64 + padded.sum::<u64>();
    u32::try_from(bytes).map_err(|_| bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn length_above_32_bits_is_an_error() {
        let most = u64::from(u32::MAX) - 12 - 8 - 8 - 100 - 3;
        assert_eq!(length_of([97, most].into_iter()), Ok(u32::MAX - 3));
        assert_eq!(length_of([97, most + 1].into_iter()), Err(1 << 32));
    }
}
