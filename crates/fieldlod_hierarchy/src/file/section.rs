//! One section: the groups that one more level adds, their units, and the vertices that no coarser
//! level uses.
//!
//! ```text
//! group count u32
//! group indices, groups, finer groups, units, clusters     (see `numbers`, `records`)
//! per entry of the units' vertex lists: 0 for the next new vertex, or 1 more than the difference
//!     to the vertex named before
//! source indices of the new vertices
//! triangles                                                (see `triangles`)
//! attributes of the new vertices                           (see `planes`)
//! zeros, so that no byte stands for more than MAX_PER_BYTE bytes of memory
//! ```
//! What follows from other fields (where ranges start, who consumes a unit) is left out.

use super::FileError;
use super::coded::Coded;
use super::numbers::{self, Kind, unzigzag, zigzag};
use super::planes::{self, Predict, Prediction};
use super::predictor::Predictor;
use super::reader::Reader;
use super::records;
use super::references::References;
use super::triangles::{SymbolReader, Symbols};
use crate::{Cluster, Group, NO_GROUP, Unit};

/// Bytes of memory that one of a section may stand for, so that a small file claims little.
const MAX_PER_BYTE: u64 = 64;

const GROUP_BYTES: usize = size_of::<Group>() + 4;
const UNIT_BYTES: usize = size_of::<Unit>();
/// Three indices and the symbol of an edge.
const TRIANGLE_BYTES: usize = 3 * 2 + 4;

/// What a section holds beyond the coarser ones.
#[derive(Debug)]
pub(super) struct Section<'a> {
    /// The predictors of the planes.
    pub(super) predictors: &'a [Predict],
    /// Vertices that no unit uses, to be added after the others.
    pub(super) unused_vertices: usize,
}

/// The arrays of a [`Coded`] before a section was added.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    groups: usize,
    finer: usize,
    units: usize,
    clusters: usize,
    unit_vertices: usize,
    indices: usize,
    vertices: usize,
}

impl Ends {
    pub(super) fn of(coded: &Coded) -> Self {
        Self {
            groups: coded.groups.len(),
            finer: coded.finer.len(),
            units: coded.units.len(),
            clusters: coded.clusters.len(),
            unit_vertices: coded.unit_vertices.len(),
            indices: coded.indices.len(),
            vertices: coded.source_vertices.len(),
        }
    }
}

