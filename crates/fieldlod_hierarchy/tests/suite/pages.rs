//! Round trips of `.fieldpages` files, and rejection of malformed ones.

use std::collections::HashMap;
use std::sync::LazyLock;

use fieldlod_hierarchy::fixtures::{self, Random};
use fieldlod_hierarchy::{
    BakedFile, BakedPrimitive, FileError, Hierarchy, PageOptions, PagedFile, PagedMesh, Precision,
};
use glam::Vec3;
use proptest::prelude::*;
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

use crate::common::file_of;

fn file() -> BakedFile {
    BakedFile {
        primitives: vec![
            BakedPrimitive::new(0, 0, "hills", fixtures::grid_pyramid(3)),
            BakedPrimitive::new(1, 0, "strip", fixtures::two_level_strip()),
            BakedPrimitive::new(2, 0, "nothing", Hierarchy::default()),
        ],
    }
}

fn small_pages(precision: Precision) -> PageOptions {
    PageOptions {
        precision,
        page_bytes: 64 << 10,
    }
}

fn read_page(mesh: &PagedMesh, page: usize, bytes: &[u8]) -> Result<Hierarchy, FileError> {
    let range = &mesh.pages[page].bytes;
    mesh.read_page(page, &bytes[range.start as usize..range.end as usize])
}

/// Corner positions of the triangles of a unit.
fn triangles(hierarchy: &Hierarchy, unit: usize) -> Vec<[Vec3; 3]> {
    let corner = |vertex: u32| hierarchy.vertices.positions[vertex as usize];
    let triangles = hierarchy.triangles_of(&hierarchy.units[unit]);
    triangles.map(|triangle| triangle.map(corner)).collect()
}

#[test]
fn pages_hold_each_unit_unchanged() {
    let file = file();
    let bytes = PagedFile::to_bytes(&file, small_pages(Precision::Lossless));
    let paged = PagedFile::from_contents(&bytes).unwrap();
    assert!(paged.meshes[0].pages.len() > 8);
    for (mesh, primitive) in paged.meshes.iter().zip(&file.primitives) {
        let hierarchy = &primitive.hierarchy;
        assert_eq!(mesh.mesh_index, primitive.mesh_index);
        assert_eq!(mesh.name, primitive.name);
        assert_eq!(mesh.graph.groups, hierarchy.groups);
        assert_eq!(mesh.graph.finer, hierarchy.finer);
        let mut found = vec![false; hierarchy.units.len()];
        for page in 0..mesh.pages.len() {
            let read = read_page(mesh, page, &bytes).unwrap();
            for (&group, read_group) in mesh.groups_of(page).iter().zip(&read.groups) {
                assert_eq!(mesh.page_of(group), page as u32);
                let units = hierarchy.groups[group as usize].units();
                for (unit, read_unit) in units.zip(read_group.units()) {
                    assert_eq!(triangles(&read, read_unit), triangles(hierarchy, unit));
                    assert_eq!(read.units[read_unit].aabb, hierarchy.units[unit].aabb);
                    assert!(!std::mem::replace(&mut found[unit], true));
                }
            }
        }
        assert!(found.iter().all(|found| *found));
    }
}

/// Only the first page may mix levels.
#[test]
fn first_page_holds_the_coarsest_cut() {
    let bytes = PagedFile::to_bytes(&file(), small_pages(Precision::Lossless));
    for mesh in PagedFile::from_contents(&bytes).unwrap().meshes {
        let mut coarsest = vec![false; mesh.graph.groups.len()];
        mesh.graph.close_refinement(&mut coarsest);
        let first = mesh.groups_of(0);
        assert!(
            (0..coarsest.len()).all(|group| coarsest[group] == first.contains(&(group as u32)))
        );
        let level = |group: &u32| mesh.graph.groups[*group as usize].level;
        let mut before = u32::MAX;
        for page in 1..mesh.pages.len() {
            let groups = mesh.groups_of(page);
            assert!(groups.iter().all(|group| level(group) == level(&groups[0])));
            assert!(level(&groups[0]) <= before);
            before = level(&groups[0]);
        }
    }
}

