//! Small files, and an independent parser of their layout.

#![allow(dead_code, reason = "the fuzz target uses a part")]

use std::ops::Range;

use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy, Precision, fixtures};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

pub(crate) const HEADER_BYTES: usize = 32;

/// A file with two strips.
pub(crate) fn strip_file() -> BakedFile {
    let strip = fixtures::two_level_strip();
    let primitive = |index| BakedPrimitive::new(3, index, "strip", strip.clone());
    BakedFile {
        primitives: (0..2).map(primitive).collect(),
    }
}

/// A file with one hierarchy.
pub(crate) fn file_of(hierarchy: Hierarchy) -> BakedFile {
    BakedFile {
        primitives: vec![BakedPrimitive::new(0, 0, "", hierarchy)],
    }
}

/// The bytes of a file with one hierarchy.
pub(crate) fn bytes_of(hierarchy: &Hierarchy, precision: Precision) -> Vec<u8> {
    file_of(hierarchy.clone()).to_bytes_with(precision)
}

/// Byte ranges of a section and of its directory entry.
#[derive(Clone, Debug)]
pub(crate) struct Located {
    pub(crate) entry: usize,
    pub(crate) bytes: Range<usize>,
}

/// The parsed directory of a file. Parsing stops at malformed bytes.
#[derive(Debug)]
pub(crate) struct Directory {
    pub(crate) end: usize,
    /// Sections in file order.
    pub(crate) sections: Vec<Located>,
}

fn number(bytes: &[u8], offset: usize, width: usize) -> Option<usize> {
    let bytes = bytes.get(offset..offset.checked_add(width)?)?;
    let number = bytes.iter().rev().fold(0u64, |n, &b| n << 8 | u64::from(b));
    usize::try_from(number).ok()
}

impl Directory {
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let length = number(bytes, 16, 8).unwrap_or(0);
        let end = length.saturating_add(HEADER_BYTES).min(bytes.len());
        let mut entries: Vec<Vec<usize>> = Vec::new();
        let mut offset = HEADER_BYTES;
        while offset < end {
            let Some(entry) = entries_at(bytes, &mut offset, end) else {
                break;
            };
            entries.push(entry);
        }
        let mut sections = Vec::new();
        let mut start = end;
        for round in 0..entries.iter().map(Vec::len).max().unwrap_or(0) {
            for &entry in entries.iter().filter_map(|entry| entry.get(round)) {
                let length = number(bytes, entry, 8).unwrap_or(0);
                let end = start.saturating_add(length).min(bytes.len());
                let bytes = start..end;
                sections.push(Located { entry, bytes });
                start = end;
            }
        }
        Self { end, sections }
    }
}

/// Byte offsets of the section entries of a primitive.
fn entries_at(bytes: &[u8], offset: &mut usize, end: usize) -> Option<Vec<usize>> {
    let name = number(bytes, *offset + 8, 4)?;
    let precision = (*offset + 12).checked_add(name)?.checked_add(9)?;
    let grids = if number(bytes, precision, 1)? == 1 {
        11 * 16 + 4
    } else {
        0
    };
    let counts = precision + 2 + grids;
    let count = number(bytes, counts + 20, 4)?;
    let first = counts + 24;
    *offset = first.checked_add(count.checked_mul(16)?)?;
    (*offset <= end).then(|| (0..count).map(|k| first + k * 16).collect())
}

/// Updates all checksums after a test has changed bytes.
pub(crate) fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let directory = Directory::of(&bytes);
    for part in &directory.sections {
        let checksum = xxh3_64(&bytes[part.bytes.clone()]);
        bytes[part.entry + 8..part.entry + 16].copy_from_slice(&checksum.to_le_bytes());
    }
    let count = number(&bytes, 12, 4).unwrap_or(0) as u64;
    if let Some(body) = bytes.get(HEADER_BYTES..directory.end) {
        let checksum = xxh3_64_with_seed(body, count);
        bytes[24..32].copy_from_slice(&checksum.to_le_bytes());
    }
    bytes
}
