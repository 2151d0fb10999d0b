//! Decodes the sections of a primitive.

use std::ops::Range;

use super::contents::BakedPrimitive;
use super::error::FileError;
use super::layout::Entry;
use super::reader::Reader;
use crate::file::sections::coded::Coded;
use crate::file::sections::section_reader;
use crate::file::vertices::attributes;
use crate::file::vertices::planes::Plane;
use crate::hierarchy::Hierarchy;

/// Decodes a primitive, section by section.
pub(super) struct Decoder {
    entry: Entry,
    planes: Vec<Plane>,
    coded: Coded,
    sections_read: usize,
}

impl Decoder {
    /// `is_page` is `true` for a page of a `.fieldpages` file.
    pub(super) fn new(entry: Entry, is_page: bool) -> Self {
        let planes = entry.attributes.planes(entry.grids().is_some());
        let mut coded = Coded::new(planes.len());
        coded.is_page = is_page;
        Self {
            entry,
            planes,
            coded,
            sections_read: 0,
        }
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
        let (unused_vertices, origins) = if self.sections_read == self.entry.sections.len() {
            (self.entry.counts.unused_vertices, self.entry.counts.origins)
        } else {
            (0, 0)
        };
        section_reader::read(
            bytes,
            &mut self.coded,
            &self.planes,
            unused_vertices as usize,
            origins as usize,
        )
    }

    /// Returns the validated primitive.
    pub(super) fn finish(mut self) -> Result<BakedPrimitive, FileError> {
        self.coded.restore_starts();
        let hierarchy = self.hierarchy()?;
        let valid = hierarchy.validate();
        let primitive = self.entry.number;
        valid.map_err(|fault| FileError::Invalid { primitive, fault })?;
        Ok(BakedPrimitive {
            mesh_index: self.entry.mesh_index,
            primitive_index: self.entry.primitive_index,
            name: self.entry.name,
            hierarchy,
            position_error_in_local: self.entry.position_error_in_local,
            grid_box: None,
        })
    }

    fn hierarchy(&self) -> Result<Hierarchy, FileError> {
        let (entry, coded, counts) = (&self.entry, &self.coded, self.entry.counts);
        let places = inverse(&coded.vertex_indices, counts.vertices, "the vertex order")?;
        let (grids, attributes) = (entry.grids(), entry.attributes);
        // Sections hold coarse groups first; a hierarchy holds finer groups first.
        let order = inverse(&coded.group_indices, counts.groups, "the groups")?;
        let mut hierarchy = Hierarchy {
            source: entry.source,
            vertices: attributes::from_columns(&coded.columns, attributes, grids, &places),
            source_vertex_count: counts.source_vertices,
            moved_from: coded.moved_from.clone(),
            carrier_joint: entry.carrier_joint,
            groups: Vec::with_capacity(coded.groups.len()),
            finer: Vec::with_capacity(coded.finer.len()),
            units: Vec::with_capacity(coded.units.len()),
            unit_vertices: Vec::with_capacity(coded.unit_vertices.len()),
            indices: Vec::with_capacity(coded.indices.len()),
        };
        for place in order {
            let group = coded.groups[place as usize];
            for unit in &coded.units[group.units()] {
                let vertices = coded.unit_vertices[unit.vertices()].iter();
                let Range { start, end } = unit.triangles();
                hierarchy.push_unit(
                    unit.produced_by,
                    unit.aabb,
                    vertices.map(|&code| coded.vertex_indices[code as usize]),
                    coded.indices[start * 3..end * 3].iter().copied(),
                );
            }
            hierarchy.push_group(group, coded.finer[group.finer()].iter().copied());
        }
        Ok(hierarchy)
    }
}

/// The position of each index in `indices`. Fails unless `indices` is a permutation of `0..count`.
fn inverse(indices: &[u32], count: u32, what: &'static str) -> Result<Vec<u32>, FileError> {
    const NONE: u32 = u32::MAX;
    let mut places = vec![NONE; indices.len()];
    for (place, &index) in (0..).zip(indices) {
        match places.get_mut(index as usize) {
            Some(free) if *free == NONE => *free = place,
            _ => return Err(FileError::Corrupt { what }),
        }
    }
    if places.len() == count as usize {
        Ok(places)
    } else {
        Err(FileError::Corrupt { what })
    }
}
