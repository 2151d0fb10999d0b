//! The `.fieldpages` file: hierarchies for streaming in pages.
//!
//! ```text
//! magic "FLDPAG\r\n" | version u32 | mesh count u32 | contents bytes u64 | XXH3 of contents u64, seed: mesh count
//! contents: per mesh  a directory entry as in a `.fieldlod` file, with length u64 and XXH3 u64 of each page;
//!           length u64 of the rest; groups, units and their links;
//!           counts of groups and vertices, and mesh bytes, of each page; groups by page
//! pages:    the first of every mesh, the second of every mesh, …
//! ```
//! The first page of a mesh holds the groups of its coarsest cut. Each further page holds neighbouring
//! groups of one level, coarse levels first. A page has the encoding of a section of a
//! [`.fieldlod` file](super). A page contains all its vertices, so decoding needs no other page.

mod partition;
mod table;

use std::collections::HashMap;
use std::ops::Range;

use super::contents::BakedFile;
use super::decode::Decoder;
use super::error::FileError;
use super::in_file_order;
use super::layout::{self, Counts, Entry, SectionEntry};
use super::reader::Reader;
use crate::file::vertices::attribute_columns::Columns;
use crate::file::vertices::attributes::{Attributes, from_columns, to_columns};
use crate::file::vertices::quantize::Precision;
use crate::hierarchy::Hierarchy;
use crate::vertices::Vertices;

/// Options of writing a `.fieldpages` file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageOptions {
    /// Precision of vertex attributes.
    pub precision: Precision,
    /// Approximate upper limit for the meshes of a page on the GPU, in bytes. The first page may be larger. Smaller
    /// pages repeat more vertices and need more reads; larger pages load more geometry that no view needs.
    pub page_bytes: u32,
}

impl Default for PageOptions {
    /// Lossless, 128 KiB.
    fn default() -> Self {
        Self {
            precision: Precision::Lossless,
            page_bytes: 128 << 10,
        }
    }
}

/// The table of contents of a `.fieldpages` file.
#[derive(Clone, Debug)]
pub struct PagedFile {
    /// One entry per baked primitive.
    pub meshes: Vec<PagedMesh>,
}

/// The graph and the pages of one mesh.
#[derive(Clone, Debug)]
pub struct PagedMesh {
    /// Index of the mesh in the glTF file.
    pub mesh_index: u32,
    /// Index of the primitive in that mesh.
    pub primitive_index: u32,
    /// The mesh's name, or an empty string.
    pub name: String,
    /// Groups, units and links, without vertices and triangles. Units have counts of triangles and
    /// vertices, but default boxes.
    pub graph: Hierarchy,
    /// The pages.
    pub pages: Vec<Page>,
    /// Group indices, ordered by page.
    groups: Vec<u32>,
    /// The page of each group.
    page_of: Vec<u32>,
    /// After reading, without name and sections.
    entry: Entry,
}

/// One page of a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Page {
    /// Byte range in the file.
    pub bytes: Range<u64>,
    /// Size of the meshes of its units on the GPU, in bytes.
    pub mesh_bytes: u32,
    /// Range in `PagedMesh::groups`.
    groups: Range<u32>,
    vertex_count: u32,
    section: SectionEntry,
}

impl PagedFile {
    /// Length of the file header, which holds the length of the table of contents.
    pub const HEADER_BYTES: usize = layout::HEADER_BYTES;

    /// Returns `true` if the bytes start with the magic of a `.fieldpages` file.
    #[must_use]
    pub fn is_paged(bytes: &[u8]) -> bool {
        bytes.starts_with(&table::MAGIC)
    }

    /// Encodes the hierarchies of `file`. Equal contents give equal bytes.
    ///
    /// # Panics
    /// If a hierarchy is not valid.
    #[must_use]
    pub fn to_bytes(file: &BakedFile, options: PageOptions) -> Vec<u8> {
        let primitives = file.primitives.iter();
        let meshes = primitives.map(|primitive| partition::encode(primitive, options));
        let (meshes, pages): (Vec<_>, Vec<_>) = meshes.unzip();
        let mut bytes = table::write(&meshes);
        bytes.extend(in_file_order(&pages).flatten());
        bytes
    }

