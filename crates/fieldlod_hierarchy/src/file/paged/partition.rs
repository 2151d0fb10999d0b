//! Divides a hierarchy into pages and encodes them.

use std::collections::HashMap;
use std::ops::Range;

use glam::Vec3;

use super::{Page, PageOptions, PagedMesh};
use crate::file::contents::BakedPrimitive;
use crate::file::encode::{self, Prepared};
use crate::file::layout::SectionEntry;
use crate::file::vertices::attribute_columns::Columns;
use crate::file::vertices::attributes::Attributes;
use crate::hierarchy::{Group, Hierarchy, NO_GROUP, Unit};

/// Bits of each coordinate in the Z-order key of a group: the most that fit into 32 bits.
const AXIS_BITS: u32 = 10;

/// Returns the table of contents of a mesh and its encoded pages.
pub(super) fn encode(
    primitive: &BakedPrimitive,
    options: PageOptions,
) -> (PagedMesh, Vec<Vec<u8>>) {
    // Pages always hold their vertices: no source mesh is loaded beside a streamed file.
    let prepared = encode::prepare(primitive, options.precision);
    let hierarchy = prepared.hierarchy();
    // Meshes on the GPU have an exact number for each column, also if the file is quantized.
    let planes = Attributes::of(&hierarchy.vertices).planes(false);
    let vertex_bytes = planes.len() as u64 * 4;
    let mut groups: Vec<u32> = Vec::new();
    let mut pages = Vec::new();
    for mut page in partition(hierarchy, vertex_bytes, u64::from(options.page_bytes)) {
        page.sort_unstable();
        let first = groups.len() as u32;
        groups.extend(page);
        pages.push(first..groups.len() as u32);
    }
    let (pages, sections): (Vec<Page>, Vec<Vec<u8>>) = pages
        .into_iter()
        .map(|range| encode_page(&prepared, &groups, range, vertex_bytes))
        .unzip();
    let entries = pages.iter().map(|page| page.section);
    let entry = prepared.entry(primitive, entries.collect());
    (
        PagedMesh {
            mesh_index: primitive.mesh_index,
            primitive_index: primitive.primitive_index,
            name: primitive.name.clone(),
            graph: without_geometry(hierarchy),
            pages,
            page_of: Vec::new(),
            groups,
            entry,
        },
        sections,
    )
}

/// The groups of each page: first the groups of the coarsest cut, then level by level.
fn partition(hierarchy: &Hierarchy, vertex_bytes: u64, page_bytes: u64) -> Vec<Vec<u32>> {
    let indices = || 0..hierarchy.groups.len() as u32;
    let mut pages = vec![
        indices()
            .filter(|&group| hierarchy.groups[group as usize].is_terminal())
            .collect(),
    ];
    let order = ZOrder::of(hierarchy);
    for level in (0..hierarchy.level_count()).rev() {
        let of_level = |&group: &u32| {
            let group = &hierarchy.groups[group as usize];
            !group.is_terminal() && group.level == level
        };
        let mut groups: Vec<u32> = indices().filter(of_level).collect();
        groups.sort_by_cached_key(|&group| order.key(&hierarchy.groups[group as usize]));
        let bytes = |group: &u32| {
            let units = &hierarchy.units[hierarchy.groups[*group as usize].units()];
            units
                .iter()
                .map(|unit| mesh_bytes(unit, vertex_bytes))
                .sum::<u64>()
        };
        // All pages of a level have about the same size. Filling them one after the other would leave a last page of a
        // few groups, which costs a whole read.
        let total: u64 = groups.iter().map(bytes).sum();
        let count = total.div_ceil(page_bytes.max(1)).max(1);
        let mut so_far = 0;
        let page_of = |group: &u32| {
            so_far += bytes(group);
            (so_far - 1) * count / total.max(1)
        };
        let numbers: Vec<u64> = groups.iter().map(page_of).collect();
        let of_pages = numbers.chunk_by(|a, b| a == b);
        let mut left = groups.into_iter();
        pages.extend(of_pages.map(|page| left.by_ref().take(page.len()).collect::<Vec<u32>>()));
    }
    pages
}

