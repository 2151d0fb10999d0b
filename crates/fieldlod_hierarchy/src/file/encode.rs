//! Encodes the sections of a primitive.

use super::contents::BakedPrimitive;
use super::layout::{Counts, Entry, SectionEntry};
use crate::file::sections::coded::Coded;
use crate::file::sections::section_writer;
use crate::file::vertices::attribute_columns::Columns;
use crate::file::vertices::attributes::{self, Attributes};
use crate::file::vertices::quantize::{self, Grids, Precision};
use crate::hierarchy::{Hierarchy, Unit};

/// Returns the directory entry and the sections of a primitive.
///
/// # Panics
/// If the hierarchy is not valid.
pub(super) fn encode(primitive: &BakedPrimitive, precision: Precision) -> (Entry, Vec<Vec<u8>>) {
    let prepared = prepare(primitive, precision);
    let (sections, unused_vertices) =
        prepared.sections(prepared.hierarchy(), &prepared.columns, false);
    let of_sections = sections.iter().map(|section| SectionEntry::of(section));
    let mut entry = prepared.entry(primitive, of_sections.collect());
    entry.counts.unused_vertices = unused_vertices as u32;
    (entry, sections)
}

/// A hierarchy with the vertices that a reader will get, and the columns of these vertices.
pub(super) struct Prepared<'a> {
    source: &'a Hierarchy,
    /// The hierarchy with rounded vertices, and a bound for the distance of a rounded position from the exact one.
    rounded: Option<(Hierarchy, f32)>,
    pub(super) columns: Columns,
    attributes: Attributes,
    grids: Grids,
    precision: Precision,
}

/// # Panics
/// If the hierarchy is not valid.
pub(super) fn prepare(primitive: &BakedPrimitive, precision: Precision) -> Prepared<'_> {
    let source = &primitive.hierarchy;
    assert_eq!(
        source.validate(),
        Ok(()),
        "only valid hierarchies can be written"
    );
    let attributes = Attributes::of(&source.vertices);
    // One grid for all sections and pages: vertices that they share must round to equal positions.
    let grids = Grids::around(&source.vertices, primitive.grid_box);
    let quantized = (precision == Precision::Quantized16).then_some(&grids);
    let columns = attributes::to_columns(&source.vertices, quantized);
    // Bounds must contain the rounded vertices.
    let rounded = quantized.map(|grids| {
        let all: Vec<u32> = (0..source.vertices.positions.len() as u32).collect();
        let vertices = attributes::from_columns(&columns, attributes, Some(grids), &all);
        // Vertices that lie on the grid were rounded before.
        let is_rounded = primitive.position_error_in_local > 0.0
            && vertices.positions == source.vertices.positions;
        let error_in_local = if is_rounded {
            0.0
        } else {
            grids.position_error()
        };
        (
            quantize::with_vertices(source, vertices, error_in_local),
            error_in_local,
        )
    });
    Prepared {
        source,
        rounded,
        columns,
        attributes,
        grids,
        precision,
    }
}

