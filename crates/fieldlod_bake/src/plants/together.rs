//! Bakes several meshes of one object, such as the bark and the leaves of a tree, as one mesh.
//!
//! Leaves hide the bark. Two meshes that are baked separately draw 1.4 to 6.4 times the triangles of one mesh at equal
//! quality. All meshes of the object get the same spheres, errors and mean normals, and change levels together.

use std::collections::BTreeMap;
use std::ops::Range;

use fieldlod_hierarchy::{Group, Hierarchy, Vertices};
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::bake::{bake_mesh_with_progress, bake_valid_mesh};
use crate::config::BakeConfig;
use crate::deviation::deviation_in_local;
use crate::layers::Layers;
use crate::levels::neighbours::meeting_vertices;
use crate::levels::vertices::border_of;
use crate::mesh::components::{connect, find_first};
use crate::mesh::surfaces::Surfaces;
use crate::mesh::topology::Topology;
use crate::mesh::{MeshError, SourceMesh, bits};
use crate::plants::aggregate::loose_elements;
use crate::plants::appearance::MAX_VERTICES;
use crate::plants::kits::LooseElements;
use crate::progress::Progress;
use crate::report::BakeReport;

/// Maximum number of meshes in one plant.
const MOST_PRIMITIVES: usize = 4;
/// Offset between meshes, as a share of the largest coordinate: two to four steps of an `f32`. Without it, the
/// simplifier would weld vertices of two meshes at the same position.
const OFFSET: f32 = 1.0 / (1 << 22) as f32;

/// A mesh keeps its shared vertices at all levels only if they are at most this share of its triangles. Coarse levels
/// have about one triangle per kept vertex. The border vertices of a tile of 64 × 64 cells are 0.03 of its triangles.
/// The border vertices between the materials of a hard-edged scene are 0.15.
const MAX_KEPT_VERTICES: f32 = 0.05;

/// Bakes meshes of one object and returns the results in the same order. Plants are baked together, other meshes
/// separately.
///
/// Small meshes that all meet other meshes at open borders are also baked together, in any number. So are small meshes
/// that lie on others in thin layers, such as labels. Larger meshes keep the vertices where they meet, at all levels, if
/// these are at most a twentieth of the triangles.
///
/// Meshes that are baked together change levels together: each hierarchy has one unit per level. A plant consists of
/// two to four valid meshes with fewer than [`BakeConfig::together_below_triangles`] triangles and at most
/// 65,536 vertices in total. At least a quarter of the triangles belong to 24 or more loose elements such as leaves,
/// with mostly open borders. Elements that repeat in order are parts of a kit, not of a plant. All meshes or none must
/// have normals. Reports describe the common bake, except for the coarsest triangles.
///
/// # Errors
/// For each mesh, the errors of [`bake_mesh`](crate::bake_mesh).
#[must_use]
pub fn bake_together(
    meshes: &[&SourceMesh],
    config: &BakeConfig,
) -> Vec<Result<(Hierarchy, BakeReport), MeshError>> {
    let outer = vec![Vec::new(); meshes.len()];
    let own = shared_vertices(meshes);
    bake_together_with_progress(meshes, &own, &outer, config, &Progress::default())
}

/// [`bake_together`] for the primitives of one glTF mesh if some are drawn in units. The meshes are baked separately
/// and keep the vertices where they meet. Only if these are too many, the meshes change levels together.
///
/// # Errors
/// The errors of [`bake_together`].
#[must_use]
pub fn bake_adjacent(
    meshes: &[&SourceMesh],
    config: &BakeConfig,
) -> Vec<Result<(Hierarchy, BakeReport), MeshError>> {
    let own = shared_vertices(meshes);
    let outer = vec![Vec::new(); meshes.len()];
    let config = config_for_adjacent(meshes, &own, config);
    bake_together_with_progress(meshes, &own, &outer, &config, &Progress::default())
}

