//! The table of contents of a `.fieldpages` file.

use std::mem::take;
use std::ops::Range;

use super::{Page, PagedMesh};
use crate::file::error::FileError;
use crate::file::layout::{self, Entry, Header, SectionEntry};
use crate::file::reader::Reader;
use crate::file::sections::coded::{Coded, MAX_PER_BYTE};
use crate::file::sections::numbers;
use crate::file::sections::section_reader;
use crate::file::sections::section_writer;
use crate::hierarchy::Hierarchy;

pub(super) const MAGIC: [u8; 8] = *b"FLDPAG\r\n";
const WHAT: &str = "the table of contents";

/// Encodes header and table.
pub(super) fn write(meshes: &[PagedMesh]) -> Vec<u8> {
    let mut table = Vec::new();
    for mesh in meshes {
        mesh.entry.write(&mut table);
        let rest = mesh_bytes(mesh);
        table.extend_from_slice(&(rest.len() as u64).to_le_bytes());
        table.extend_from_slice(&rest);
    }
    layout::seal(MAGIC, meshes.len() as u32, &table)
}

/// Encodes the graph and the pages of a mesh. The directory entry precedes these bytes.
fn mesh_bytes(mesh: &PagedMesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut coded = Coded::default();
    for group in 0..mesh.graph.groups.len() as u32 {
        coded.push_group(&mesh.graph, group);
    }
    let nothing = Coded::default().ends();
    section_writer::write_graph(&mut bytes, &coded, nothing);
    let of_pages = |number: fn(&Page) -> u32| mesh.pages.iter().map(number).collect();
    let columns: [Vec<u32>; 4] = [
        of_pages(|page| page.groups.end - page.groups.start),
        of_pages(|page| page.vertex_count),
        of_pages(|page| page.mesh_bytes),
        mesh.groups.clone(),
    ];
    for column in columns {
        numbers::write(&mut bytes, &column);
    }
    // Readers reject sections that need more than `MAX_PER_BYTE` bytes of memory per byte.
    let claimed = section_writer::claimed_by_graph(&coded, nothing);
    let least = claimed.div_ceil(MAX_PER_BYTE as usize);
    bytes.resize(bytes.len().max(least), 0);
    bytes
}

/// Reads the header. The reader continues behind it.
pub(super) fn read_header<'a>(bytes: &'a [u8]) -> Result<(Header, Reader<'a>), FileError> {
    let mut reader = Reader { rest: bytes };
    let header = Header::read(MAGIC, &mut reader)?;
    Ok((header, reader))
}

/// Reads the meshes of a table. The byte ranges of pages are `0..length`.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<PagedMesh>, FileError> {
    let (header, mut reader) = read_header(bytes)?;
    let table = header.directory(&mut reader)?;
    let mut reader = Reader { rest: table };
    let mut meshes = Vec::new();
    for number in 0..header.count as usize {
        let entry = Entry::read(&mut reader, number)?;
        let length: u64 = reader.value(WHAT)?;
        let rest = reader.take(WHAT, length)?;
        meshes.push(read_mesh(entry, rest)?);
    }
    match reader.rest.len() as u64 {
        0 => Ok(meshes),
        extra => Err(FileError::TrailingBytes { extra }),
    }
}

fn read_mesh(mut entry: Entry, bytes: &[u8]) -> Result<PagedMesh, FileError> {
    let mut reader = Reader { rest: bytes };
    let graph = read_graph(&mut reader, &entry)?;
    // Reading a page copies the entry, which must then be small.
    let (name, sections) = (take(&mut entry.name), take(&mut entry.sections));
    let pages = read_pages(&mut reader, sections)?;
    let groups = numbers::read(&mut reader, graph.groups.len(), WHAT)?;
    reader.end(WHAT)?;
    // Fails unless each group is in exactly one page: indexing by group or by page would panic later.
    let page_of = pages_of_groups(&pages, &groups)?;
    // Coarse geometry is drawn as soon as the first page is resident.
    let mut pairs = graph.groups.iter().zip(&page_of);
    if pairs.any(|(group, page)| group.is_terminal() != (*page == 0)) {
        return Err(FileError::Corrupt { what: "the pages" });
    }
    Ok(PagedMesh {
        mesh_index: entry.mesh_index,
        primitive_index: entry.primitive_index,
        name,
        graph,
        pages,
        groups,
        page_of,
        entry,
    })
}

fn read_graph(reader: &mut Reader<'_>, entry: &Entry) -> Result<Hierarchy, FileError> {
    let mut coded = Coded::default();
    section_reader::read_graph(reader, &mut coded)?;
    let in_order = (0..)
        .zip(&coded.group_indices)
        .all(|(place, &index)| place == index);
    if !in_order || coded.groups.len() != entry.counts.groups as usize {
        return Err(FileError::Corrupt { what: "the groups" });
    }
    coded.restore_starts();
    // A graph has no geometry.
    for unit in &mut coded.units {
        (unit.first_vertex, unit.first_triangle) = (0, 0);
    }
    let graph = Hierarchy {
        source: entry.source,
        carrier_joint: entry.carrier_joint,
        units: coded.units,
        finer: coded.finer,
        groups: coded.groups,
        ..Hierarchy::default()
    };
    let checked = graph.validate_graph();
    checked.map_err(|fault| FileError::Invalid {
        primitive: entry.number,
        fault,
    })?;
    Ok(graph)
}

/// Reads pages with the byte ranges `0..length`.
fn read_pages(
    reader: &mut Reader<'_>,
    sections: Vec<SectionEntry>,
) -> Result<Vec<Page>, FileError> {
    let count = sections.len();
    let mut column = || numbers::read(reader, count, WHAT);
    let (group_counts, vertex_counts, mesh_bytes) = (column()?, column()?, column()?);
    let mut first = 0u32;
    let mut pages = Vec::with_capacity(count);
    for (page, section) in sections.into_iter().enumerate() {
        let end = first.checked_add(group_counts[page]);
        let groups: Range<u32> = first..end.ok_or(FileError::Corrupt { what: "the pages" })?;
        first = groups.end;
        pages.push(Page {
            bytes: 0..section.length,
            section,
            mesh_bytes: mesh_bytes[page],
            vertex_count: vertex_counts[page],
            groups,
        });
    }
    Ok(pages)
}

/// Returns the page of each group. Fails if a group is in no page or in several pages.
fn pages_of_groups(pages: &[Page], groups: &[u32]) -> Result<Vec<u32>, FileError> {
    const NONE: u32 = u32::MAX;
    let corrupt = FileError::Corrupt { what: "the pages" };
    let mut page_of = vec![NONE; groups.len()];
    let mut left = groups.iter();
    for (number, page) in (0..).zip(pages) {
        for _ in page.groups.clone() {
            let group = left
                .next()
                .and_then(|&group| page_of.get_mut(group as usize));
            match group {
                Some(page) if *page == NONE => *page = number,
                _ => return Err(corrupt),
            }
        }
    }
    match left.next() {
        None => Ok(page_of),
        Some(_) => Err(corrupt),
    }
}
