//! Encodes a section: groups, their units, and the vertices that no earlier section has.
//!
//! ```text
//! group count u32
//! group indices, groups, finer groups, units               (see `numbers`, `records`)
//! vertex lists: per entry 0 for the next new vertex, or 1 plus the difference to the last entry that was not 0
//! triangles                                                (see `triangles`)
//! indices of the new vertices in the hierarchy; none in a page
//! attributes of the new vertices                           (see `planes`)
//! in the last section: the source vertices of moved vertices
//! zeros, until the section has 1 byte per MAX_PER_BYTE bytes of decoded memory
//! ```
//! Starts of ranges and consumers of units follow from other fields and are not stored.

use crate::file::sections::coded::{Coded, Ends, GROUP_BYTES, MAX_PER_BYTE, TRIANGLE_BYTES};
use crate::file::sections::numbers::{self, zigzag};
use crate::file::sections::records;
use crate::file::sections::references::References;
use crate::file::sections::triangles;
use crate::file::vertices::planes::{self, Plane};
use crate::hierarchy::Unit;

/// Encodes the part of `coded` that was added after `from`.
pub(crate) fn write(coded: &Coded, from: Ends, planes: &[Plane]) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_graph(&mut bytes, coded, from);
    write_references(&mut bytes, coded, from);
    write_triangles(&mut bytes, coded, from);
    if !coded.is_page {
        let indices = &coded.vertex_indices[from.vertices..];
        numbers::write(&mut bytes, indices);
    }
    planes::write(&mut bytes, &coded.columns, from.vertices, planes);
    numbers::write(&mut bytes, &coded.moved_from[from.moved_from..]);
    // Readers reject sections that claim more memory than their length allows.
    let least = claimed_bytes(coded, from).div_ceil(MAX_PER_BYTE as usize);
    bytes.resize(bytes.len().max(least), 0);
    bytes
}

/// Writes groups, units and their links.
pub(crate) fn write_graph(bytes: &mut Vec<u8>, coded: &Coded, from: Ends) {
    let groups = &coded.groups[from.groups..];
    bytes.extend_from_slice(&(groups.len() as u32).to_le_bytes());
    write_indices(bytes, &coded.group_indices[from.groups..]);
    records::write(bytes, groups);
    write_finer(bytes, coded, from);
    records::write(bytes, &coded.units[from.units..]);
}

/// Memory that a reader claims for the graph.
pub(crate) fn claimed_by_graph(coded: &Coded, from: Ends) -> usize {
    let to = coded.ends();
    (to.groups - from.groups) * GROUP_BYTES
        + (to.finer - from.finer) * 4
        + (to.units - from.units) * size_of::<Unit>()
}

/// Memory that a reader claims for the section.
fn claimed_bytes(coded: &Coded, from: Ends) -> usize {
    let to = coded.ends();
    claimed_by_graph(coded, from)
        + (to.unit_vertices - from.unit_vertices) * 4
        + (to.indices - from.indices) / 3 * TRIANGLE_BYTES
        + (to.vertices - from.vertices) * (coded.columns.columns.len() + 1) * 4
        + (to.moved_from - from.moved_from) * 4
}

/// Writes indices that are mostly consecutive.
fn write_indices(bytes: &mut Vec<u8>, indices: &[u32]) {
    let mut before = u32::MAX;
    let differences = indices.iter().map(|&index| {
        let difference = index.wrapping_sub(before).wrapping_sub(1);
        before = index;
        zigzag(difference)
    });
    numbers::write(bytes, &differences.collect::<Vec<_>>());
}

/// Writes links to finer groups as distances to their group.
fn write_finer(bytes: &mut Vec<u8>, coded: &Coded, from: Ends) {
    let mut finer = coded.finer[from.finer..].iter();
    let mut differences = Vec::new();
    for (group, index) in coded.groups_since(from.groups) {
        let links = finer.by_ref().take(group.finer_count as usize);
        differences.extend(links.map(|&finer| index.wrapping_sub(finer)));
    }
    numbers::write(bytes, &differences);
}

fn write_references(bytes: &mut Vec<u8>, coded: &Coded, from: Ends) {
    let mut references = References::new(from.vertices);
    let vertices = coded.unit_vertices[from.unit_vertices..].iter();
    let numbers: Vec<u32> = vertices.map(|&vertex| references.number(vertex)).collect();
    numbers::write(bytes, &numbers);
}

fn write_triangles(bytes: &mut Vec<u8>, coded: &Coded, from: Ends) {
    let mut numbers = triangles::Numbers::default();
    let mut indices = &coded.indices[from.indices..];
    for unit in &coded.units[from.units..] {
        let of_unit;
        (of_unit, indices) = indices.split_at(unit.triangle_count as usize * 3);
        triangles::write_unit(&mut numbers, of_unit);
    }
    for numbers in &numbers {
        numbers::write(bytes, numbers);
    }
}