/// The vertices where the meshes meet each other; none if a mesh is invalid.
fn shared_vertices(meshes: &[&SourceMesh]) -> Vec<Vec<bool>> {
    if meshes.iter().all(|mesh| mesh.check_shape().is_ok()) {
        meeting_vertices(meshes, 0..)
    } else {
        vec![Vec::new(); meshes.len()]
    }
}

/// The configuration for the primitives of one glTF mesh if some are drawn in units. `own` are the vertices where they
/// meet each other.
pub(crate) fn config_for_adjacent(
    meshes: &[&SourceMesh],
    own: &[Vec<bool>],
    config: &BakeConfig,
) -> BakeConfig {
    // Primitives that cannot keep their shared vertices have cracks unless they change levels together.
    let mut pairs = meshes.iter().zip(own);
    BakeConfig {
        together_below_triangles: if pairs.all(|(mesh, own)| is_within_budget(own, mesh)) {
            0
        } else {
            config.together_below_triangles
        },
        ..config.clone()
    }
}

/// [`bake_together`] with progress.
///
/// `own` marks the vertices where the meshes meet each other, and `outer` those where they meet other objects. Within
/// [`MAX_KEPT_VERTICES`], separate meshes keep both at all levels, and joined meshes keep `outer`.
pub(crate) fn bake_together_with_progress(
    meshes: &[&SourceMesh],
    own: &[Vec<bool>],
    outer: &[Vec<bool>],
    config: &BakeConfig,
    progress: &Progress<'_>,
) -> Vec<Result<(Hierarchy, BakeReport), MeshError>> {
    let together = if can_bake_as_plant(meshes, config) {
        Some(Joint::Plant)
    } else {
        can_bake_as_surface(meshes, own, config).then_some(Joint::Surface)
    };
    let as_one = |joint| bake_joined(meshes, joint, &outer.concat(), config, progress);
    if let Some(baked) = together.and_then(as_one) {
        return baked.into_iter().map(Ok).collect();
    }
    let kept_of = |index: usize| -> Vec<bool> {
        let marks = [&own[index], &outer[index]];
        let is_kept = |vertex| marks.iter().any(|marks| marks.get(vertex) == Some(&true));
        (0..meshes[index].positions.len()).map(is_kept).collect()
    };
    let bake_separately = |index: usize| {
        let (mesh, kept) = (meshes[index], kept_of(index));
        let kept = kept_within_budget(&kept, mesh);
        bake_mesh_with_progress(mesh, kept, config, progress)
    };
    // A layer and the meshes behind it change levels together.
    let bake_layered = |set: &[usize]| {
        let of_set: Vec<&SourceMesh> = set.iter().map(|&index| meshes[index]).collect();
        let kept: Vec<Vec<bool>> = set.iter().map(|&index| kept_of(index)).collect();
        bake_joined(&of_set, Joint::Surface, &kept.concat(), config, progress)
    };
    let bake_set = |set: Vec<usize>| -> Vec<_> {
        let layered = (set.len() > 1).then(|| bake_layered(&set)).flatten();
        let baked: Vec<_> = match layered {
            Some(baked) => baked.into_iter().map(Ok).collect(),
            None => set
                .par_iter()
                .map(|&index| bake_separately(index))
                .collect(),
        };
        set.into_iter().zip(baked).collect()
    };
    let sets = layered_sets(meshes, config).into_par_iter();
    let mut baked: Vec<_> = sets.flat_map_iter(bake_set).collect();
    baked.sort_by_key(|(index, _)| *index);
    baked.into_iter().map(|(_, baked)| baked).collect()
}

