//! Several meshes that are one object, such as the bark and the leaves of a tree: one bake over all of them,
//! and of its levels to each mesh what is its.
//!
//! Each by itself would be as good as it promises, though leaves hide the bark and bark stands for leaves: at
//! one quality two meshes draw 1.4 to 6.4 times the triangles of one. So levels are simplified, set right and
//! looked at as one mesh. All meshes then have groups of the same sphere, the same errors and the same facing, and
//! change their levels together wherever they are drawn at one place.

use std::ops::Range;

use fieldlod_hierarchy::{Cards, Group, Hierarchy, Sphere, Vertices};
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::bake::{bake_mesh_with_progress, bake_valid_mesh};
use crate::config::BakeConfig;
use crate::deviation::deviation_in_local;
use crate::mesh::surfaces::Surfaces;
use crate::mesh::{MeshError, SourceMesh};
use crate::plants::aggregate::is_aggregate;
use crate::plants::appearance::MOST_VERTICES;
use crate::report::BakeReport;

/// No more meshes than this are taken for one plant.
pub const MOST_TOGETHER: usize = 4;
/// Each mesh is this share of the largest coordinate apart from the next, two steps of 32 bits at most there: the
/// simplifier takes vertices at one place for the same.
const APART: f32 = 1.0 / (1 << 22) as f32;

/// Bakes meshes that are one object, in the order given: plants and other loose pieces together, anything else each by
/// itself.
///
/// Together means with one bake over all, so that they change levels together and only as a whole: each
/// hierarchy has one unit for each level. That is done for two to [`MOST_TOGETHER`] meshes, of which a quarter of the
/// triangles is that of six or more loose pieces such as leaves, none of them more than a fifth, that have fewer than
/// [`BakeConfig::together_below_triangles`] triangles and no more than 65,536 vertices in all, and normals or none; and
/// only if all of them are valid. Their reports are then of that one bake, groups in it too, but for their own coarsest
/// triangles.
///
/// # Errors
/// For each mesh, as [`bake_mesh`](crate::bake_mesh).
#[must_use]
pub fn bake_together(
    meshes: &[&SourceMesh],
    config: &BakeConfig,
) -> Vec<Result<(Hierarchy, BakeReport), MeshError>> {
    bake_together_with_progress(meshes, config, &|_, _| ())
}

/// [`bake_together`] with progress: `on_triangles` is told of which mesh how many triangles each group consumed;
/// of meshes that are baked together, the first.
pub(crate) fn bake_together_with_progress(
    meshes: &[&SourceMesh],
    config: &BakeConfig,
    on_triangles: &(dyn Fn(usize, usize) + Sync),
) -> Vec<Result<(Hierarchy, BakeReport), MeshError>> {
    let as_one = || bake_as_one(meshes, config, &|count| on_triangles(0, count));
    if let Some(baked) = belong_together(meshes, config).then(as_one).flatten() {
        return baked.into_iter().map(Ok).collect();
    }
    let by_itself = |(index, mesh): (usize, &&SourceMesh)| {
        bake_mesh_with_progress(mesh, config, &|count| on_triangles(index, count))
    };
    meshes.par_iter().enumerate().map(by_itself).collect()
}

fn belong_together(meshes: &[&SourceMesh], config: &BakeConfig) -> bool {
    let sum =
        |count: fn(&SourceMesh) -> usize| meshes.iter().map(|mesh| count(mesh)).sum::<usize>();
    let is_small = sum(SourceMesh::triangle_count) < config.together_below_triangles
        && sum(|mesh| mesh.positions.len()) <= MOST_VERTICES as usize;
    let with_normals = meshes.iter().filter(|mesh| !mesh.normals.is_empty());
    (2..=MOST_TOGETHER).contains(&meshes.len())
        && is_small
        && [0, meshes.len()].contains(&with_normals.count())
        && config.validate().is_ok()
        && meshes.iter().all(|mesh| mesh.validate().is_ok())
        && is_aggregate(&as_one_mesh(meshes))
}

/// The vertices of each mesh among those of all.
fn ranges_of(meshes: &[&SourceMesh]) -> Vec<Range<usize>> {
    let ends = meshes.iter().scan(0, |end, mesh| {
        let first = *end;
        *end += mesh.positions.len();
        Some(first..*end)
    });
    ends.collect()
}

