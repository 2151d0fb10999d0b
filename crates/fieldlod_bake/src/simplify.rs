//! The calls into meshoptimizer that build the levels of the tail.

use glam::Vec3;
use meshopt::{SimplifyOptions, SimplifyVertex, VertexDataAdapter, clod_default_config};

use crate::config::BakeConfig;
use crate::groups::Cluster;
use crate::input::SimplifierInput;

/// What a simplification leaves.
pub(crate) struct Simplified {
    /// A triangle list of source vertices, never empty.
    pub(crate) corners: Vec<u32>,
    pub(crate) error_in_scaled: f32,
}

/// How far a simplification may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SimplifyMode {
    /// As in the levels below: topology is kept, seams are kept.
    Careful,
    /// Topology and seams are kept, other attributes count nothing.
    ShapeOnly,
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
        let meshlets = if self.input.is_crowded {
            meshopt::build_meshlets_spatial(
                corners,
                &self.vertices,
                limits.max_vertices,
                limits.min_triangles,
                limits.max_triangles,
                limits.cluster_fill_weight,
            )
        } else {
            meshopt::build_meshlets_flex(
                corners,
                &self.vertices,
                limits.max_vertices,
                limits.min_triangles,
                limits.max_triangles,
                0.0,
                limits.cluster_split_factor,
            )
        };
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

    pub(crate) fn is_coarser(&self, simplified: &Simplified, corners_before: usize) -> bool {
        simplified.corners.len() as f32 <= corners_before as f32 * self.config.stuck_ratio
    }

    /// How far a texture may be off that was torn: by a triangle, so that torn triangles are drawn
    /// where they are no larger than what is promised. 0 if none can be torn.
    pub(crate) fn wrong_texture_in_scaled(
        &self,
        simplified: &Simplified,
        mode: SimplifyMode,
    ) -> f32 {
        let tears = matches!(mode, SimplifyMode::PositionsOnly | SimplifyMode::Sloppy);
        if !tears || !self.input.has_uvs() {
            return 0.0;
        }
        let position = |vertex: u32| Vec3::from(self.input.positions[vertex as usize]);
        let (triangles, _) = simplified.corners.as_chunks::<3>();
        let edges = triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let lengths = edges.map(|(from, to)| position(from).distance(position(to)));
        lengths.fold(0.0, f32::max)
    }

    pub(crate) fn simplify(
        &self,
        corners: &[u32],
        locks: &[SimplifyVertex],
        target: usize,
        mode: SimplifyMode,
    ) -> Simplified {
        let mut error = 0.0f32;
        let mut left = match mode {
            SimplifyMode::Sloppy => {
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
            _ => self.simplify_edges(corners, locks, target, mode, &mut error),
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
        mode: SimplifyMode,
        error: &mut f32,
    ) -> Vec<u32> {
        let mut options = SimplifyOptions::Sparse
            | SimplifyOptions::ErrorAbsolute
            | SimplifyOptions::ErrorClamped
            | SimplifyOptions::Permissive;
        if matches!(mode, SimplifyMode::Prune | SimplifyMode::PositionsOnly) {
            options |= SimplifyOptions::Prune;
        }
        let input = self.input;
        let shape_only = matches!(mode, SimplifyMode::ShapeOnly | SimplifyMode::PositionsOnly);
        if input.weights.is_empty() || shape_only {
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
