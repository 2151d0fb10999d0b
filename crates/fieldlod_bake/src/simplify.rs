//! The calls into meshoptimizer that build levels.

use meshopt::{
    ClodConfig, ClodMesh, SimplifyOptions, SimplifyVertex, VertexDataAdapter, clod_default_config,
};

use crate::input::SimplifierInput;
use crate::levels::Cluster;
use crate::{BakeConfig, SourceMesh};

/// A place that more clusters share than this does not tell which of them are neighbours; and
/// looking at all pairs of them takes long.
const MOST_CLUSTERS_AT_A_PLACE: u32 = 64;

/// What a simplification leaves.
pub(crate) struct Simplified {
    /// A triangle list of source vertices, never empty.
    pub(crate) corners: Vec<u32>,
    pub(crate) error_in_scaled: f32,
}

/// How far a simplification may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Means {
    /// As groups are: topology is kept, seams are kept.
    Careful,
    /// Small components vanish.
    Prune,
    /// Attributes and seams count nothing.
    PositionsOnly,
    /// Vertices are merged on a grid.
    Sloppy,
}

/// A mesh as the simplifier sees it, and how it is to be simplified.
pub(crate) struct Simplifier<'a> {
    pub(crate) input: &'a SimplifierInput,
    pub(crate) config: &'a BakeConfig,
    vertices: VertexDataAdapter<'a>,
}

impl<'a> Simplifier<'a> {
    pub(crate) fn new(input: &'a SimplifierInput, config: &'a BakeConfig) -> Self {
        let vertices = input.vertices();
        Self {
            input,
            config,
            vertices,
        }
    }

