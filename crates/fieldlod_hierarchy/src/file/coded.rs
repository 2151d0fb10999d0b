//! A hierarchy in the order in which it is coded: coarsest level first, vertices in the order of
//! their first use.

use super::attributes::{self, Attributes};
use super::planes::Rows;
use super::quantize::Grids;
use super::section::{Ends, Section};
use super::{FileError, Precision};
use crate::{Cluster, Group, Hierarchy, NO_GROUP, SourceHash, Unit, Vertices};

/// The arrays of a hierarchy, in the order of its sections. Where ranges start is not kept, and
/// units and clusters of a section follow each other like its groups.
#[derive(Debug, Default)]
pub(super) struct Coded {
    /// Where each group stands in the hierarchy.
    pub(super) group_indices: Vec<u32>,
    pub(super) groups: Vec<Group>,
    pub(super) finer: Vec<u32>,
    pub(super) units: Vec<Unit>,
    pub(super) clusters: Vec<Cluster>,
    /// By the order in which vertices are coded.
    pub(super) unit_vertices: Vec<u32>,
    pub(super) indices: Vec<u16>,
    /// Where each vertex stands in the source.
    pub(super) source_vertices: Vec<u32>,
    /// Of the vertices in the order in which they are coded, after one of zeros.
    pub(super) rows: Rows,
}

impl Coded {
    /// With so many numbers for each vertex.
    pub(super) fn with_planes(count: usize) -> Self {
        Self {
            rows: Rows::zeros(count, 1),
            ..Self::default()
        }
    }

    /// Groups and where they stand, from the `first` on.
    pub(super) fn groups_since(&self, first: usize) -> impl Iterator<Item = (&Group, u32)> {
        let groups = self.groups[first..].iter();
        groups.zip(self.group_indices[first..].iter().copied())
    }
}

/// In which section a group is: the first holds those with nothing coarser above them, so that
/// what any number of first sections hold is all that some cut refines.
fn section_of(group: &Group, level_count: u32) -> usize {
    if group.is_terminal() {
        0
    } else {
        (level_count - 1 - group.level) as usize
    }
}

/// The sections of a hierarchy whose vertices have these `source_rows`, and how many vertices
/// no unit uses.
pub(super) fn encode(
    hierarchy: &Hierarchy,
    source_rows: &Rows,
    attributes: Attributes,
    precision: Precision,
) -> (Vec<Vec<u8>>, usize) {
    let predictors = attributes.predictors(precision == Precision::Quantized16);
    let mut coder = Coder {
        hierarchy,
        source_rows,
        coded: Coded::with_planes(source_rows.width),
        codes: vec![u32::MAX; hierarchy.vertices.positions.len()],
    };
    let level_count = hierarchy.level_count();
    let section_count = level_count.max(1) as usize;
    let mut by_section = vec![Vec::new(); section_count];
    for (index, group) in hierarchy.groups.iter().enumerate() {
        by_section[section_of(group, level_count)].push(index as u32);
    }
    let mut sections = Vec::new();
    let mut unused = 0;
    for (number, groups) in by_section.into_iter().enumerate() {
        let from = Ends::of(&coder.coded);
        for group in groups {
            coder.add_group(group);
        }
        if number + 1 == section_count {
            unused = coder.add_unused();
        }
        let section = Section {
            predictors: &predictors,
            unused_vertices: unused,
        };
        sections.push(section.write(&coder.coded, from));
    }
    (sections, unused)
}

struct Coder<'a> {
    hierarchy: &'a Hierarchy,
    source_rows: &'a Rows,
    coded: Coded,
    /// By source vertex: its place in the order of coding, if it has one yet.
    codes: Vec<u32>,
}