/// Size of the mesh of a unit on the GPU.
fn mesh_bytes(unit: &Unit, vertex_bytes: u64) -> u64 {
    u64::from(unit.vertex_count) * vertex_bytes + u64::from(unit.triangle_count) * 6
}

/// Orders groups along a space-filling curve, so that neighbours share pages.
struct ZOrder {
    min: Vec3,
    size: Vec3,
}

impl ZOrder {
    fn of(hierarchy: &Hierarchy) -> Self {
        let aabb = hierarchy.aabb().unwrap_or_default();
        let size = (aabb.max - aabb.min).max(Vec3::splat(f32::MIN_POSITIVE));
        Self {
            min: aabb.min,
            size,
        }
    }

    /// Interleaves the bits of the three coordinates of the centre of a group.
    fn key(&self, group: &Group) -> u32 {
        let last = ((1 << AXIS_BITS) - 1) as f32;
        // A conversion to integers maps NaN and negative numbers to 0, so a centre outside the box is harmless.
        let cell = ((group.bounds.center - self.min) / self.size * last).as_uvec3();
        let bits = (0..AXIS_BITS).rev().flat_map(|bit| {
            cell.to_array()
                .map(|along| along.min(last as u32) >> bit & 1)
        });
        bits.fold(0, |key, bit| key << 1 | bit)
    }
}

fn encode_page(
    prepared: &Prepared,
    groups: &[u32],
    range: Range<u32>,
    vertex_bytes: u64,
) -> (Page, Vec<u8>) {
    let groups_of_page = &groups[range.start as usize..range.end as usize];
    let (page, columns) = page_hierarchy(prepared, groups_of_page);
    let section = prepared.page(&page, &columns);
    let units = page.units.iter();
    (
        Page {
            bytes: 0..section.len() as u64,
            mesh_bytes: units
                .map(|unit| mesh_bytes(unit, vertex_bytes))
                .sum::<u64>() as u32,
            groups: range,
            vertex_count: page.vertices.positions.len() as u32,
            section: SectionEntry::of(&section),
        },
        section,
    )
}

/// Copies groups into a hierarchy without links. Also returns the columns of its vertices.
fn page_hierarchy(prepared: &Prepared, groups: &[u32]) -> (Hierarchy, Columns) {
    let from = prepared.hierarchy();
    let mut page = Hierarchy::default();
    let mut columns = Columns::new(prepared.columns.columns.len());
    // The index in the page of each vertex.
    let mut indices: HashMap<u32, u32> = HashMap::new();
    for &group in groups {
        let group = &from.groups[group as usize];
        for unit in &from.units[group.units()] {
            let vertices = from.vertices_of(unit).iter().map(|&vertex| {
                let next = indices.len() as u32;
                *indices.entry(vertex).or_insert_with(|| {
                    columns.push_from(&prepared.columns, vertex);
                    next
                })
            });
            let vertices: Vec<u32> = vertices.collect();
            page.push_unit(
                NO_GROUP,
                unit.aabb,
                vertices,
                from.indices_of(unit).iter().copied(),
            );
        }
        // All groups are terminal, so the page is a valid hierarchy without the groups of other pages.
        page.push_group(
            Group {
                bounds: group.bounds,
                error_in_local: f32::INFINITY,
                deviation_in_local: f32::INFINITY,
                ..Group::default()
            },
            [],
        );
    }
    // The encoder takes vertices from the columns; it reads only the number of positions.
    page.vertices.positions = vec![Vec3::ZERO; indices.len()];
    page.source_vertex_count = indices.len() as u32;
    (page, columns)
}

/// Copies groups, units and links only.
fn without_geometry(hierarchy: &Hierarchy) -> Hierarchy {
    let unit = |unit: &Unit| Unit {
        aabb: crate::bounds::Aabb::default(),
        first_vertex: 0,
        first_triangle: 0,
        ..*unit
    };
    Hierarchy {
        source: hierarchy.source,
        carrier_joint: hierarchy.carrier_joint,
        groups: hierarchy.groups.clone(),
        finer: hierarchy.finer.clone(),
        units: hierarchy.units.iter().map(unit).collect(),
        ..Hierarchy::default()
    }
}