    /// End of the table of contents in the file. `header` starts with the
    /// [file header](Self::HEADER_BYTES).
    ///
    /// # Errors
    /// A [`FileError`] if the bytes are not the header of a `.fieldpages` file.
    pub fn contents_end(header: &[u8]) -> Result<u64, FileError> {
        let (header, _) = table::read_header(header)?;
        let end = header.length.checked_add(Self::HEADER_BYTES as u64);
        end.ok_or(FileError::Corrupt {
            what: "the table of contents",
        })
    }

    /// Decodes the table of contents. `bytes` starts at the beginning of the file and reaches at least
    /// the [end of the table](Self::contents_end).
    ///
    /// # Errors
    /// A [`FileError`] if the table is invalid.
    pub fn from_contents(bytes: &[u8]) -> Result<Self, FileError> {
        let mut meshes = table::read(bytes)?;
        // The table holds lengths of pages, not starts.
        let mut start = Self::contents_end(bytes)?;
        let longest = meshes.iter().map(|mesh| mesh.pages.len()).max();
        for number in 0..longest.unwrap_or(0) {
            for page in meshes
                .iter_mut()
                .filter_map(|mesh| mesh.pages.get_mut(number))
            {
                let end = start.checked_add(page.bytes.end);
                page.bytes = start..end.ok_or(FileError::Corrupt { what: "the pages" })?;
                start = page.bytes.end;
            }
        }
        Ok(Self { meshes })
    }
}

impl PagedMesh {
    /// Largest distance between a stored position and the baked position, in local units. 0 unless the
    /// file was written with [`Precision::Quantized16`].
    #[must_use]
    pub fn position_error_in_local(&self) -> f32 {
        self.entry.position_error_in_local
    }

    /// The groups of a page, ascending.
    #[must_use]
    pub fn groups_of(&self, page: usize) -> &[u32] {
        let Range { start, end } = self.pages[page].groups;
        &self.groups[start as usize..end as usize]
    }