/// The indices of meshes that lie on each other in thin layers, and those of single meshes. Both are in ascending order.
pub(crate) fn layered_sets(meshes: &[&SourceMesh], config: &BakeConfig) -> Vec<Vec<usize>> {
    let mut first: Vec<u32> = (0..meshes.len() as u32).collect();
    if meshes.len() > 1 && can_be_joined(meshes, config) {
        let joined = as_one_mesh(meshes, Joint::Surface);
        let ranges = ranges_of(meshes);
        let mesh_of = |vertex: u32| ranges.partition_point(|r| r.end <= vertex as usize) as u32;
        if let Some(found) = Layers::of_joined(&joined) {
            for (own, range) in (0..).zip(&ranges) {
                let on_others = found.mostly_on_others(&joined, range).into_iter();
                for behind in on_others.flat_map(|layer| &layer.behind) {
                    connect(&mut first, own, mesh_of(*behind));
                }
            }
        }
    }
    let mut sets: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for index in 0..meshes.len() {
        let own = find_first(&mut first, index as u32);
        sets.entry(own).or_default().push(index);
    }
    sets.into_values().collect()
}

/// The vertices to keep; none if there are too many, because coarse levels would consist of kept vertices.
fn kept_within_budget<'a>(kept: &'a [bool], mesh: &SourceMesh) -> &'a [bool] {
    if is_within_budget(kept, mesh) {
        kept
    } else {
        &[]
    }
}

fn is_within_budget(kept: &[bool], mesh: &SourceMesh) -> bool {
    let count = kept.iter().filter(|kept| **kept).count();
    count as f32 <= mesh.triangle_count() as f32 * MAX_KEPT_VERTICES
}

/// How meshes are joined.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Joint {
    /// Loose elements that are not joined where they touch.
    Plant,
    /// One surface of several materials that stays closed where they meet.
    Surface,
}

fn can_bake_as_plant(meshes: &[&SourceMesh], config: &BakeConfig) -> bool {
    (2..=MOST_PRIMITIVES).contains(&meshes.len())
        && can_be_joined(meshes, config)
        && is_plant(meshes)
}

/// Whether many elements are loose, and at least half of the borders stay open after welding. Patches of one surface
/// are loose as well, but welding closes their borders.
fn is_plant(meshes: &[&SourceMesh]) -> bool {
    let parts = Surfaces::of(meshes.iter().copied());
    let places = |mesh: &SourceMesh| Topology::of(mesh, &parts).place;
    let apart = as_one_mesh(meshes, Joint::Plant);
    let place = places(&apart);
    // Counts of open borders are compared on one index list, before and after welding.
    let open = |place: &[u32]| {
        let is_border = border_of(&apart.indices, place);
        is_border.into_iter().filter(|is_border| *is_border).count()
    };
    let welded = || places(&as_one_mesh(meshes, Joint::Surface));
    loose_elements(&apart, &place) == Some(LooseElements::OfPlant)
        && 2 * open(&welded()) >= open(&place)
}

/// Whether each mesh meets another one, and the meshes can be joined.
fn can_bake_as_surface(meshes: &[&SourceMesh], own: &[Vec<bool>], config: &BakeConfig) -> bool {
    meshes.len() > 1 && own.iter().all(|own| own.contains(&true)) && can_be_joined(meshes, config)
}

fn can_be_joined(meshes: &[&SourceMesh], config: &BakeConfig) -> bool {
    let sum =
        |count: fn(&SourceMesh) -> usize| meshes.iter().map(|mesh| count(mesh)).sum::<usize>();
    let is_small = sum(SourceMesh::triangle_count) < config.together_below_triangles
        && sum(|mesh| mesh.positions.len()) <= MAX_VERTICES as usize;
    let with_normals = meshes.iter().filter(|mesh| !mesh.normals.is_empty());
    is_small
        && [0, meshes.len()].contains(&with_normals.count())
        && config.validate().is_ok()
        && meshes.iter().all(|mesh| mesh.validate().is_ok())
}

/// Range of each mesh's vertices in the joined mesh.
fn ranges_of(meshes: &[&SourceMesh]) -> Vec<Range<usize>> {
    let ends = meshes.iter().scan(0, |end, mesh| {
        let first = *end;
        *end += mesh.positions.len();
        Some(first..*end)
    });
    ends.collect()
}