impl Prepared<'_> {
    pub(super) fn hierarchy(&self) -> &Hierarchy {
        self.rounded
            .as_ref()
            .map_or(self.source, |(hierarchy, _)| hierarchy)
    }

    /// The directory entry of a primitive. The caller sets the number of unused vertices.
    pub(super) fn entry(&self, primitive: &BakedPrimitive, sections: Vec<SectionEntry>) -> Entry {
        let hierarchy = self.hierarchy();
        let moved_by = self.rounded.as_ref().map_or(0.0, |(_, moved_by)| *moved_by);
        Entry {
            number: 0,
            mesh_index: primitive.mesh_index,
            primitive_index: primitive.primitive_index,
            name: primitive.name.clone(),
            source: hierarchy.source,
            attributes: self.attributes,
            precision: self.precision,
            carrier_joint: hierarchy.carrier_joint,
            grids: self.grids,
            position_error_in_local: primitive.position_error_in_local + moved_by,
            counts: Counts {
                groups: hierarchy.groups.len() as u32,
                vertices: hierarchy.vertices.positions.len() as u32,
                source_vertices: hierarchy.source_vertex_count,
                origins: hierarchy.moved_from.len() as u32,
                unused_vertices: 0,
            },
            sections,
        }
    }

    /// Encodes a page as one section. Units of a page have no producer, and use its vertices in order.
    pub(super) fn page(&self, hierarchy: &Hierarchy, columns: &Columns) -> Vec<u8> {
        self.sections(hierarchy, columns, true).0.swap_remove(0)
    }

    /// Encodes the sections of a hierarchy whose vertices have these `columns`. Also returns the number of
    /// vertices that no unit uses.
    fn sections(
        &self,
        hierarchy: &Hierarchy,
        columns: &Columns,
        is_page: bool,
    ) -> (Vec<Vec<u8>>, usize) {
        let is_quantized = self.precision == Precision::Quantized16;
        let planes = self.attributes.planes(is_quantized);
        let mut coder = Coder {
            hierarchy,
            columns,
            coded: Coded::new(planes.len()),
            codes: vec![u32::MAX; hierarchy.vertices.positions.len()],
        };
        coder.coded.is_page = is_page;
        let groups_of_sections = groups_by_section(hierarchy);
        let last = groups_of_sections.len() - 1;
        let mut sections = Vec::new();
        let mut unused_vertices = 0;
        for (number, groups) in groups_of_sections.into_iter().enumerate() {
            let from = coder.coded.ends();
            for group in groups {
                coder.add_group(group);
            }
            // Unused vertices and origins belong to no level. They are last, so that coarser sections stay small.
            if number == last {
                unused_vertices = coder.add_unused();
                coder.coded.moved_from.clone_from(&hierarchy.moved_from);
            }
            sections.push(section_writer::write(&coder.coded, from, &planes));
        }
        (sections, unused_vertices)
    }
}

/// The groups of each section. The first section holds the terminal groups. For each N, a cut refines exactly the
/// groups of the first N sections.
fn groups_by_section(hierarchy: &Hierarchy) -> Vec<Vec<u32>> {
    let level_count = hierarchy.level_count();
    let mut groups_of_sections = vec![Vec::new(); level_count.max(1) as usize];
    for (index, group) in hierarchy.groups.iter().enumerate() {
        let section = if group.is_terminal() {
            0
        } else {
            level_count - 1 - group.level
        };
        groups_of_sections[section as usize].push(index as u32);
    }
    groups_of_sections
}

struct Coder<'a> {
    hierarchy: &'a Hierarchy,
    columns: &'a Columns,
    coded: Coded,
    /// For each vertex of the hierarchy, its index in `coded`, or `u32::MAX`.
    codes: Vec<u32>,
}

impl Coder<'_> {
    fn add_group(&mut self, index: u32) {
        let hierarchy = self.hierarchy;
        self.coded.push_group(hierarchy, index);
        for unit in &hierarchy.units[hierarchy.groups[index as usize].units()] {
            self.add_geometry(unit);
        }
    }

    fn add_geometry(&mut self, unit: &Unit) {
        let hierarchy = self.hierarchy;
        for &vertex in hierarchy.vertices_of(unit) {
            let code = self.code_of(vertex);
            self.coded.unit_vertices.push(code);
        }
        self.coded.indices.extend(hierarchy.indices_of(unit));
    }

    fn code_of(&mut self, vertex: u32) -> u32 {
        let code = &mut self.codes[vertex as usize];
        if *code == u32::MAX {
            *code = self.coded.vertex_indices.len() as u32;
            self.coded.vertex_indices.push(vertex);
            self.coded.columns.push_from(self.columns, vertex);
        }
        *code
    }

    /// Adds the vertices that no unit uses and returns their number.
    fn add_unused(&mut self) -> usize {
        let before = self.coded.vertex_indices.len();
        for vertex in 0..self.codes.len() as u32 {
            self.code_of(vertex);
        }
        self.coded.vertex_indices.len() - before
    }
}