/// A vertex has the same position in all pages that contain it.
#[test]
fn quantized_pages_have_no_cracks() {
    let hierarchy = fixtures::grid_pyramid(3);
    let exact = hierarchy.vertices.positions.clone();
    let file = file_of(hierarchy);
    let bytes = PagedFile::to_bytes(&file, small_pages(Precision::Quantized16));
    let again = PagedFile::to_bytes(&file, small_pages(Precision::Quantized16));
    assert!(bytes == again, "equal contents");
    let mesh = &PagedFile::from_contents(&bytes).unwrap().meshes[0];
    let mut read_places: HashMap<u32, Vec3> = HashMap::new();
    for page in 0..mesh.pages.len() {
        let read = read_page(mesh, page, &bytes).unwrap();
        for (&group, read_group) in mesh.groups_of(page).iter().zip(&read.groups) {
            let units = file.primitives[0].hierarchy.groups[group as usize].units();
            for (unit, read_unit) in units.zip(read_group.units()) {
                let source = &file.primitives[0].hierarchy;
                let vertices = source.vertices_of(&source.units[unit]);
                let read_vertices = read.vertices_of(&read.units[read_unit]);
                for (&vertex, &read_vertex) in vertices.iter().zip(read_vertices) {
                    let at = read.vertices.positions[read_vertex as usize];
                    assert_eq!(*read_places.entry(vertex).or_insert(at), at);
                    assert!(at.distance(exact[vertex as usize]) <= mesh.position_error_in_local());
                }
            }
        }
    }
}

#[test]
fn table_of_contents_is_read_without_pages() {
    let bytes = PagedFile::to_bytes(&file(), PageOptions::default());
    let end = PagedFile::contents_end(&bytes[..PagedFile::HEADER_BYTES]).unwrap();
    let paged = PagedFile::from_contents(&bytes[..end as usize]).unwrap();
    assert_eq!(paged.meshes[0].pages[0].bytes.start, end);
    let pages = paged.meshes.iter().flat_map(|mesh| &mesh.pages);
    let ends = pages.map(|page| page.bytes.end);
    assert_eq!(ends.max(), Some(bytes.len() as u64));
}

#[test]
fn rejects_broken_tables() {
    let bytes = PagedFile::to_bytes(&file(), PageOptions::default());
    let read = |bytes: &[u8]| PagedFile::from_contents(bytes).map(|_| ());
    assert_eq!(read(b"FLDLOD\r\n"), Err(FileError::NotFieldlod));
    let version = [&bytes[..8], &99u32.to_le_bytes(), &bytes[12..]].concat();
    assert_eq!(read(&version), Err(FileError::Version { found: 99 }));
    let end = PagedFile::contents_end(&bytes).unwrap() as usize;
    for cut in [10, end - 1] {
        let fault = read(&bytes[..cut]);
        assert!(matches!(fault, Err(FileError::Truncated { .. })));
    }
    // One bit in the table or in a page is flipped.
    let mesh = &PagedFile::from_contents(&bytes).unwrap().meshes[0];
    let mut random = Random::new(3);
    for _ in 0..200 {
        let mut broken = bytes.clone();
        let at = 32 + random.next_u64() as usize % (bytes.len() - 32);
        broken[at] ^= 1 << (random.next_u64() % 8);
        assert_eq!(read(&broken).is_err(), at < end);
        for page in 0..mesh.pages.len() {
            if mesh.pages[page].bytes.contains(&(at as u64)) {
                let fault = read_page(mesh, page, &broken);
                assert!(matches!(fault, Err(FileError::Checksum)));
            }
        }
    }
    // The bytes belong to another page.
    let first = mesh.pages[0].bytes.clone();
    let other = mesh.read_page(1, &bytes[first.start as usize..first.end as usize]);
    assert_eq!(other, Err(FileError::Checksum));
}

/// Offset of the last occurrence of `part`.
fn last(bytes: &[u8], part: &[u8]) -> usize {
    bytes
        .windows(part.len())
        .rposition(|window| window == part)
        .unwrap()
}

