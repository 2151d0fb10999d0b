//! Clusters: how the surface is split into them, and how they are gathered in groups.

use fieldlod_hierarchy::NO_GROUP;
use glam::Vec3;
use meshopt::clod_default_config;
use rayon::prelude::*;

use crate::config::BakeConfig;
use crate::levels::vertices::{LevelVertices, Piece};
use crate::mesh::adapter;

/// Parts of at most this many triangles are split into clusters in parallel. The size is independent of the number of
/// threads, so that clusters are the same on all machines.
const TRIANGLES_AT_ONCE: usize = 1 << 16;

/// Weight of full clusters against small bounding boxes, as in clusterlod's configuration for ray tracing.
const FILL_WEIGHT: f32 = 0.5;

/// A sample on the source.
#[derive(Clone, Copy)]
pub(crate) struct Sample {
    /// Position in scaled units, minus the offset of `SourceSurface`.
    pub(crate) point: Vec3,
    /// Corners of the source triangle that contains it.
    pub(crate) triangle: [u32; 3],
}

/// A patch of triangles that a group will consume.
pub(crate) struct Cluster {
    /// The group whose simplification produced it, or [`NO_GROUP`] for source geometry.
    pub(crate) produced_by: u32,
    /// Three vertices per triangle.
    pub(crate) corners: Vec<u32>,
    /// Samples on the source for measuring the next simplification.
    pub(crate) samples: Vec<Sample>,
}

pub(crate) fn triangle_count(clusters: &[Cluster]) -> usize {
    let corners = clusters.iter().map(|cluster| cluster.corners.len());
    corners.sum::<usize>() / 3
}

/// Splits the source into clusters.
pub(crate) fn clusters_of_source(
    indices: &[u32],
    vertices: &LevelVertices,
    config: &BakeConfig,
) -> Vec<Cluster> {
    let (triangles, _) = indices.as_chunks::<3>();
    let mut parts = vec![triangles.to_vec()];
    while parts.iter().any(|part| part.len() > TRIANGLES_AT_ONCE) {
        let halves = parts.into_par_iter().map(|part| halves_of(part, vertices));
        // Rayon's `flatten` keeps the order.
        parts = halves.flatten().collect();
    }
    let clusters = parts.into_par_iter().map(|part| {
        let piece = Piece::of(part.into_iter().flatten(), vertices);
        let corners = split_into_clusters(&piece.positions, &piece.corners, config);
        let to_all = |corners: Vec<u32>| {
            let corners = corners.iter().map(|&own| piece.vertices[own as usize]);
            Cluster {
                produced_by: NO_GROUP,
                corners: corners.collect(),
                samples: Vec::new(),
            }
        };
        corners.into_iter().map(to_all).collect::<Vec<_>>()
    });
    clusters.flatten().collect()
}

/// Splits triangles at the median along the longest side of their bounding box.
fn halves_of(mut part: Vec<[u32; 3]>, vertices: &LevelVertices) -> Vec<Vec<[u32; 3]>> {
    if part.len() <= TRIANGLES_AT_ONCE {
        return vec![part];
    }
    let points = part.iter().map(|triangle| vertices.position(triangle[0]));
    let aabb = fieldlod_hierarchy::Aabb::around(points).unwrap_or_default();
    let axis = (aabb.max - aabb.min).max_position();
    let along = |triangle: &[u32; 3]| vertices.position(triangle[0])[axis];
    let middle = part.len() / 2;
    // Ties are broken by index. Otherwise the halves would depend on the order of equal triangles.
    part.select_nth_unstable_by(middle, |a, b| {
        along(a).total_cmp(&along(b)).then_with(|| a.cmp(b))
    });
    let second = part.split_off(middle);
    vec![part, second]
}

/// Splits a triangle list into clusters. Each is a triangle list in vertex-cache order.
///
/// Clusters are split by position, like a bounding volume hierarchy. Growing them from neighbour to neighbour takes
/// twice the time and saves no triangles at equal quality.
pub(crate) fn split_into_clusters(
    positions: &[[f32; 3]],
    corners: &[u32],
    config: &BakeConfig,
) -> Vec<Vec<u32>> {
    let limits = clod_default_config(config.cluster_triangles);
    let meshlets = meshopt::build_meshlets_spatial(
        corners,
        &adapter(positions),
        limits.max_vertices,
        limits.min_triangles,
        limits.max_triangles,
        FILL_WEIGHT,
    );
    let corners_of = |meshlet: meshopt::Meshlet<'_>| {
        let slots = meshlet.triangles.iter();
        slots
            .map(|&slot| meshlet.vertices[usize::from(slot)])
            .collect()
    };
    meshlets.iter().map(corners_of).collect()
}

/// Gathers neighbouring clusters in groups of about `group_clusters`. Groups are sorted along a space-filling curve, so
/// that a region of the mesh is a range of the file.
pub(crate) fn partition(
    clusters: Vec<Cluster>,
    vertices: &LevelVertices,
    group_clusters: usize,
) -> Vec<Vec<Cluster>> {
    if clusters.len() <= group_clusters {
        return vec![clusters];
    }
    // Assign clusters to groups.
    let welded = |cluster: &Cluster| {
        let corners = cluster.corners.iter();
        let firsts = corners.map(|&vertex| vertices.same_position[vertex as usize]);
        firsts.collect::<Vec<u32>>()
    };
    let counts: Vec<u32> = clusters.iter().map(|c| c.corners.len() as u32).collect();
    let corners: Vec<u32> = clusters.iter().flat_map(welded).collect();
    let mut group_of = vec![0; clusters.len()];
    let count = meshopt::partition_clusters_with_positions(
        &mut group_of,
        &corners,
        &counts,
        &adapter(&vertices.positions),
        group_clusters,
    );
    // Sort groups along a space-filling curve. Any vertex of a group is near enough to sort by.
    let mut points = vec![[0.0f32; 3]; count];
    for (cluster, &group) in clusters.iter().zip(&group_of) {
        points[group as usize] = vertices.positions[cluster.corners[0] as usize];
    }
    let rank = meshopt::spatial_sort_remap(&adapter(&points));
    let mut groups: Vec<Vec<Cluster>> = Vec::new();
    groups.resize_with(count, Vec::new);
    for (cluster, group) in clusters.into_iter().zip(group_of) {
        groups[rank[group as usize] as usize].push(cluster);
    }
    groups
}

/// For the first vertex at each position, whether it must stay: it is kept, or several groups use its position.
/// Otherwise the surface would tear between groups.
pub(crate) fn shared_positions(groups: &[Vec<Cluster>], vertices: &LevelVertices) -> Vec<bool> {
    const NONE: u32 = u32::MAX;
    let mut used_by = vec![NONE; vertices.positions.len()];
    let mut is_shared = vertices.is_kept.clone();
    is_shared.resize(vertices.positions.len(), false);
    for (group, clusters) in (0..).zip(groups) {
        for &vertex in clusters.iter().flat_map(|cluster| &cluster.corners) {
            let first = vertices.same_position[vertex as usize] as usize;
            is_shared[first] |= used_by[first] != NONE && used_by[first] != group;
            used_by[first] = group;
        }
    }
    is_shared
}