impl Section<'_> {
    /// The bytes of what `coded` holds since `from`.
    pub(super) fn write(&self, coded: &Coded, from: Ends) -> Vec<u8> {
        let mut bytes = Vec::new();
        let groups = &coded.groups[from.groups..];
        let units = &coded.units[from.units..];
        bytes.extend_from_slice(&(groups.len() as u32).to_le_bytes());
        write_indices(&mut bytes, &coded.group_indices[from.groups..]);
        records::write(&mut bytes, groups);
        write_finer(&mut bytes, coded, from);
        records::write(&mut bytes, units);
        records::write(&mut bytes, &coded.clusters[from.clusters..]);
        write_references(&mut bytes, coded, from);
        write_indices(&mut bytes, &coded.source_vertices[from.vertices..]);
        let (predictions, symbols) = self.write_triangles(&mut bytes, coded, from);
        for (column, &predict) in self.predictors.iter().enumerate() {
            planes::write(&mut bytes, &coded.rows, column, predict, &predictions);
        }
        let memory = Ends::of(coded).bytes_since(from, coded.rows.width, &symbols);
        let least = memory.div_ceil(MAX_PER_BYTE as usize);
        bytes.resize(bytes.len().max(least), 0);
        bytes
    }

    fn write_triangles(
        &self,
        bytes: &mut Vec<u8>,
        coded: &Coded,
        from: Ends,
    ) -> (Vec<Prediction>, Symbols) {
        let mut symbols = Symbols::default();
        let added = coded.source_vertices.len() - from.vertices;
        let mut predictor = Predictor::new(from.vertices, added);
        let (mut vertex, mut index) = (from.unit_vertices, from.indices);
        for unit in &coded.units[from.units..] {
            let vertices = &coded.unit_vertices[vertex..][..unit.vertex_count as usize];
            let indices = &coded.indices[index..][..unit.triangle_count as usize * 3];
            symbols.write_unit(indices, |step| predictor.see(step, vertices));
            predictor.finish_unit(vertices);
            vertex += vertices.len();
            index += indices.len();
        }
        numbers::write(bytes, &symbols.edges, Kind::Remainders);
        let vertex_symbols = symbols.vertices.len() as u32;
        bytes.extend_from_slice(&vertex_symbols.to_le_bytes());
        numbers::write(bytes, &symbols.vertices, Kind::Remainders);
        let distances = symbols.distances.len() as u32;
        bytes.extend_from_slice(&distances.to_le_bytes());
        numbers::write(bytes, &symbols.distances, Kind::Remainders);
        (predictor.finish(self.unused_vertices), symbols)
    }

    /// Reads a section onto the end of `coded`.
    pub(super) fn read(&self, bytes: &[u8], coded: &mut Coded) -> Result<(), FileError> {
        let from = Ends::of(coded);
        let mut budget = Budget::of(bytes);
        let reader = &mut Reader { rest: bytes };
        let groups: u32 = reader.value("the groups")?;
        let groups = budget.claim(u64::from(groups), GROUP_BYTES)?;
        read_indices(reader, groups, "the groups", &mut coded.group_indices)?;
        let added: Vec<Group> = records::read(reader, groups, "the groups")?;
        let finer = budget.claim_all(added.iter().map(|group| group.finer_count), 4)?;
        let units = budget.claim_all(added.iter().map(|group| group.unit_count), UNIT_BYTES)?;
        coded.groups.extend(added);
        read_finer(reader, finer, coded, from)?;
        let added: Vec<Unit> = records::read(reader, units, "the units")?;
        let cluster_bytes = size_of::<Cluster>();
        let clusters = added.iter().map(|unit| unit.cluster_count);
        let clusters = budget.claim_all(clusters, cluster_bytes)?;
        let references = budget.claim_all(added.iter().map(|unit| unit.vertex_count), 4)?;
        let triangles = added.iter().map(|unit| unit.triangle_count);
        let triangles = budget.claim_all(triangles, TRIANGLE_BYTES)?;
        coded.units.extend(added);
        restore_units(coded, from)?;
        let added: Vec<Cluster> = records::read(reader, clusters, "the clusters")?;
        coded.clusters.extend(added);
        let used = read_references(reader, references, coded, from)?;
        let added = used as u64 + self.unused_vertices as u64;
        let added = budget.claim(added, (coded.rows.width + 1) * 4)?;
        let what = "the vertex order";
        read_indices(reader, added, what, &mut coded.source_vertices)?;
        let predictions = self.read_triangles(reader, triangles, budget, coded, from)?;
        coded.rows.add_zeros(added);
        planes::read(reader, &mut coded.rows, self.predictors, &predictions)?;
        match reader.rest.iter().position(|&byte| byte != 0) {
            Some(_) => Err(FileError::Corrupt {
                what: "the end of a section",
            }),
            None => Ok(()),
        }
    }

    fn read_triangles(
        &self,
        reader: &mut Reader<'_>,
        triangles: usize,
        mut budget: Budget,
        coded: &mut Coded,
        from: Ends,
    ) -> Result<Vec<Prediction>, FileError> {
        const WHAT: &str = "the triangles";
        let edges = numbers::read(reader, triangles, WHAT)?;
        let count: u32 = reader.value(WHAT)?;
        let vertices = numbers::read(reader, budget.claim(u64::from(count), 4)?, WHAT)?;
        let count: u32 = reader.value(WHAT)?;
        let distances = numbers::read(reader, budget.claim(u64::from(count), 4)?, WHAT)?;
        let mut symbols = SymbolReader {
            edges: edges.iter(),
            vertices: vertices.iter(),
            distances: distances.iter(),
        };
        let added = coded.source_vertices.len() - from.vertices;
        let mut predictor = Predictor::new(from.vertices, added);
        coded.indices.reserve(triangles * 3);
        let mut vertex = from.unit_vertices;
        for unit in &coded.units[from.units..] {
            let vertices = &coded.unit_vertices[vertex..][..unit.vertex_count as usize];
            let (triangles, count) = (unit.triangle_count, unit.vertex_count);
            symbols.read_unit(triangles, count, &mut coded.indices, |step| {
                predictor.see(step, vertices);
            })?;
            predictor.finish_unit(vertices);
            vertex += vertices.len();
        }
        Ok(predictor.finish(self.unused_vertices))
    }
}

/// How much memory a section may still claim.
struct Budget {
    bytes: u64,
}

impl Budget {
    fn of(section: &[u8]) -> Self {
        let bytes = (section.len() as u64).saturating_mul(MAX_PER_BYTE);
        Self { bytes }
    }

    /// Room for `count` elements of so many bytes.
    fn claim(&mut self, count: u64, element_bytes: usize) -> Result<usize, FileError> {
        let what = "the number of elements";
        let claimed = count.saturating_mul(element_bytes as u64);
        let left = self.bytes.checked_sub(claimed);
        self.bytes = left.ok_or(FileError::Corrupt { what })?;
        Ok(count as usize)
    }