    /// Splits a triangle list into clusters, each ordered for the vertex cache.
    pub(crate) fn clusterize(&self, corners: &[u32], produced_by: u32) -> Vec<Cluster> {
        let limits = clod_default_config(self.config.cluster_triangles);
        let meshlets = meshopt::build_meshlets_flex(
            corners,
            &self.vertices,
            limits.max_vertices,
            limits.min_triangles,
            limits.max_triangles,
            0.0,
            limits.cluster_split_factor,
        );
        let cluster = |meshlet: meshopt::Meshlet<'_>| {
            let corners = meshlet
                .triangles
                .iter()
                .map(|&slot| meshlet.vertices[usize::from(slot)]);
            Cluster {
                produced_by,
                corners: corners.collect(),
            }
        };
        meshlets.iter().map(cluster).collect()
    }

    /// Groups neighbouring clusters. Neighbouring groups follow each other, so that a part of the
    /// mesh is a part of the file.
    pub(crate) fn partition(&self, clusters: Vec<Cluster>) -> Vec<Vec<Cluster>> {
        if clusters.len() <= self.config.group_clusters {
            return vec![clusters];
        }
        let (corners, counts) = self.corners_for_partition(&clusters);
        let mut part_of = vec![0; clusters.len()];
        let count = meshopt::partition_clusters_with_positions(
            &mut part_of,
            &corners,
            &counts,
            &self.vertices,
            self.config.group_clusters,
        );
        let order = self.spatial_order(&clusters, &part_of, count);
        let mut parts: Vec<Vec<Cluster>> = Vec::new();
        parts.resize_with(count, Vec::new);
        for (cluster, part) in clusters.into_iter().zip(part_of) {
            parts[order[part as usize] as usize].push(cluster);
        }
        parts.retain(|part| !part.is_empty());
        parts
    }

    /// The vertices of all clusters, by place, and how many each has. Left out are places that say
    /// little; every cluster keeps its first, for its position.
    fn corners_for_partition(&self, clusters: &[Cluster]) -> (Vec<u32>, Vec<u32>) {
        let place = |vertex: u32| self.input.same_position[vertex as usize];
        let mut clusters_at = vec![(0u32, u32::MAX); self.input.positions.len()];
        for (index, cluster) in (0u32..).zip(clusters) {
            for &vertex in &cluster.corners {
                let (count, last) = &mut clusters_at[place(vertex) as usize];
                if *last != index {
                    (*count, *last) = (*count + 1, index);
                }
            }
        }
        let mut all = Vec::with_capacity(clusters.iter().map(|c| c.corners.len()).sum());
        let mut counts = Vec::with_capacity(clusters.len());
        for cluster in clusters {
            let before = all.len();
            let places = cluster.corners.iter().map(|&vertex| place(vertex));
            all.extend(places.filter(|&p| clusters_at[p as usize].0 <= MOST_CLUSTERS_AT_A_PLACE));
            if all.len() == before {
                all.push(place(cluster.corners[0]));
            }
            counts.push((all.len() - before) as u32);
        }
        (all, counts)
    }

    /// For each part its place in an order in which neighbours follow each other.
    fn spatial_order(&self, clusters: &[Cluster], part_of: &[u32], count: usize) -> Vec<u32> {
        let mut points = vec![[0.0f32; 3]; count];
        for (cluster, &part) in clusters.iter().zip(part_of) {
            points[part as usize] = self.input.positions[cluster.corners[0] as usize];
        }
        let bytes = meshopt::typed_to_bytes(&points);
        match VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0) {
            Ok(points) => meshopt::spatial_sort_remap(&points),
            Err(_) => (0..count as u32).collect(),
        }
    }

    /// Simplifies the triangles of a group; `None` if too many are left.
    pub(crate) fn simplify_group(
        &self,
        group: &[Cluster],
        locks: &[SimplifyVertex],
    ) -> Option<Simplified> {
        let corners: Vec<u32> = group
            .iter()
            .flat_map(|cluster| &cluster.corners)
            .copied()
            .collect();
        let target = (corners.len() as f32 / 3.0 * self.config.simplify_ratio) as usize * 3;
        let simplified = self.simplify(&corners, locks, target, Means::Careful);
        if self.is_coarser(&simplified, corners.len()) {
            return Some(simplified);
        }
        let sloppy = self
            .config
            .sloppy_fallback
            .then(|| self.simplify(&corners, locks, target, Means::Sloppy))?;
        self.is_coarser(&sloppy, corners.len()).then_some(sloppy)
    }

    pub(crate) fn is_coarser(&self, simplified: &Simplified, corners_before: usize) -> bool {
        simplified.corners.len() as f32 <= corners_before as f32 * self.config.stuck_ratio
    }

    pub(crate) fn simplify(
        &self,
        corners: &[u32],
        locks: &[SimplifyVertex],
        target: usize,
        means: Means,
    ) -> Simplified {
        let mut error = 0.0f32;
        let mut left = match means {
            Means::Sloppy => {
                let left = meshopt::simplify_sloppy_with_locks(
                    corners,
                    &self.vertices,
                    locks,
                    target,
                    f32::MAX,
                    Some(&mut error),
                );
                error *= meshopt::simplify_scale(&self.vertices);
                left
            }
            _ => self.simplify_edges(corners, locks, target, means, &mut error),
        };
        // Something must stand for every piece.
        if left.is_empty() {
            left.extend(&corners[..3]);
        }
        let error_in_scaled = if error.is_finite() {
            error.max(0.0)
        } else {
            f32::MAX
        };
        Simplified {
            corners: left,
            error_in_scaled,
        }
    }

    fn simplify_edges(
        &self,
        corners: &[u32],
        locks: &[SimplifyVertex],
        target: usize,
        means: Means,
        error: &mut f32,
    ) -> Vec<u32> {
        let mut options = SimplifyOptions::Sparse
            | SimplifyOptions::ErrorAbsolute
            | SimplifyOptions::ErrorClamped
            | SimplifyOptions::Permissive;
        if means != Means::Careful {
            options |= SimplifyOptions::Prune;
        }
        let input = self.input;
        if input.weights.is_empty() || means == Means::PositionsOnly {
            return meshopt::simplify_with_locks(
                corners,
                &self.vertices,
                locks,
                target,
                f32::MAX,
                options,
                Some(error),
            );
        }
        meshopt::simplify_with_attributes_and_locks(
            corners,
            &self.vertices,
            &input.attributes,
            &input.weights,
            input.attribute_stride(),
            locks,
            target,
            f32::MAX,
            options,
            Some(error),
        )
    }
}

/// How many triangles clusterlod makes of `mesh` on its own, with the configuration that a bake
/// follows: what a bake's speed is compared with. `mesh` must be valid.
#[doc(hidden)]
pub fn bare_clusterlod(mesh: &SourceMesh, config: &BakeConfig) -> usize {
    let input = SimplifierInput::of(mesh, config);
    let vertices = input.vertices();
    let clod_mesh = ClodMesh {
        indices: &mesh.indices,
        vertices: &vertices,
        vertex_attributes: &input.attributes,
        vertex_attributes_stride: input.attribute_stride(),
        vertex_lock: None,
        attribute_weights: &input.weights,
        attribute_protect_mask: input.protect_mask,
    };
    let config = ClodConfig {
        partition_size: config.group_clusters,
        partition_sort: true,
        simplify_ratio: config.simplify_ratio,
        simplify_threshold: config.stuck_ratio,
        simplify_fallback_sloppy: config.sloppy_fallback,
        ..clod_default_config(config.cluster_triangles)
    };
    let mut triangles = 0;
    meshopt::clod_build(config, &clod_mesh, |_, clusters| {
        triangles += clusters.iter().map(|c| c.indices.len() / 3).sum::<usize>();
        0
    });
    triangles
}