    /// The units of a page as indices into the units of [`PagedMesh::graph`]. The order is that of
    /// [`PagedMesh::read_page`].
    pub fn units_of(&self, page: usize) -> impl Iterator<Item = u32> + '_ {
        let groups = self.groups_of(page).iter();
        groups.flat_map(|&group| {
            let units = self.graph.groups[group as usize].units();
            units.start as u32..units.end as u32
        })
    }

    /// The page that holds the units that `group` consumes.
    #[must_use]
    pub fn page_of(&self, group: u32) -> u32 {
        self.page_of[group as usize]
    }

    /// Decodes a page. The result has the groups of the page in order, without links: all units are
    /// source geometry.
    ///
    /// # Errors
    /// A [`FileError`] if the bytes are not this page.
    pub fn read_page(&self, page: usize, bytes: &[u8]) -> Result<Hierarchy, FileError> {
        // The decoder would ignore bytes after the page.
        if bytes.len() as u64 != self.pages[page].section.length {
            return Err(FileError::Checksum);
        }
        let mut decoder = Decoder::new(self.entry_of(page), true);
        decoder.read_section(&mut Reader { rest: bytes })?;
        let read = decoder.finish()?.hierarchy;
        self.check_page(page, &read)?;
        Ok(read)
    }

    /// Decodes a page from the bytes of the whole file, as [`read_page`](Self::read_page).
    ///
    /// # Errors
    /// A [`FileError`] if the file is truncated, or the bytes are not this page.
    pub fn read_page_of(&self, page: usize, file: &[u8]) -> Result<Hierarchy, FileError> {
        let Range { start, end } = self.pages[page].bytes;
        let bytes = file.get(start as usize..end as usize);
        let bytes = bytes.ok_or(FileError::Truncated {
            what: "the file",
            needed: end,
            available: file.len() as u64,
        })?;
        self.read_page(page, bytes)
    }

    /// Decodes all pages from the bytes of the whole file. `source` holds the vertices of the mesh with the hash of the
    /// graph. The hierarchy has these vertices as the file rounds them. Pages do not tell equal source vertices apart:
    /// triangles use the first one. The second result has the first equal vertex of each source vertex.
    ///
    /// # Errors
    /// A [`FileError`] if the bytes are not those of the file, or if `source` has other attributes.
    pub fn read_all(
        &self,
        file: &[u8],
        source: &Vertices,
    ) -> Result<(Hierarchy, Vec<u32>), FileError> {
        let (grids, attributes) = (self.entry.grids(), self.entry.attributes);
        if Attributes::of(source).bits != attributes.bits {
            let what = "the vertices of another source";
            return Err(FileError::Corrupt { what });
        }
        let all: Vec<u32> = (0..source.positions.len() as u32).collect();
        let rounded = from_columns(&to_columns(source, grids), attributes, grids, &all);
        let mut columns = to_columns(&rounded, grids);
        let mut places: HashMap<Vec<u32>, u32> = HashMap::new();
        let first = |&vertex: &u32| *places.entry(columns.row(vertex)).or_insert(vertex);
        let firsts = all.iter().map(first).collect();
        let mut count = all.len() as u32;
        let mut whole = Hierarchy {
            source: self.graph.source,
            source_vertex_count: count,
            ..Hierarchy::default()
        };
        let pages = (0..self.pages.len()).map(|page| self.read_page_of(page, file));
        let pages: Vec<Hierarchy> = pages.collect::<Result<_, _>>()?;
        let columns_of = |page: &Hierarchy| to_columns(&page.vertices, grids);
        let columns_of_pages: Vec<Columns> = pages.iter().map(columns_of).collect();
        for (index, group) in (0..).zip(&self.graph.groups) {
            let number = self.page_of(index) as usize;
            let at = self.groups_of(number).partition_point(|&own| own < index);
            let page = &pages[number];
            for (unit, own) in group.units().zip(&page.units[page.groups[at].units()]) {
                let vertices = page.vertices_of(own).iter().map(|&vertex| {
                    let of_page = &columns_of_pages[number];
                    let place = *places.entry(of_page.row(vertex)).or_insert(count);
                    if place == count {
                        columns.push_from(of_page, vertex);
                        count += 1;
                    }
                    place
                });
                let vertices: Vec<u32> = vertices.collect();
                let produced_by = self.graph.units[unit].produced_by;
                let indices = page.indices_of(own).iter().copied();
                whole.push_unit(produced_by, own.aabb, vertices, indices);
            }
            whole.push_group(*group, self.graph.finer_groups(group).iter().copied());
        }
        let all: Vec<u32> = (0..count).collect();
        whole.vertices = from_columns(&columns, attributes, grids, &all);
        Ok((whole, firsts))
    }

    /// The directory entry of a `.fieldlod` file that holds only this page.
    fn entry_of(&self, page: usize) -> Entry {
        let Page {
            groups,
            vertex_count,
            section,
            ..
        } = &self.pages[page];
        Entry {
            counts: Counts {
                groups: groups.end - groups.start,
                vertices: *vertex_count,
                source_vertices: *vertex_count,
                origins: 0,
                unused_vertices: 0,
            },
            sections: vec![*section],
            ..self.entry.clone()
        }
    }

    /// Checks that the units of a decoded page match the table of contents.
    fn check_page(&self, page: usize, read: &Hierarchy) -> Result<(), FileError> {
        let announced = self.units_of(page);
        let announced = announced.map(|unit| &self.graph.units[unit as usize]);
        let counts = announced.map(|unit| [unit.vertex_count, unit.triangle_count]);
        let found = read.units.iter();
        if counts.eq(found.map(|unit| [unit.vertex_count, unit.triangle_count])) {
            Ok(())
        } else {
            Err(FileError::Corrupt {
                what: "the units of a page",
            })
        }
    }
}
