//! Writes one section: the groups that one more level adds, their units, and the vertices that no
//! coarser level uses.
//!
//! ```text
//! group count u32
//! group indices, groups, finer groups, units               (see `numbers`, `records`)
//! per entry of the units' vertex lists: 0 for the next new vertex, or 1 more than the difference
//!     to the vertex named before
//! triangles                                                (see `triangles`)
//! indices of the new vertices in the hierarchy             (see `vertex_order`)
//! attributes of the new vertices that are stored           (see `planes`)
//! in the last section: source vertices that moved ones came from
//! zeros, so that no byte stands for more than MAX_PER_BYTE bytes of memory
//! ```
//! What follows from other fields (where ranges start, who consumes a unit) is left out.

use crate::file::sections::coded::{Coded, Ends, GROUP_BYTES, MAX_PER_BYTE, TRIANGLE_BYTES};
use crate::file::sections::numbers::{self, Kind, zigzag};
use crate::file::sections::records;
use crate::file::sections::references::References;
use crate::file::sections::triangles::Symbols;
use crate::file::vertices::attributes::suggested_normals;
use crate::file::vertices::planes::{self, Targets};
use crate::file::vertices::predict::Predict;
use crate::file::vertices::predictor::Predictor;
use crate::file::vertices::quantize::Grids;
use crate::file::vertices::rows::{Prediction, Rows};
use crate::file::vertices::vertex_order;
use crate::hierarchy::Unit;

/// The bytes of what `coded` holds since `from`. The last `unused_vertices` of it are those that no
/// unit uses.
pub(in crate::file) fn write(
    coded: &mut Coded,
    from: Ends,
    predictors: &[Predict],
    grids: Option<&Grids>,
    unused_vertices: usize,
) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_graph(&mut bytes, coded, from);
    // Which vertices the units use, and which of them are new.
    write_references(&mut bytes, coded, from);
    // Triangles, which tell what new vertices are like, and how far they are not.
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
    let are_stored = coded.are_stored(&predictions);
    let mut rows = std::mem::take(&mut coded.rows);
    let normals = |rows: &Rows| suggested_normals(coded, from, rows, grids, &predictions);
    let targets = Targets {
        predictors,
        predictions: &predictions,
        are_stored: &are_stored,
        normals: &normals,
    };
    planes::write(&mut bytes, &mut rows, &targets);
    coded.rows = rows;
    numbers::write(
        &mut bytes,
        &coded.moved_from[from.moved_from..],
        Kind::Plain,
    );
    let least = claimed_bytes(coded, from, &symbols).div_ceil(MAX_PER_BYTE as usize);
    bytes.resize(bytes.len().max(least), 0);
    bytes
}

/// Writes groups, units and their links.
pub(in crate::file) fn write_graph(bytes: &mut Vec<u8>, coded: &Coded, from: Ends) {
    let groups = &coded.groups[from.groups..];
    bytes.extend_from_slice(&(groups.len() as u32).to_le_bytes());
    write_indices(bytes, &coded.group_indices[from.groups..]);
    records::write(bytes, groups);
    write_finer(bytes, coded, from);
    records::write(bytes, &coded.units[from.units..]);
}

/// The memory that a reader claims for the graph.
pub(in crate::file) fn claimed_by_graph(coded: &Coded, from: Ends) -> usize {
    let to = coded.ends();
    (to.groups - from.groups) * GROUP_BYTES
        + (to.finer - from.finer) * 4
        + (to.units - from.units) * size_of::<Unit>()
}

/// The memory that a reader claims for all that `coded` holds since `from`.
fn claimed_bytes(coded: &Coded, from: Ends, symbols: &Symbols) -> usize {
    let to = coded.ends();
    claimed_by_graph(coded, from)
        + (to.unit_vertices - from.unit_vertices) * 4
        + (to.indices - from.indices) / 3 * TRIANGLE_BYTES
        + (symbols.vertices.len() + symbols.distances.len()) * 4
        + (to.vertices - from.vertices) * (coded.rows.width + 1) * 4
        + (to.moved_from - from.moved_from) * 4
}

/// Writes indices that mostly count up.
pub(in crate::file) fn write_indices(bytes: &mut Vec<u8>, indices: &[u32]) {
    let mut before = u32::MAX;
    let differences = indices.iter().map(|&index| {
        let difference = index.wrapping_sub(before).wrapping_sub(1);
        before = index;
        zigzag(difference)
    });
    numbers::write(bytes, &differences.collect::<Vec<_>>(), Kind::Remainders);
}

/// Writes finer groups, by how far they lie before their group.
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
    numbers::write(bytes, &numbers, Kind::Remainders);
}

/// The triangles as symbols, and for each new vertex what it is predicted from.
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
            predictor.see(step, vertices);
        });
        predictor.finish_unit(vertices);
        vertex += vertices.len();
        index += indices.len();
    }
    (symbols, predictor.finish(unused_vertices))
}

fn write_symbols(bytes: &mut Vec<u8>, symbols: &Symbols) {
    // As many edges as triangles, which is known.
    numbers::write(bytes, &symbols.edges, Kind::Remainders);
    for numbers in [&symbols.vertices, &symbols.distances] {
        bytes.extend_from_slice(&(numbers.len() as u32).to_le_bytes());
        numbers::write(bytes, numbers, Kind::Remainders);
    }
}
