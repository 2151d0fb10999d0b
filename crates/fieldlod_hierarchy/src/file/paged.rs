//! The `.fieldpages` file: hierarchies that are streamed in pages.
//!
//! ```text
//! magic "FLDPAG\r\n" | version u32 | mesh count u32 | contents bytes u64 | XXH3 of them u64
//! contents: per mesh  place, name, attributes, precision, counts, and length u64 and XXH3 u64 of each page;
//!           groups, units and their links; how many groups and vertices are in each page, and which
//! pages:    the first of every mesh, the second of every mesh, …
//! ```
//! The first page of a mesh holds what its coarsest cut draws, each further one some neighbouring
//! groups of one level, coarse levels first. A page is coded as a section of a
//! [`.fieldlod` file](super) is, with all its vertices: it needs no other page to be read.

mod partition;
mod table;

use std::ops::Range;

use super::contents::BakedFile;
use super::decode::Decoder;
use super::error::FileError;
use super::layout::{self, Entry};
use super::reader::Reader;
use crate::file::vertices::quantize::Precision;
use crate::hierarchy::Hierarchy;

/// How a file that is read in parts is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageOptions {
    /// How exactly the file keeps vertex attributes.
    pub precision: Precision,
    /// About how many bytes the meshes of a page take on the GPU.
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
    /// One for each primitive that was baked.
    pub meshes: Vec<PagedMesh>,
}

/// A mesh whose geometry is read page by page.
#[derive(Clone, Debug)]
pub struct PagedMesh {
    /// Index of the mesh in the glTF file.
    pub mesh_index: u32,
    /// Index of the primitive in that mesh.
    pub primitive_index: u32,
    /// The mesh's name, or an empty string.
    pub name: String,
    /// Groups, units and their links: a hierarchy without vertices and triangles. Units tell how many
    /// triangles and vertices they have, and no boxes.
    pub graph: Hierarchy,
    /// The pages.
    pub pages: Vec<Page>,
    /// All groups, page by page.
    groups: Vec<u32>,
    /// By group.
    page_of: Vec<u32>,
    entry: Entry,
}

/// Where some groups of a mesh are in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Page {
    /// The bytes of the file to read.
    pub bytes: Range<u64>,
    /// Bytes of the meshes of its units on the GPU.
    pub mesh_bytes: u32,
    /// Its groups in `PagedMesh::groups`.
    groups: Range<u32>,
    vertex_count: u32,
}

impl PagedFile {
    /// Bytes at the beginning of a file that tell how long the table of contents is.
    pub const HEADER_BYTES: usize = layout::HEADER_BYTES;

    /// Whether bytes begin as those of such a file do.
    #[must_use]
    pub fn is_paged(bytes: &[u8]) -> bool {
        bytes.starts_with(&table::MAGIC)
    }

    /// The bytes of a file of the hierarchies in `file`: the same for the same contents.
    ///
    /// # Panics
    /// If a hierarchy is not valid.
    #[must_use]
    pub fn to_bytes(file: &BakedFile, options: PageOptions) -> Vec<u8> {
        let primitives = file.primitives.iter();
        let meshes = primitives.map(|primitive| partition::encode(primitive, options));
        let (meshes, pages): (Vec<_>, Vec<_>) = meshes.unzip();
        let mut bytes = table::write(&meshes);
        for page in in_file_order(&pages) {
            bytes.extend_from_slice(page);
        }
        bytes
    }

    /// Where the table of contents ends, from the [first bytes](Self::HEADER_BYTES) of a file.
    ///
    /// # Errors
    /// A [`FileError`] if those are not of such a file.
    pub fn contents_end(header: &[u8]) -> Result<u64, FileError> {
        let (header, _) = table::read_header(header)?;
        let end = header.length.checked_add(Self::HEADER_BYTES as u64);
        end.ok_or(FileError::Corrupt {
            what: "the table of contents",
        })
    }

    /// Reads the table of contents from the bytes of a file up to where [that ends](Self::contents_end),
    /// or beyond.
    ///
    /// # Errors
    /// A [`FileError`] that says what is wrong; never a panic, whatever the bytes.
    pub fn from_contents(bytes: &[u8]) -> Result<Self, FileError> {
        let mut meshes = table::read(bytes)?;
        // Where pages are follows from how long those before are.
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

/// The first of each, the second of each, and so on.
fn in_file_order<T>(lists: &[Vec<T>]) -> impl Iterator<Item = &T> {
    let longest = lists.iter().map(Vec::len).max().unwrap_or(0);
    (0..longest).flat_map(move |number| lists.iter().filter_map(move |list| list.get(number)))
}

impl PagedMesh {
    /// How far positions lie from where the bake had them at most, in local units: 0 unless the file was
    /// written with [`Precision::Quantized16`].
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

    /// The units of a page as indices into those of [`PagedMesh::graph`], in the order in which
    /// [`PagedMesh::read_page`] gives them.
    pub fn units_of(&self, page: usize) -> impl Iterator<Item = u32> + '_ {
        let groups = self.groups_of(page).iter();
        groups.flat_map(|&group| {
            let units = self.graph.groups[group as usize].units();
            units.start as u32..units.end as u32
        })
    }

    /// The page that holds the units which `group` consumes.
    #[must_use]
    pub fn page_of(&self, group: u32) -> u32 {
        self.page_of[group as usize]
    }

    /// Reads a page from its bytes: a hierarchy of the page's groups in their order, whose units are
    /// source geometry.
    ///
    /// # Errors
    /// A [`FileError`] that says what is wrong; never a panic, whatever the bytes.
    pub fn read_page(&self, page: usize, bytes: &[u8]) -> Result<Hierarchy, FileError> {
        let entry = self.entry_of(page);
        if bytes.len() as u64 != entry.sections[0].length {
            return Err(FileError::Checksum);
        }
        let mut decoder = Decoder::of_page(entry);
        decoder.read_section(&mut Reader { rest: bytes })?;
        let read = decoder.finish(0)?.hierarchy;
        self.check_page(page, &read)?;
        Ok(read)
    }

    /// What a directory would say of a page.
    fn entry_of(&self, page: usize) -> Entry {
        let Page {
            groups,
            vertex_count,
            ..
        } = &self.pages[page];
        Entry {
            name: String::new(),
            group_count: groups.end - groups.start,
            vertex_count: *vertex_count,
            source_vertex_count: *vertex_count,
            origin_count: 0,
            sections: vec![self.entry.sections[page]],
            ..self.entry.clone()
        }
    }

    /// Checks that a page has the units that the table of contents announces.
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
