//! Binary glTF: a header of twelve bytes, and chunks `length u32 | type u32 | bytes` for JSON and data.

/// JSON and data of a file; `None` if it is not binary glTF.
pub(crate) fn parts(glb: &[u8]) -> Option<(&[u8], &[u8])> {
    let rest = glb.strip_prefix(b"glTF")?.get(8..)?;
    let (kind, json, rest) = chunk(rest)?;
    let data = match chunk(rest) {
        Some((kind, data, _)) if kind == *b"BIN\0" => data,
        _ => &[],
    };
    (kind == *b"JSON").then_some((json, data))
}

fn chunk(bytes: &[u8]) -> Option<([u8; 4], &[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (kind, rest) = rest.split_first_chunk::<4>()?;
    let (bytes, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    Some((*kind, bytes, rest))
}

/// A file of JSON and data.
pub(crate) fn whole(json: &[u8], data: &[u8]) -> Vec<u8> {
    let mut chunks = Vec::new();
    for (kind, bytes, padding) in [(b"JSON", json, b' '), (b"BIN\0", data, 0)] {
        let padded = bytes.len().next_multiple_of(4);
        chunks.extend((padded as u32).to_le_bytes());
        chunks.extend(kind);
        chunks.extend(bytes);
        chunks.resize(chunks.len() + padded - bytes.len(), padding);
    }
    let length = 12 + chunks.len() as u32;
    [
        &b"glTF"[..],
        &2u32.to_le_bytes(),
        &length.to_le_bytes(),
        &chunks,
    ]
    .concat()
}
