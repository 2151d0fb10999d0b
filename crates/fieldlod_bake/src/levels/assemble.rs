//! Assembles a hierarchy from simplified groups.

use fieldlod_hierarchy::{Aabb, Group, Hierarchy, NO_GROUP, Sphere, Vertices};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::levels::groups::{RawGroup, RawUnit};
use crate::levels::vertices::LevelVertices;
use crate::mesh::SourceMesh;
use crate::mesh::bounds::tight_sphere;
use crate::mesh::two_sided::least_first;

/// A group with bounds and with units in draw order.
struct FinishedGroup {
    bounds: Sphere,
    mean_normal: Vec3,
    units: Vec<FinishedUnit>,
}

struct FinishedUnit {
    produced_by: u32,
    aabb: Aabb,
    /// Vertices in the order of their first use.
    vertices: Vec<u32>,
    /// Indices into `vertices`, three per triangle.
    indices: Vec<u16>,
}

/// Computes bounds, and orders triangles and vertices for drawing.
fn finish_group(positions: &[Vec3], group: &RawGroup) -> FinishedGroup {
    let finished = group.units.iter().map(|unit| finish_unit(positions, unit));
    let units: Vec<FinishedUnit> = finished.collect();
    // Bounds enclose the geometry before and after simplification: one decision replaces one by the other.
    let vertices = units.iter().flat_map(|unit| &unit.vertices).copied();
    let vertices = vertices.chain(group.made.clone());
    let points: Vec<Vec3> = vertices.map(|v| positions[v as usize]).collect();
    FinishedGroup {
        bounds: tight_sphere(&points),
        mean_normal: mean_normal(positions, group),
        units,
    }
}

/// The mean unit normal of a group, weighted by area; zero without area.
fn mean_normal(positions: &[Vec3], group: &RawGroup) -> Vec3 {
    let (mut sum, mut whole) = (DVec3::ZERO, 0.0f64);
    for cluster in group.units.iter().flat_map(|unit| &unit.clusters) {
        for triangle in cluster.as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|v| positions[v as usize].as_dvec3());
            let twice_area_vector = (b - a).cross(c - a);
            sum += twice_area_vector;
            whole += twice_area_vector.length();
        }
    }
    if whole > 0.0 {
        (sum / whole).as_vec3()
    } else {
        Vec3::ZERO
    }
}

fn finish_unit(positions: &[Vec3], unit: &RawUnit) -> FinishedUnit {
    let mut list = VertexList::default();
    let mut indices = Vec::new();
    for cluster in &unit.clusters {
        // `own` and `list` both hold vertices in the order of first use.
        let (own, corners) = meshopt::clod_local_indices(cluster);
        let own_slots = own.iter().map(|&vertex| list.slot_of(vertex));
        let slots: Vec<u16> = own_slots.collect();
        indices.extend(corners.iter().map(|&corner| slots[usize::from(corner)]));
    }
    // Rotate each triangle so that its smallest index is first. Files are then smaller.
    for triangle in indices.as_chunks_mut::<3>().0 {
        *triangle = least_first(*triangle);
    }
    // A tight box for culling.
    let vertices = list.vertices;
    let points = vertices.iter().map(|&v| positions[v as usize]);
    FinishedUnit {
        produced_by: unit.produced_by,
        aabb: Aabb::around(points).unwrap_or_default(),
        vertices,
        indices,
    }
}

/// Vertices of a unit in the order of their first use, so that the GPU reads memory in one direction.
#[derive(Default)]
struct VertexList {
    vertices: Vec<u32>,
    slots: FxHashMap<u32, u16>,
}

impl VertexList {
    /// Index of a vertex in the unit. Units never have more vertices than 16-bit indices allow.
    fn slot_of(&mut self, vertex: u32) -> u16 {
        let next = self.vertices.len() as u16;
        let slot = *self.slots.entry(vertex).or_insert(next);
        if slot == next {
            self.vertices.push(vertex);
        }
        slot
    }
}

/// Orders and bounds all groups, and stores them in a hierarchy of `mesh`.
pub(crate) fn assemble(
    mesh: &SourceMesh,
    vertices: LevelVertices,
    groups: &[RawGroup],
) -> Hierarchy {
    let (vertices, moved_from) = in_local(mesh, vertices);
    let mut hierarchy = Hierarchy {
        source: mesh.source_hash(),
        source_vertex_count: mesh.positions.len() as u32,
        vertices,
        moved_from,
        ..Hierarchy::default()
    };
    let positions = &hierarchy.vertices.positions;
    let in_parallel = groups
        .par_iter()
        .map(|group| finish_group(positions, group));
    let finished: Vec<FinishedGroup> = in_parallel.collect();
    for (group, finished) in groups.iter().zip(&finished) {
        push_group(&mut hierarchy, group, finished);
    }
    hierarchy
}

/// Converts all vertices to local units. The vertices of `mesh` come first, unchanged. If the mesh has other
/// attributes, also returns the source vertex that each further vertex was moved from.
fn in_local(mesh: &SourceMesh, from: LevelVertices) -> (Vertices, Vec<u32>) {
    let mut vertices = mesh.finite_vertices();
    for vertex in from.source_count as u32..from.positions.len() as u32 {
        let position = from.position(vertex) * from.local_from_scaled;
        vertices.positions.push(position);
        let origin = from.origin[vertex as usize] as usize;
        from.layout.push_to(&mut vertices, from.row(vertex), origin);
    }
    // Hierarchies without other attributes need no origins: files are smaller without them.
    let mut moved_from = from.origin;
    moved_from.drain(..from.source_count);
    if !mesh.has_other_attributes {
        moved_from.clear();
    }
    (vertices, moved_from)
}

fn push_group(hierarchy: &mut Hierarchy, raw: &RawGroup, finished: &FinishedGroup) {
    for unit in &finished.units {
        hierarchy.push_unit(
            unit.produced_by,
            unit.aabb,
            unit.vertices.iter().copied(),
            unit.indices.iter().copied(),
        );
    }
    // Groups that produced the units. Units of the same producer are adjacent.
    let mut producers: Vec<u32> = finished.units.iter().map(|unit| unit.produced_by).collect();
    producers.dedup();
    let group = Group {
        bounds: finished.bounds,
        error_in_local: raw.error_in_local,
        deviation_in_local: raw.deviation_in_local,
        mean_normal: finished.mean_normal,
        ..Group::default()
    };
    let finer = producers.into_iter().filter(|&group| group != NO_GROUP);
    hierarchy.push_group(group, finer);
}