#[test]
fn rejects_bytes_after_a_table_and_other_first_pages() {
    // One page per group: group 1 is terminal. The last column of the table lists the groups by page.
    let options = PageOptions {
        page_bytes: 1,
        ..small_pages(Precision::Lossless)
    };
    let bytes = PagedFile::to_bytes(&file_of(fixtures::two_level_strip()), options);
    let end = PagedFile::contents_end(&bytes).unwrap() as usize;
    let groups = last(&bytes[..end], &[1, 1, 0]);
    let fault_with = |at: usize, new: &[u8]| {
        let mut bytes = bytes.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        seal(&mut bytes, end);
        PagedFile::from_contents(&bytes).unwrap_err()
    };
    let fault = fault_with(groups, &[1, 0, 1]);
    assert_eq!(fault, FileError::Corrupt { what: "the pages" });
    let mut longer = bytes.clone();
    longer.splice(end..end, [0, 7]);
    let rest = (end - groups - 3) as u64;
    assert_eq!(rest, 0, "the table is not padded");
    let table = (end - 32) as u64 + 2;
    longer[16..24].copy_from_slice(&table.to_le_bytes());
    // The length of the rest follows the entries of two pages.
    let length = 32 + 12 + 8 + 3 + 20 + 4 + 2 * 16;
    let old = u64::from_le_bytes(longer[length..length + 8].try_into().unwrap());
    assert_eq!(length + 8 + old as usize, end);
    longer[length..length + 8].copy_from_slice(&(old + 2).to_le_bytes());
    seal(&mut longer, end + 2);
    let fault = PagedFile::from_contents(&longer).unwrap_err();
    assert_eq!(
        fault,
        FileError::Corrupt {
            what: "the table of contents"
        }
    );
}

proptest! {
    /// A malformed table with a matching checksum gives errors, but no panic.
    #[test]
    fn malformed_tables_do_not_panic(changes in prop::collection::vec((0usize..4096, any::<u8>()), 1..8)) {
        static FILE: LazyLock<Vec<u8>> =
            LazyLock::new(|| PagedFile::to_bytes(&file(), small_pages(Precision::Lossless)));
        let mut bytes = FILE.clone();
        let end = PagedFile::contents_end(&bytes).unwrap() as usize;
        for (at, value) in changes {
            bytes[32 + at % (end - 32)] = value;
        }
        seal(&mut bytes, end);
        read_all(&bytes);
    }

    /// A malformed page with a matching checksum gives errors, but no panic.
    #[test]
    fn malformed_pages_do_not_panic(
        changes in prop::collection::vec((any::<usize>(), any::<u8>()), 1..8),
        page in any::<usize>(),
        is_quantized: bool,
    ) {
        static FILES: LazyLock<[Vec<u8>; 2]> = LazyLock::new(|| {
            [Precision::Lossless, Precision::Quantized16]
                .map(|precision| PagedFile::to_bytes(&file(), small_pages(precision)))
        });
        let mut bytes = FILES[usize::from(is_quantized)].clone();
        let end = PagedFile::contents_end(&bytes).unwrap() as usize;
        let paged = PagedFile::from_contents(&bytes).unwrap();
        let mesh = &paged.meshes[0];
        let range = &mesh.pages[page % mesh.pages.len()].bytes;
        let range = range.start as usize..range.end as usize;
        let before = xxh3_64(&bytes[range.clone()]).to_le_bytes();
        for (at, value) in changes {
            bytes[range.start + at % range.len()] = value;
        }
        let after = xxh3_64(&bytes[range]).to_le_bytes();
        let places = bytes[..end].windows(8).filter(|window| **window == before);
        prop_assert_eq!(places.count(), 1);
        let place = bytes.windows(8).position(|window| *window == before).unwrap();
        bytes[place..place + 8].copy_from_slice(&after);
        seal(&mut bytes, end);
        read_all(&bytes);
    }
}

/// Updates the checksum of a table that ends at `end`.
fn seal(bytes: &mut [u8], end: usize) {
    let count = u32::from_le_bytes(bytes[12..16].try_into().unwrap());
    let checksum = xxh3_64_with_seed(&bytes[32..end], u64::from(count));
    bytes[24..32].copy_from_slice(&checksum.to_le_bytes());
}

/// Reads all pages and the triangles of all valid ones.
fn read_all(bytes: &[u8]) {
    let Ok(paged) = PagedFile::from_contents(bytes) else {
        return;
    };
    for mesh in &paged.meshes {
        for (number, page) in mesh.pages.iter().enumerate() {
            let range = page.bytes.start as usize..page.bytes.end as usize;
            let page = bytes.get(range).map(|page| mesh.read_page(number, page));
            if let Some(Ok(page)) = page {
                for unit in 0..page.units.len() {
                    triangles(&page, unit);
                }
            }
        }
    }
}