impl Coder<'_> {
    fn add_group(&mut self, index: u32) {
        let hierarchy = self.hierarchy;
        let group = &hierarchy.groups[index as usize];
        self.coded.group_indices.push(index);
        self.coded.groups.push(Group {
            first_finer: 0,
            first_unit: 0,
            ..*group
        });
        self.coded.finer.extend(hierarchy.finer_groups(group));
        for unit in &hierarchy.units[group.units()] {
            self.add_unit(index, unit);
        }
    }

    fn add_unit(&mut self, group: u32, unit: &Unit) {
        let hierarchy = self.hierarchy;
        self.coded.units.push(Unit {
            consumed_by: 0,
            produced_by: unit.producer().map_or(0, |producer| group - producer),
            first_vertex: 0,
            first_triangle: 0,
            first_cluster: 0,
            ..*unit
        });
        let clusters = hierarchy.clusters[unit.clusters()].iter();
        self.coded.clusters.extend(clusters.map(|cluster| Cluster {
            first_triangle: 0,
            ..*cluster
        }));
        for &vertex in hierarchy.vertices_of(unit) {
            let code = self.code_of(vertex);
            self.coded.unit_vertices.push(code);
        }
        self.coded.indices.extend(hierarchy.indices_of(unit));
    }

    fn code_of(&mut self, vertex: u32) -> u32 {
        let code = &mut self.codes[vertex as usize];
        if *code == u32::MAX {
            *code = self.coded.source_vertices.len() as u32;
            self.coded.source_vertices.push(vertex);
            self.coded.rows.push(self.source_rows.row(vertex));
        }
        *code
    }

    /// Adds the vertices that no unit uses; returns how many there are.
    fn add_unused(&mut self) -> usize {
        let before = self.coded.source_vertices.len();
        for vertex in 0..self.codes.len() as u32 {
            self.code_of(vertex);
        }
        self.coded.source_vertices.len() - before
    }
}

/// What a hierarchy is made of besides its sections.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame<'a> {
    pub(super) source: SourceHash,
    pub(super) attributes: Attributes,
    pub(super) grids: Option<&'a Grids>,
    /// Groups and vertices of the whole hierarchy, if all sections were read.
    pub(super) whole: Option<(usize, usize)>,
}

/// Puts a hierarchy together from the sections read.
pub(super) fn decode(coded: &Coded, frame: Frame<'_>) -> Result<Hierarchy, FileError> {
    let mut builder = Builder {
        coded,
        starts: Starts::of(coded),
        order: group_order(coded)?,
        hierarchy: Hierarchy {
            source: frame.source,
            ..Hierarchy::default()
        },
        source_vertices: None,
    };
    let vertex_count = coded.source_vertices.len();
    let places = match frame.whole {
        Some((groups, vertices)) => {
            check_count(groups, coded.groups.len(), "the groups")?;
            check_count(vertices, vertex_count, "the vertex order")?;
            builder.source_vertices = Some(&coded.source_vertices);
            inverse(&coded.source_vertices)?
        }
        // In the order of coding.
        None => (1..=vertex_count as u32).collect(),
    };
    builder.hierarchy.vertices = vertices(coded, frame, &places);
    builder.reserve();
    builder.add_groups();
    Ok(builder.hierarchy)
}

fn vertices(coded: &Coded, frame: Frame<'_>, places: &[u32]) -> Vertices {
    attributes::from_rows(&coded.rows, frame.attributes, frame.grids, places)
}

fn check_count(expected: usize, found: usize, what: &'static str) -> Result<(), FileError> {
    if expected == found {
        Ok(())
    } else {
        Err(FileError::Corrupt { what })
    }
}

/// The row of each source vertex: the first row is that of no vertex.
fn inverse(source_vertices: &[u32]) -> Result<Vec<u32>, FileError> {
    let what = "the vertex order";
    let mut places = vec![0; source_vertices.len()];
    for (code, &vertex) in source_vertices.iter().enumerate() {
        match places.get_mut(vertex as usize) {
            Some(place) if *place == 0 => *place = code as u32 + 1,
            _ => return Err(FileError::Corrupt { what }),
        }
    }
    Ok(places)
}

/// The places of the groups in `coded`, in the order of the hierarchy.
fn group_order(coded: &Coded) -> Result<Vec<u32>, FileError> {
    let indices = &coded.group_indices;
    let mut order: Vec<u32> = (0..indices.len() as u32).collect();
    order.sort_unstable_by_key(|&place| indices[place as usize]);
    let twice = |pair: &[u32]| indices[pair[0] as usize] == indices[pair[1] as usize];
    if order.windows(2).any(twice) {
        let what = "the groups";
        return Err(FileError::Corrupt { what });
    }
    Ok(order)
}

/// Where the ranges of each group, and of each unit, start in the arrays of a [`Coded`].
struct Starts {
    /// First finer link and first unit.
    groups: Vec<[usize; 2]>,
    /// First vertex, first triangle and first cluster.
    units: Vec<[usize; 3]>,
}

impl Starts {
    fn of(coded: &Coded) -> Self {
        let mut next = [0; 2];
        let groups = coded.groups.iter().map(|group| {
            let counts = [group.finer_count, group.unit_count];
            advance(&mut next, counts)
        });
        let groups = groups.collect();
        let mut next = [0; 3];
        let units = coded.units.iter().map(|unit| {
            let counts = [unit.vertex_count, unit.triangle_count, unit.cluster_count];
            advance(&mut next, counts)
        });
        let units = units.collect();
        Self { groups, units }
    }
}