/// Joins the meshes. Meshes without an attribute get neutral values if another mesh has it.
pub(crate) fn as_one_mesh(meshes: &[&SourceMesh], joint: Joint) -> SourceMesh {
    let mut all = SourceMesh {
        // The bake then records the origin of moved vertices.
        has_other_attributes: true,
        ..SourceMesh::default()
    };
    let positions = meshes.iter().flat_map(|mesh| &mesh.positions);
    let extent = positions.fold(0.0, |most: f32, p| most.max(p.abs().max_element()));
    for (index, mesh) in meshes.iter().enumerate() {
        let first = all.positions.len() as u32;
        let apart = match joint {
            Joint::Plant => Vec3::X * (extent * OFFSET * index as f32),
            Joint::Surface => Vec3::ZERO,
        };
        all.positions
            .extend(mesh.positions.iter().map(|p| *p + apart));
        all.indices
            .extend(mesh.indices.iter().map(|index| first + index));
    }
    all.normals = concatenated(meshes, |mesh| &mesh.normals, Default::default());
    all.uvs = concatenated(meshes, |mesh| &mesh.uvs, Default::default());
    all.tangents = concatenated(meshes, |mesh| &mesh.tangents, Vec4::X + Vec4::W);
    all.uvs_1 = concatenated(meshes, |mesh| &mesh.uvs_1, Default::default());
    all.colors = concatenated(meshes, |mesh| &mesh.colors, Vec4::ONE);
    all
}

/// Concatenates an attribute; empty if no mesh has it.
fn concatenated<V: Copy>(
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

/// Bakes the joined meshes. Returns `None` if a level needs 32-bit indices.
fn bake_joined(
    meshes: &[&SourceMesh],
    joint: Joint,
    kept: &[bool],
    config: &BakeConfig,
    progress: &Progress<'_>,
) -> Option<Vec<(Hierarchy, BakeReport)>> {
    let ranges = ranges_of(meshes);
    let joined = as_one_mesh(meshes, joint);
    let (hierarchy, report) = bake_valid_mesh(
        &joined,
        Surfaces::of(meshes.iter().copied()),
        kept_within_budget(kept, &joined),
        config,
        progress,
    );
    let mut whole = hierarchy.whole_mesh_levels()?;
    unify_mean_normals(&mut whole);
    // Vertices of the joined mesh are in the order of the meshes, so each mesh is a range of them.
    let parts = meshes.iter().enumerate();
    let parts: Vec<Part<'_>> = parts
        .map(|(index, mesh)| Part::of(mesh, index, &ranges, &whole))
        .collect();
    // All meshes get the deviations of the worst mesh, so that they change levels together.
    let deviations = deviations(&parts, &whole, config);
    let with_report = |part: Part<'_>| {
        let hierarchy = part.hierarchy(&whole, &deviations)?;
        let report = BakeReport {
            coarsest_triangles: hierarchy.units.last()?.triangle_count as usize,
            ..report.clone()
        };
        debug_assert_eq!(hierarchy.validate(), Ok(()));
        Some((hierarchy, report))
    };
    parts.into_iter().map(with_report).collect()
}

/// Gives all levels the mean normal of the source. Otherwise, meshes that skip different levels would select
/// differently.
fn unify_mean_normals(whole: &mut Hierarchy) {
    let facing = whole.groups.first().map(|group| group.mean_normal);
    for group in &mut whole.groups {
        group.mean_normal = facing.unwrap_or_default();
    }
}

/// For each level of the joined mesh, the largest deviation of any mesh at this level or a finer level.
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
            deviation_in_local(part.mesh, &part.vertices.positions, &levels)
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

/// The levels of one mesh, cut out of the joined mesh.
struct Part<'a> {
    mesh: &'a SourceMesh,
    /// Positions in the mesh, by the bits of their positions in the joined mesh.
    own_positions: FxHashMap<[u32; 3], Vec3>,
    vertices: Vertices,
    moved_from: Vec<u32>,
    /// Own levels, finest first: the index of the joined mesh's level, and the triangles.
    levels: Vec<(usize, Vec<[u32; 3]>)>,
}

