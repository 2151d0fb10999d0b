//! Decodes the sections of a primitive.

use std::ops::Range;

use super::contents::BakedPrimitive;
use super::error::FileError;
use super::layout::Entry;
use super::reader::Reader;
use crate::file::sections::coded::Coded;
use crate::file::sections::section_reader;
use crate::file::vertices::attributes;
use crate::file::vertices::predict::Predict;
use crate::hierarchy::{Hierarchy, NO_GROUP, Unit};

/// Decodes a primitive, section by section.
pub(super) struct Decoder {
    entry: Entry,
    predictors: Vec<Predict>,
    coded: Coded,
    sections_read: usize,
}

impl Decoder {
    pub(super) fn new(entry: Entry) -> Self {
        let predictors = entry.attributes.predictors(entry.grids().is_some());
        let coded = Coded::new(
            predictors.len(),
            entry.counts.source_vertices,
            entry.options.beside_source,
        );
        Self {
            entry,
            predictors,
            coded,
            sections_read: 0,
        }
    }

    /// Creates the decoder of a page.
    pub(super) fn of_page(entry: Entry) -> Self {
        let mut decoder = Self::new(entry);
        decoder.coded.is_page = true;
        decoder
    }

    /// Reads the next section of the primitive, if there is one, from the front of `reader`.
    pub(super) fn read_section(&mut self, reader: &mut Reader<'_>) -> Result<(), FileError> {
        let Some(section) = self.entry.sections.get(self.sections_read) else {
            return Ok(());
        };
        let bytes = reader.take("a section", section.length)?;
        section.check(bytes)?;
        self.sections_read += 1;
        // Only the last section has unused vertices and origins.
        let (unused_vertices, origins) = if self.is_whole() {
            (self.entry.counts.unused_vertices, self.entry.counts.origins)
        } else {
            (0, 0)
        };
        section_reader::read(
            bytes,
            &mut self.coded,
            &self.predictors,
            self.entry.grids(),
            unused_vertices as usize,
            origins as usize,
        )
    }

    fn is_whole(&self) -> bool {
        self.sections_read == self.entry.sections.len()
    }

    /// Returns the validated primitive. `primitive` is its index in the file.
    pub(super) fn finish(mut self, primitive: usize) -> Result<BakedPrimitive, FileError> {
        self.coded.restore_starts();
        let mut hierarchy = self.hierarchy()?;
        let valid = if self.entry.options.beside_source {
            hierarchy = hierarchy.without_source_vertices();
            hierarchy.validate_without_positions()
        } else {
            hierarchy.validate()
        };
        valid.map_err(|fault| FileError::Invalid { primitive, fault })?;
        Ok(BakedPrimitive {
            mesh_index: self.entry.mesh_index,
            primitive_index: self.entry.primitive_index,
            name: self.entry.name,
            hierarchy,
            position_error_in_local: self.entry.position_error_in_local,
        })
    }

    fn hierarchy(&self) -> Result<Hierarchy, FileError> {
        let (entry, coded) = (&self.entry, &self.coded);
        let vertex_count = coded.vertex_indices.len();
        check_count(entry.counts.groups, coded.groups.len(), "the groups")?;
        check_count(entry.counts.vertices, vertex_count, "the vertex order")?;
        let rows_of_vertices = inverse(&coded.vertex_indices)?;
        let vertices = attributes::from_rows(
            &coded.rows,
            entry.attributes,
            entry.grids(),
            &rows_of_vertices,
        );
        // Sections hold coarse groups first; a hierarchy holds finer groups first.
        let order = group_order(coded)?;
        let indices = order
            .iter()
            .map(|&place| coded.group_indices[place as usize]);
        let mut builder = Builder {
            coded,
            indices: indices.collect(),
            hierarchy: Hierarchy {
                source: entry.source,
                vertices,
                source_vertex_count: entry.counts.source_vertices,
                moved_from: coded.moved_from.clone(),
                carrier_joint: entry.carrier_joint,
                ..Hierarchy::default()
            },
        };
        builder.reserve();
        for place in order {
            builder.add_group(place as usize);
        }
        Ok(builder.hierarchy)
    }
}

fn check_count(expected: u32, found: usize, what: &'static str) -> Result<(), FileError> {
    if expected as usize == found {
        Ok(())
    } else {
        Err(FileError::Corrupt { what })
    }
}

/// The row of each vertex of the hierarchy. Row 0 belongs to no vertex.
fn inverse(vertex_indices: &[u32]) -> Result<Vec<u32>, FileError> {
    let what = "the vertex order";
    let mut rows = vec![0; vertex_indices.len()];
    for (code, &vertex) in vertex_indices.iter().enumerate() {
        match rows.get_mut(vertex as usize) {
            Some(row) if *row == 0 => *row = code as u32 + 1,
            _ => return Err(FileError::Corrupt { what }),
        }
    }
    Ok(rows)
}

/// Positions of the groups in `coded`, in the order of the hierarchy.
fn group_order(coded: &Coded) -> Result<Vec<u32>, FileError> {
    let indices = &coded.group_indices;
    let mut order: Vec<u32> = (0..indices.len() as u32).collect();
    order.sort_unstable_by_key(|&place| indices[place as usize]);
    let is_equal = |pair: &[u32]| indices[pair[0] as usize] == indices[pair[1] as usize];
    if order.windows(2).any(is_equal) {
        let what = "the groups";
        return Err(FileError::Corrupt { what });
    }
    Ok(order)
}

struct Builder<'a> {
    coded: &'a Coded,
    /// Indices of the groups in the encoded hierarchy, ascending.
    indices: Vec<u32>,
    hierarchy: Hierarchy,
}

impl Builder<'_> {
    fn reserve(&mut self) {
        let (from, to) = (self.coded, &mut self.hierarchy);
        to.groups.reserve_exact(from.groups.len());
        to.finer.reserve_exact(from.finer.len());
        to.units.reserve_exact(from.units.len());
        to.unit_vertices.reserve_exact(from.unit_vertices.len());
        to.indices.reserve_exact(from.indices.len());
    }

    /// Adds a group of `coded`.
    fn add_group(&mut self, index: usize) {
        let coded = self.coded;
        let group = coded.groups[index];
        for unit in &coded.units[group.units()] {
            self.add_unit(unit);
        }
        let links = coded.finer[group.finer()].iter();
        // A malformed file may link to groups that do not exist.
        let read = links.filter_map(|&finer| position(&self.indices, finer));
        self.hierarchy.push_group(group, read);
    }

    fn add_unit(&mut self, unit: &Unit) {
        let coded = self.coded;
        let vertices = coded.unit_vertices[unit.vertices()].iter();
        let Range { start, end } = unit.triangles();
        self.hierarchy.push_unit(
            position(&self.indices, unit.produced_by).unwrap_or(NO_GROUP),
            unit.aabb,
            vertices.map(|&code| coded.vertex_indices[code as usize]),
            coded.indices[start * 3..end * 3].iter().copied(),
        );
    }
}

/// Position of a group index in the sorted `indices`.
fn position(indices: &[u32], index: u32) -> Option<u32> {
    let place = indices.binary_search(&index).ok()?;
    Some(place as u32)
}
