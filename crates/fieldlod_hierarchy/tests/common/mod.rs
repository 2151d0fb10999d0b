//! Small files, and a plain reading of where things are in them.

#![allow(dead_code, reason = "each suite uses its part")]

use std::ops::Range;

use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy, fixtures};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

pub(crate) const HEADER_BYTES: usize = 32;

/// Two primitives, of which the second has cards.
pub(crate) fn strip_file() -> BakedFile {
    let strip = fixtures::two_level_strip();
    let hierarchies = [strip.clone(), with_cards(strip, 8)];
    let primitives = (0..).zip(hierarchies);
    let primitives = primitives.map(|(index, h)| BakedPrimitive::new(3, index, "strip", h));
    BakedFile {
        primitives: primitives.collect(),
    }
}

pub(crate) fn with_cards(hierarchy: Hierarchy, side_texels: u32) -> Hierarchy {
    Hierarchy {
        cards: Some(fixtures::leafy_cards(side_texels)),
        ..hierarchy
    }
}

/// Whole levels of hills, and below them two of cards.
pub(crate) fn whole_hills_with_cards(levels: u32) -> Hierarchy {
    let hills = with_cards(fixtures::grid_pyramid(levels), 16);
    let whole = hills.whole_mesh_levels();
    whole.expect("a level of them has few vertices")
}

/// Where a section, or what there is of cards, and its entry in the directory are.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub(crate) entry: usize,
    pub(crate) bytes: Range<usize>,
}

/// As far as the bytes make sense.
#[derive(Debug)]
pub(crate) struct Directory {
    pub(crate) end: usize,
    /// By primitive, of no bytes where there are none.
    pub(crate) cards: Vec<Place>,
    /// In the order of the file.
    pub(crate) sections: Vec<Place>,
}

fn number(bytes: &[u8], place: usize, width: usize) -> Option<usize> {
    let bytes = bytes.get(place..place.checked_add(width)?)?;
    let number = bytes.iter().rev().fold(0u64, |n, &b| n << 8 | u64::from(b));
    usize::try_from(number).ok()
}

impl Directory {
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let length = number(bytes, 16, 8).unwrap_or(0);
        let end = length.saturating_add(HEADER_BYTES).min(bytes.len());
        let mut entries: Vec<Vec<usize>> = Vec::new();
        let mut place = HEADER_BYTES;
        while place < end {
            let Some(entry) = entries_at(bytes, &mut place, end) else {
                break;
            };
            entries.push(entry);
        }
        let mut parts = Vec::new();
        let mut start = end;
        for round in 0..entries.iter().map(Vec::len).max().unwrap_or(0) {
            for &entry in entries.iter().filter_map(|entry| entry.get(round)) {
                let length = number(bytes, entry, 8).unwrap_or(0);
                let end = start.saturating_add(length).min(bytes.len());
                let bytes = start..end;
                parts.push(Place { entry, bytes });
                start = end;
            }
        }
        let sections = parts.split_off(entries.len());
        let cards = parts;
        Self {
            end,
            cards,
            sections,
        }
    }
}

/// The places of a primitive's entries: of its cards and its sections.
fn entries_at(bytes: &[u8], place: &mut usize, end: usize) -> Option<Vec<usize>> {
    let name = number(bytes, *place + 8, 4)?;
    let precision = (*place + 12).checked_add(name)?.checked_add(9)?;
    let grids = if number(bytes, precision, 1)? == 1 {
        11 * 16 + 4
    } else {
        0
    };
    let counts = precision + 2 + grids;
    let cards = counts + 20;
    let count = number(bytes, cards + 16, 4)?;
    let first = cards + 20;
    *place = first.checked_add(count.checked_mul(16)?)?;
    let sections = (0..count).map(|k| first + k * 16);
    (*place <= end).then(|| std::iter::once(cards).chain(sections).collect())
}

/// Makes all checksums fit bytes that a test has changed.
pub(crate) fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let directory = Directory::of(&bytes);
    for part in directory.cards.iter().chain(&directory.sections) {
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