/// The meshes in one, with neutral values for attributes that some have and others have not.
fn as_one_mesh(meshes: &[&SourceMesh]) -> SourceMesh {
    let mut all = SourceMesh {
        // So that the bake tells where moved vertices come from.
        has_other_attributes: true,
        ..SourceMesh::default()
    };
    let positions = meshes.iter().flat_map(|mesh| &mesh.positions);
    let extent = positions.fold(0.0, |most: f32, p| most.max(p.abs().max_element()));
    for (index, mesh) in meshes.iter().enumerate() {
        let first = all.positions.len() as u32;
        let apart = Vec3::X * (extent * APART * index as f32);
        all.positions
            .extend(mesh.positions.iter().map(|p| *p + apart));
        all.indices
            .extend(mesh.indices.iter().map(|index| first + index));
    }
    all.normals = in_turn(meshes, |mesh| &mesh.normals, Default::default());
    all.uvs = in_turn(meshes, |mesh| &mesh.uvs, Default::default());
    all.tangents = in_turn(meshes, |mesh| &mesh.tangents, Vec4::X + Vec4::W);
    all.uvs_1 = in_turn(meshes, |mesh| &mesh.uvs_1, Default::default());
    all.colors = in_turn(meshes, |mesh| &mesh.colors, Vec4::ONE);
    all
}

/// An attribute of all vertices, or of none if no mesh has it.
fn in_turn<V: Copy>(
    meshes: &[&SourceMesh],
    attribute: impl Fn(&SourceMesh) -> &Vec<V>,
    neutral: V,
) -> Vec<V> {
    if meshes.iter().all(|mesh| attribute(mesh).is_empty()) {
        return Vec::new();
    }
    let of_mesh = |mesh: &&SourceMesh| {
        let mut values = attribute(mesh).clone();
        values.resize(mesh.positions.len(), neutral);
        values
    };
    meshes.iter().flat_map(of_mesh).collect()
}