fn advance<const N: usize>(next: &mut [usize; N], counts: [u32; N]) -> [usize; N] {
    let starts = *next;
    for (next, count) in next.iter_mut().zip(counts) {
        *next += count as usize;
    }
    starts
}

struct Builder<'a> {
    coded: &'a Coded,
    starts: Starts,
    /// Places of the groups in `coded`.
    order: Vec<u32>,
    hierarchy: Hierarchy,
    /// Numbers of the vertices by the order of coding; those of coding themselves without it.
    source_vertices: Option<&'a [u32]>,
}

impl Builder<'_> {
    /// Room for all that is to come.
    fn reserve(&mut self) {
        let (from, to) = (self.coded, &mut self.hierarchy);
        to.groups.reserve_exact(from.groups.len());
        to.finer.reserve_exact(from.finer.len());
        to.units.reserve_exact(from.units.len());
        to.clusters.reserve_exact(from.clusters.len());
        to.unit_vertices.reserve_exact(from.unit_vertices.len());
        to.indices.reserve_exact(from.indices.len());
    }

    fn add_groups(&mut self) {
        let order = std::mem::take(&mut self.order);
        let indices: Vec<u32> = order
            .iter()
            .map(|&place| self.coded.group_indices[place as usize])
            .collect();
        for (index, &place) in order.iter().enumerate() {
            self.add_group(index as u32, place as usize, &indices);
        }
    }

    fn add_group(&mut self, index: u32, place: usize, indices: &[u32]) {
        let mut group = self.coded.groups[place];
        let [first_finer, first_unit] = self.starts.groups[place];
        let links = &self.coded.finer[first_finer..][..group.finer_count as usize];
        // What was not read is left out: its units are the source geometry of what was.
        let read = links.iter().filter_map(|finer| position(indices, *finer));
        group.first_finer = self.hierarchy.finer.len() as u32;
        self.hierarchy.finer.extend(read);
        group.finer_count = self.hierarchy.finer.len() as u32 - group.first_finer;
        group.level = self.level_above(group.first_finer as usize);
        group.first_unit = self.hierarchy.units.len() as u32;
        self.hierarchy.groups.push(group);
        for unit in first_unit..first_unit + group.unit_count as usize {
            self.add_unit(index, unit, indices);
        }
    }

    /// The level of a group with the finer groups from `first_finer` on.
    fn level_above(&self, first_finer: usize) -> u32 {
        let finer = self.hierarchy.finer[first_finer..].iter();
        let levels = finer.filter_map(|&finer| self.hierarchy.groups.get(finer as usize));
        levels.map(|group| group.level + 1).max().unwrap_or(0)
    }

    fn add_unit(&mut self, group: u32, place: usize, indices: &[u32]) {
        let mut unit = self.coded.units[place];
        let [vertex, triangle, cluster] = self.starts.units[place];
        unit.consumed_by = group;
        unit.produced_by = position(indices, unit.produced_by).unwrap_or(NO_GROUP);
        let hierarchy = &mut self.hierarchy;
        unit.first_vertex = hierarchy.unit_vertices.len() as u32;
        unit.first_triangle = (hierarchy.indices.len() / 3) as u32;
        unit.first_cluster = hierarchy.clusters.len() as u32;
        let vertices = self.coded.unit_vertices[vertex..][..unit.vertex_count as usize].iter();
        match self.source_vertices {
            Some(source) => {
                let vertices = vertices.map(|&code| source[code as usize]);
                hierarchy.unit_vertices.extend(vertices);
            }
            None => hierarchy.unit_vertices.extend(vertices),
        }
        let indices = &self.coded.indices[triangle * 3..][..unit.triangle_count as usize * 3];
        hierarchy.indices.extend(indices);
        let mut first_triangle = unit.first_triangle;
        for cluster in &self.coded.clusters[cluster..][..unit.cluster_count as usize] {
            hierarchy.clusters.push(Cluster {
                first_triangle,
                ..*cluster
            });
            first_triangle = first_triangle.wrapping_add(cluster.triangle_count);
        }
        hierarchy.units.push(unit);
    }
}

/// Where a group index stands among those that were read.
fn position(indices: &[u32], index: u32) -> Option<u32> {
    let place = indices.binary_search(&index).ok()?;
    Some(place as u32)
}
