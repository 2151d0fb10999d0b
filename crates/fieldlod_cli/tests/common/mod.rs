//! Small glTF files.

#![allow(dead_code, reason = "each test file uses a part")]

use serde_json::Value;

/// Positions and indices of a flat grid with `2 · cells²` triangles.
pub(crate) fn grid(cells: u32) -> [Vec<u8>; 2] {
    let side = cells + 1;
    let corners = (0..side * side).map(|i| [(i / side) as f32, 0.0, (i % side) as f32]);
    let quads = (0..cells * cells).map(|q| q / cells * side + q % cells);
    let triangles = quads.flat_map(|a| [a, a + 1, a + side, a + side, a + 1, a + side + 1]);
    [
        corners.flatten().flat_map(f32::to_le_bytes).collect(),
        triangles.flat_map(u32::to_le_bytes).collect(),
    ]
}

/// Encodes a binary glTF file.
pub(crate) fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = (12 + 8 + json.len() + 8 + binary.len()) as u32;
    let numbers = |numbers: [u32; 2]| numbers.map(u32::to_le_bytes).concat();
    [
        b"glTF",
        &numbers([2, length])[..],
        &(json.len() as u32).to_le_bytes(),
        b"JSON",
        &json,
        &(binary.len() as u32).to_le_bytes(),
        b"BIN\0",
        binary,
    ]
    .concat()
}

/// JSON and data of a binary glTF file.
pub(crate) fn parts(glb: &[u8]) -> (Value, &[u8]) {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    (json, &glb[28 + length..])
}