/// `None` if a level needs wider indices.
fn bake_as_one(
    meshes: &[&SourceMesh],
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> Option<Vec<(Hierarchy, BakeReport)>> {
    let ranges = ranges_of(meshes);
    let baked = bake_valid_mesh(
        &as_one_mesh(meshes),
        Surfaces::of(meshes.iter().copied()),
        config,
        on_triangles,
    );
    let mut whole = baked.hierarchy.whole_mesh_levels()?;
    face_alike(&mut whole);
    let parts = meshes.iter().zip(ranges);
    let parts: Vec<Part<'_>> = parts
        .map(|(mesh, range)| Part::of(mesh, range, &whole))
        .collect();
    // As good as it is by that of the meshes which is worst.
    let deviations = deviations(&parts, &whole, config);
    let cards = baked.cards.into_iter().chain(std::iter::repeat(None));
    let hierarchies = parts.into_iter().zip(cards);
    let hierarchies = hierarchies.map(|(part, cards)| part.hierarchy(&whole, &deviations, cards));
    let mut hierarchies: Vec<Hierarchy> = hierarchies.collect::<Option<_>>()?;
    bound_cards(&mut hierarchies);
    let with_report = |hierarchy: Hierarchy| {
        let report = BakeReport {
            coarsest_triangles: hierarchy.units.last()?.triangle_count as usize,
            ..baked.report.clone()
        };
        debug_assert_eq!(hierarchy.validate(), Ok(()));
        Some((hierarchy, report))
    };
    hierarchies.into_iter().map(with_report).collect()
}

/// Lets all levels face as the source does: meshes that leave out different ones would not go by the same else.
fn face_alike(whole: &mut Hierarchy) {
    let facing = whole.groups.first().map(|group| group.mean_normal);
    for group in &mut whole.groups {
        group.mean_normal = facing.unwrap_or_default();
    }
}

/// Lets the sphere of all levels be around what is drawn as cards, too: all meshes have the same.
fn bound_cards(meshes: &mut [Hierarchy]) {
    let with_cards = meshes.iter().filter(|mesh| mesh.cards.is_some());
    let cards = with_cards.filter_map(|mesh| mesh.whole_mesh_levels()?.cards);
    let levels = cards.flat_map(|cards| cards.levels);
    let corners: Vec<Vec3> = levels
        .flat_map(|level| level.cards.into_iter().flat_map(|card| card.corners()))
        .collect();
    for group in meshes.iter_mut().flat_map(|mesh| &mut mesh.groups) {
        let Sphere { center, radius } = &mut group.bounds;
        let distances = corners.iter().map(|corner| corner.distance(*center));
        *radius = distances.fold(*radius, f32::max);
    }
}

/// For each level of the whole, how far the meshes stray from their sources at it or at a finer one.
fn deviations(parts: &[Part<'_>], whole: &Hierarchy, config: &BakeConfig) -> Vec<f32> {
    let mut deviations = vec![0.0f32; whole.groups.len()];
    if !config.measure_deviation {
        deviations.fill(f32::INFINITY);
        return deviations;
    }
    let of_parts: Vec<Vec<f32>> = parts
        .par_iter()
        .map(|part| {
            let levels = part.levels.iter().skip(1);
            let levels: Vec<&[[u32; 3]]> = levels.map(|(_, triangles)| &**triangles).collect();
            deviation_in_local(part.mesh, &part.vertices.positions, &levels, config)
        })
        .collect();
    for (part, of_part) in parts.iter().zip(of_parts) {
        for ((level, _), deviation) in part.levels.iter().skip(1).zip(of_part) {
            deviations[*level] = deviations[*level].max(deviation);
        }
    }
    for level in 1..deviations.len() {
        deviations[level] = deviations[level].max(deviations[level - 1]);
    }
    deviations
}

/// What is one mesh's of the levels of all.
struct Part<'a> {
    mesh: &'a SourceMesh,
    /// Where the whole has its vertices, by bits, and where the mesh has them.
    own_positions: FxHashMap<[u32; 3], Vec3>,
    vertices: Vertices,
    moved_from: Vec<u32>,
    /// Its own levels, finest first: which level of the whole each is, and its triangles.
    levels: Vec<(usize, Vec<[u32; 3]>)>,
}

impl<'a> Part<'a> {
    /// Of the mesh whose vertices are `range` of the whole's.
    fn of(mesh: &'a SourceMesh, range: Range<usize>, whole: &Hierarchy) -> Self {
        let of_whole = whole.vertices.positions[range.clone()].iter();
        let mut part = Self {
            mesh,
            own_positions: of_whole
                .map(bits)
                .zip(mesh.positions.iter().copied())
                .collect(),
            vertices: mesh.vertices(),
            moved_from: Vec::new(),
            levels: Vec::new(),
        };
        let is_own = |vertex: u32| range.contains(&(whole.origin_of(vertex).unwrap_or(0) as usize));
        // A simplifier that merges vertices at one place may have made a triangle of two meshes'.
        let is_mostly_own =
            |triangle: &[u32; 3]| triangle.iter().filter(|v| is_own(**v)).count() > 1;
        let mut own_of = FxHashMap::default();
        for (level, unit) in whole.units.iter().enumerate() {
            let triangles: Vec<[u32; 3]> = whole.triangles_of(unit).filter(is_mostly_own).collect();
            // What vanishes altogether stays as it was last.
            if level == 0 || !triangles.is_empty() {
                let mut own = |vertex: u32| {
                    *own_of
                        .entry(vertex)
                        .or_insert_with(|| part.vertex(vertex, &range, whole))
                };
                let triangles = triangles.iter().map(|triangle| triangle.map(&mut own));
                let triangles = triangles.collect();
                part.levels.push((level, triangles));
            }
        }
        part
    }

    /// A vertex of the whole among the part's own, to which it is added if it is not of its source.
    fn vertex(&mut self, vertex: u32, range: &Range<usize>, whole: &Hierarchy) -> u32 {
        if range.contains(&(vertex as usize)) {
            return vertex - range.start as u32;
        }
        let from = &whole.vertices;
        let own = self.vertices.positions.len() as u32;
        // What stayed at its place is exactly where the mesh has it: else there would be cracks.
        let position = &from.positions[vertex as usize];
        let own_position = self.own_positions.get(&bits(position));
        self.vertices
            .positions
            .push(*own_position.unwrap_or(position));
        push_if_held(&mut self.vertices.normals, &from.normals, vertex);
        push_if_held(&mut self.vertices.uvs, &from.uvs, vertex);
        push_if_held(&mut self.vertices.tangents, &from.tangents, vertex);
        push_if_held(&mut self.vertices.uvs_1, &from.uvs_1, vertex);
        push_if_held(&mut self.vertices.colors, &from.colors, vertex);
        let origin = whole.origin_of(vertex).unwrap_or(0) as usize;
        let is_own = range.contains(&origin);
        self.moved_from.push(if is_own {
            (origin - range.start) as u32
        } else {
            0
        });
        own
    }

    fn hierarchy(
        self,
        whole: &Hierarchy,
        deviations: &[f32],
        cards: Option<Cards>,
    ) -> Option<Hierarchy> {
        let mut own = Hierarchy {
            source: self.mesh.source_hash(),
            source_vertex_count: self.mesh.positions.len() as u32,
            vertices: self.vertices,
            moved_from: self.moved_from,
            cards,
            ..Hierarchy::default()
        };
        if !self.mesh.has_other_attributes {
            own.moved_from.clear();
        }
        for (index, (level, triangles)) in self.levels.iter().enumerate() {
            let next = self.levels.get(index + 1).map(|(next, _)| *next);
            let group = Group {
                error_in_local: next.map_or(f32::INFINITY, |n| whole.groups[n - 1].error_in_local),
                deviation_in_local: next.map_or(f32::INFINITY, |next| deviations[next]),
                ..whole.groups[*level]
            };
            own.push_whole_mesh(triangles, group)?;
        }
        Some(own)
    }
}

fn bits(position: &Vec3) -> [u32; 3] {
    position.to_array().map(f32::to_bits)
}

/// Adds the value of a vertex, unless the mesh does not have the attribute.
fn push_if_held<V: Copy>(own: &mut Vec<V>, all: &[V], vertex: u32) {
    if let (false, Some(&value)) = (own.is_empty(), all.get(vertex as usize)) {
        own.push(value);
    }
}
