//! Encodes a section: groups, their units, and the vertices that no earlier section has.
//!
//! ```text
//! group count u32
//! group indices, groups, finer groups, units               (see `numbers`, `records`)
//! vertex lists: per entry 0 for the next new vertex, or 1 plus the difference to the last entry that was not 0
//! triangles                                                (see `triangles`)
//! indices of the new vertices in the hierarchy             (see `vertex_order`)
//! stored attributes of the new vertices                    (see `planes`)
//! in the last section: the source vertices of moved vertices
//! zeros, until the section has 1 byte per MAX_PER_BYTE bytes of decoded memory
//! ```
//! Starts of ranges and consumers of units follow from other fields and are not stored.

use crate::file::sections::coded::{Coded, Ends, GROUP_BYTES, MAX_PER_BYTE, TRIANGLE_BYTES};
use crate::file::sections::numbers::{self, Kind, zigzag};
use crate::file::sections::records;
use crate::file::sections::references::References;
use crate::file::sections::triangles::Symbols;
use crate::file::vertices::attributes::predicted_normals;
use crate::file::vertices::planes::{self, Targets};
use crate::file::vertices::predict::Predict;
use crate::file::vertices::predictor::Predictor;
use crate::file::vertices::quantize::Grids;
use crate::file::vertices::rows::{Prediction, Rows};
use crate::file::vertices::vertex_order;
use crate::hierarchy::Unit;

/// Encodes the part of `coded` that was added after `from`. No unit uses its last `unused_vertices`
/// vertices.
pub(crate) fn write(
    coded: &mut Coded,
    from: Ends,
    predictors: &[Predict],
    grids: Option<&Grids>,
    unused_vertices: usize,
) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_graph(&mut bytes, coded, from);
    write_references(&mut bytes, coded, from);
    // Attributes follow the triangles, because triangles predict attributes.
    let (symbols, predictions) = triangle_symbols(coded, from, unused_vertices);
    write_symbols(&mut bytes, &symbols);
    if !coded.is_page {
        vertex_order::write(
            &mut bytes,
            &coded.vertex_indices,
            &predictions,
            coded.source_vertex_count,
        );
    }
    let rows = std::mem::take(&mut coded.rows);
    let normals = |rows: &Rows| predicted_normals(coded, from, rows, grids, &predictions);
    let targets = Targets {
        predictors,
        predictions: &predictions,
        normals: &normals,
    };
    planes::write(&mut bytes, &rows, &targets);
    coded.rows = rows;
    numbers::write(
        &mut bytes,
        &coded.moved_from[from.moved_from..],
        Kind::Plain,
    );
    // Readers reject sections that claim more memory than their length allows.
    let least = claimed_bytes(coded, from, &symbols).div_ceil(MAX_PER_BYTE as usize);
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
fn claimed_bytes(coded: &Coded, from: Ends, symbols: &Symbols) -> usize {
    let to = coded.ends();
    claimed_by_graph(coded, from)
        + (to.unit_vertices - from.unit_vertices) * 4
        + (to.indices - from.indices) / 3 * TRIANGLE_BYTES
        + (symbols.vertices.len() + symbols.distances.len()) * 4
        + (to.vertices - from.vertices) * (coded.rows.width + 1) * 4
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
    numbers::write(bytes, &differences.collect::<Vec<_>>(), Kind::Residuals);
}

/// Writes links to finer groups as distances to their group.
fn write_finer(bytes: &mut Vec<u8>, coded: &Coded, from: Ends) {
    let mut finer = coded.finer[from.finer..].iter();
    let mut differences = Vec::new();
    for (group, index) in coded.groups_since(from.groups) {
        let links = finer.by_ref().take(group.finer_count as usize);
        differences.extend(links.map(|&finer| index.wrapping_sub(finer)));
    }
    numbers::write(bytes, &differences, Kind::Plain);
}

fn write_references(bytes: &mut Vec<u8>, coded: &Coded, from: Ends) {
    let mut references = References::new(from.vertices);
    let vertices = coded.unit_vertices[from.unit_vertices..].iter();
    let numbers: Vec<u32> = vertices.map(|&vertex| references.number(vertex)).collect();
    numbers::write(bytes, &numbers, Kind::Residuals);
}

/// Returns the symbols of the triangles and the predictions of the new vertices.
fn triangle_symbols(
    coded: &Coded,
    from: Ends,
    unused_vertices: usize,
) -> (Symbols, Vec<Prediction>) {
    let mut symbols = Symbols::default();
    let added = coded.vertex_indices.len() - from.vertices;
    let mut predictor = Predictor::new(from.vertices, added);
    let (mut vertex, mut index) = (from.unit_vertices, from.indices);
    for unit in &coded.units[from.units..] {
        let vertices = &coded.unit_vertices[vertex..][..unit.vertex_count as usize];
        let indices = &coded.indices[index..][..unit.triangle_count as usize * 3];
        symbols.write_unit(indices, unit.vertex_count, |step| {
            predictor.add_triangle(step, vertices);
        });
        predictor.finish_unit(vertices);
        vertex += vertices.len();
        index += indices.len();
    }
    (symbols, predictor.finish(unused_vertices))
}

fn write_symbols(bytes: &mut Vec<u8>, symbols: &Symbols) {
    // The number of edges equals the number of triangles, so it is not stored.
    numbers::write(bytes, &symbols.edges, Kind::Residuals);
    for numbers in [&symbols.vertices, &symbols.distances] {
        bytes.extend_from_slice(&(numbers.len() as u32).to_le_bytes());
        numbers::write(bytes, numbers, Kind::Residuals);
    }
}