    fn claim_all(
        &mut self,
        counts: impl Iterator<Item = u32>,
        element_bytes: usize,
    ) -> Result<usize, FileError> {
        self.claim(counts.map(u64::from).sum(), element_bytes)
    }
}

impl Ends {
    /// What a reader claims for all since `from`.
    fn bytes_since(&self, from: Self, planes: usize, symbols: &Symbols) -> usize {
        (self.groups - from.groups) * GROUP_BYTES
            + (self.finer - from.finer) * 4
            + (self.units - from.units) * UNIT_BYTES
            + (self.clusters - from.clusters) * size_of::<Cluster>()
            + (self.unit_vertices - from.unit_vertices) * 4
            + (self.indices - from.indices) / 3 * TRIANGLE_BYTES
            + (symbols.vertices.len() + symbols.distances.len()) * 4
            + (self.vertices - from.vertices) * (planes + 1) * 4
    }
}

/// Indices that mostly count up.
fn write_indices(bytes: &mut Vec<u8>, indices: &[u32]) {
    let mut before = u32::MAX;
    let differences = indices.iter().map(|&index| {
        let difference = index.wrapping_sub(before).wrapping_sub(1);
        before = index;
        zigzag(difference)
    });
    numbers::write(bytes, &differences.collect::<Vec<_>>(), Kind::Remainders);
}

fn read_indices(
    reader: &mut Reader<'_>,
    count: usize,
    what: &'static str,
    indices: &mut Vec<u32>,
) -> Result<(), FileError> {
    let mut before = u32::MAX;
    let differences = numbers::read(reader, count, what)?;
    indices.extend(differences.into_iter().map(|difference| {
        before = before.wrapping_add(unzigzag(difference)).wrapping_add(1);
        before
    }));
    Ok(())
}

/// Finer groups, by how far they lie before their group.
fn write_finer(bytes: &mut Vec<u8>, coded: &Coded, from: Ends) {
    let mut finer = coded.finer[from.finer..].iter();
    let mut differences = Vec::new();
    for (group, index) in coded.groups_since(from.groups) {
        let links = finer.by_ref().take(group.finer_count as usize);
        differences.extend(links.map(|&finer| index.wrapping_sub(finer)));
    }
    numbers::write(bytes, &differences, Kind::Plain);
}

fn read_finer(
    reader: &mut Reader<'_>,
    count: usize,
    coded: &mut Coded,
    from: Ends,
) -> Result<(), FileError> {
    let differences = numbers::read(reader, count, "the finer groups")?;
    let mut differences = differences.into_iter();
    let mut finer = Vec::with_capacity(count);
    for (group, index) in coded.groups_since(from.groups) {
        let links = differences.by_ref().take(group.finer_count as usize);
        finer.extend(links.map(|difference| index.wrapping_sub(difference)));
    }
    coded.finer.extend(finer);
    Ok(())
}

/// Puts back who consumes and who produced each unit.
fn restore_units(coded: &mut Coded, from: Ends) -> Result<(), FileError> {
    let mut unit = from.units;
    for group in from.groups..coded.groups.len() {
        let index = coded.group_indices[group];
        for _ in 0..coded.groups[group].unit_count {
            let unit_of = coded.units.get_mut(unit);
            let unit_of = unit_of.ok_or(FileError::Corrupt { what: "the units" })?;
            unit_of.produced_by = match unit_of.produced_by {
                0 => NO_GROUP,
                difference => index.wrapping_sub(difference),
            };
            unit_of.consumed_by = index;
            unit += 1;
        }
    }
    Ok(())
}

fn write_references(bytes: &mut Vec<u8>, coded: &Coded, from: Ends) {
    let mut references = References::new(from.vertices);
    let vertices = coded.unit_vertices[from.unit_vertices..].iter();
    let numbers: Vec<u32> = vertices.map(|&vertex| references.number(vertex)).collect();
    numbers::write(bytes, &numbers, Kind::Remainders);
}

/// Returns how many vertices are new.
fn read_references(
    reader: &mut Reader<'_>,
    count: usize,
    coded: &mut Coded,
    from: Ends,
) -> Result<usize, FileError> {
    const WHAT: &str = "the vertex lists";
    let mut references = References::new(from.vertices);
    coded.unit_vertices.reserve(count);
    for number in numbers::read(reader, count, WHAT)? {
        let vertex = references.vertex(number);
        let vertex = vertex.ok_or(FileError::Corrupt { what: WHAT })?;
        coded.unit_vertices.push(vertex);
    }
    Ok(references.next as usize - from.vertices)
}