impl<'a> Part<'a> {
    /// Cuts out a mesh. `ranges` are the vertices of each mesh in `whole`.
    fn of(mesh: &'a SourceMesh, index: usize, ranges: &[Range<usize>], whole: &Hierarchy) -> Self {
        let range = ranges[index].clone();
        let of_whole = whole.vertices.positions[range.clone()].iter().copied();
        let mut part = Self {
            mesh,
            own_positions: of_whole
                .map(bits)
                .zip(mesh.positions.iter().copied())
                .collect(),
            vertices: mesh.finite_vertices(),
            moved_from: Vec::new(),
            levels: Vec::new(),
        };
        let mesh_of = |vertex: u32| {
            let origin = whole.origin_of(vertex).unwrap_or(0) as usize;
            ranges.partition_point(|range| range.end <= origin)
        };
        // The simplifier may weld vertices at the same position, so a triangle may mix vertices of two or three meshes.
        // Each triangle belongs to exactly one mesh; otherwise there would be holes.
        let is_own = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(mesh_of);
            index == if b == c { b } else { a }
        };
        let mut own_of = FxHashMap::default();
        for (level, unit) in whole.units.iter().enumerate() {
            let triangles: Vec<[u32; 3]> = whole.triangles_of(unit).filter(is_own).collect();
            // If no triangles of a mesh are left, it keeps its previous level.
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

    /// The own index of a vertex of `whole`. Vertices that are not in the source are added.
    fn vertex(&mut self, vertex: u32, range: &Range<usize>, whole: &Hierarchy) -> u32 {
        if range.contains(&(vertex as usize)) {
            return vertex - range.start as u32;
        }
        let from = &whole.vertices;
        let own = self.vertices.positions.len() as u32;
        // Vertices that did not move keep the exact position of the mesh; otherwise there would be cracks.
        let position = from.positions[vertex as usize];
        let own_position = self.own_positions.get(&bits(position));
        let positions = &mut self.vertices.positions;
        positions.push(*own_position.unwrap_or(&position));
        push_attribute(&mut self.vertices.normals, &from.normals, vertex);
        push_attribute(&mut self.vertices.uvs, &from.uvs, vertex);
        push_attribute(&mut self.vertices.tangents, &from.tangents, vertex);
        push_attribute(&mut self.vertices.uvs_1, &from.uvs_1, vertex);
        push_attribute(&mut self.vertices.colors, &from.colors, vertex);
        let origin = whole.origin_of(vertex).unwrap_or(0) as usize;
        // A vertex that was welded into another mesh has no own origin. Any own vertex replaces it.
        let is_own = range.contains(&origin);
        self.moved_from.push(if is_own {
            (origin - range.start) as u32
        } else {
            0
        });
        own
    }

    fn hierarchy(self, whole: &Hierarchy, deviations: &[f32]) -> Option<Hierarchy> {
        let mut own = Hierarchy {
            source: self.mesh.source_hash(),
            source_vertex_count: self.mesh.positions.len() as u32,
            vertices: self.vertices,
            moved_from: self.moved_from,
            ..Hierarchy::default()
        };
        if !self.mesh.has_other_attributes {
            own.moved_from.clear();
        }
        for (index, (level, triangles)) in self.levels.iter().enumerate() {
            let next = self.levels.get(index + 1).map(|(next, _)| *next);
            // Levels that this mesh skipped are represented by its previous level, up to the error of the next one.
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

/// Adds the value of a vertex if the mesh has the attribute.
fn push_attribute<V: Copy>(own: &mut Vec<V>, all: &[V], vertex: u32) {
    if let (false, Some(&value)) = (own.is_empty(), all.get(vertex as usize)) {
        own.push(value);
    }
}
