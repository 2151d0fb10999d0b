//! One level: simplifies all its groups in parallel.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::config::BakeConfig;
use crate::deviation::{Measured, SourceSurface};
use crate::levels::clusters::{Cluster, split_into_clusters};
use crate::levels::groups::Groups;
use crate::levels::simplified_group::SimplifiedGroup;
use crate::levels::simplify::{Simplified, Task};
use crate::levels::vertices::{LevelVertices, Piece};
use crate::plants::plant::PlantLevel;

/// Largest share of a simplified surface's area that may face away from the source. With more, levels of hard-edged
/// models show dark triangles; with zero, many groups are stuck. Half and twice the share make no difference on nine
/// props.
const MAX_FLIPPED_SHARE: f32 = 0.003;
/// A triangle faces the source where the source is at most this many times as far away as the simplified surface is from
/// the source. At 1.25, a level of a shader ball faces away. The part of the distance from the source to the simplified
/// surface matters: without it, no factor holds both for the shader ball and for a knot with rounded vertices.
const FACING_REACH: f32 = 1.1;

/// Groups and settings of one level.
pub(crate) struct LevelStep<'a> {
    pub(crate) vertices: &'a LevelVertices,
    pub(crate) config: &'a BakeConfig,
    pub(crate) source: &'a SourceSurface,
    /// Groups of finer levels.
    pub(crate) groups: &'a Groups,
    /// Clusters of each group.
    pub(crate) parts: &'a [Vec<Cluster>],
    /// For the first vertex at each position, whether it must stay: it is kept, or several groups use its position.
    pub(crate) is_shared: Vec<bool>,
    pub(crate) plant: PlantLevel<'a>,
}

/// Largest error and deviation of the consumed groups.
#[derive(Clone, Copy)]
struct Finer {
    error_in_local: f32,
    deviation_in_scaled: f32,
}

/// An accepted simplification with its clusters and deviation.
type Accepted = (Simplified, Vec<Vec<u32>>, Measured);

impl LevelStep<'_> {
    /// Simplifies each group. Stuck groups are `None`. A level of a plant is simplified again with other gains until it
    /// covers the wanted area.
    pub(crate) fn simplify(&mut self) -> Vec<Option<SimplifiedGroup>> {
        let mut simplified = self.simplify_groups();
        while let Some(gain) = self.plant.next_gain(self.parts, &simplified, self.vertices) {
            self.plant.area_gain = gain;
            simplified = self.simplify_groups();
        }
        simplified
    }

    fn simplify_groups(&self) -> Vec<Option<SimplifiedGroup>> {
        let parts = self.parts.par_iter();
        parts.map(|part| self.simplify_group(part)).collect()
    }

    fn simplify_group(&self, part: &[Cluster]) -> Option<SimplifiedGroup> {
        let finer = self.finer_of(part);
        let task = self.task(part);
        // Attempts come best first. After the first two, each is computed only if no earlier attempt is accepted.
        let mut attempts = task.attempts();
        let (simplified, clusters, measured) =
            attempts.find_map(|attempt| self.accept(&task, part, attempt, finer))?;
        // End the borrow of `task`: its parts are moved below.
        drop(attempts);
        let local_from_scaled = self.vertices.local_from_scaled;
        let mut own = simplified.error_in_scaled;
        if !self.vertices.shows_tears(self.config) {
            // No picture measures the torn texture, so its longest edge counts.
            own = own.max(simplified.least_deviation_in_scaled);
        }
        // Only terminal groups have an infinite error.
        let own_in_local = (own * local_from_scaled).min(f32::MAX);
        let deviation_in_local = if self.config.measure_deviation {
            (measured.deviation_in_scaled * local_from_scaled).min(f32::MAX)
        } else {
            f32::INFINITY
        };
        Some(SimplifiedGroup {
            piece: task.piece,
            same_position: task.same_position,
            simplified,
            clusters: clusters.into_iter().zip(measured.samples).collect(),
            // Errors must not shrink from finer to coarser groups.
            error_in_local: own_in_local.max(finer.error_in_local),
            deviation_in_local,
        })
    }

    fn finer_of(&self, part: &[Cluster]) -> Finer {
        let none = Finer {
            error_in_local: 0.0,
            deviation_in_scaled: 0.0,
        };
        self.groups.finer_of(part).fold(none, |finer, group| Finer {
            error_in_local: finer.error_in_local.max(group.error_in_local),
            deviation_in_scaled: finer
                .deviation_in_scaled
                .max(group.deviation_in_local / self.vertices.local_from_scaled),
        })
    }

    fn task(&self, part: &[Cluster]) -> Task<'_> {
        let vertices = self.vertices;
        // Vertices that look the same become one: their copies would form a seam.
        let corners = part.iter().flat_map(|cluster| &cluster.corners);
        let piece = Piece::of(corners.map(|&v| vertices.corner[v as usize]), vertices);
        let own = || piece.vertices.iter().map(|&vertex| vertex as usize);
        let is_locked = own().map(|vertex| self.is_shared[vertices.same_position[vertex] as usize]);
        let visible_px = self.plant.visible_px.as_ref();
        Task {
            vertices,
            config: self.config,
            same_position: piece.same_position(vertices),
            uv_ranges: OnceLock::new(),
            is_locked: is_locked.collect(),
            visible_px: visible_px.map(|pixels| own().map(|vertex| pixels[vertex]).collect()),
            ratio: self.plant.ratio,
            loose: self.plant.loose,
            is_whole: self.parts.len() == 1,
            area_gain: self.plant.area_gain,
            piece,
        }
    }

    /// Corrects the covered area of an attempt, splits it into clusters and measures it. Returns `None` if it flips
    /// more than [`MAX_FLIPPED_SHARE`].
    fn accept(
        &self,
        task: &Task<'_>,
        part: &[Cluster],
        mut simplified: Simplified,
        finer: Finer,
    ) -> Option<Accepted> {
        self.plant.fit_covered_area(task, &mut simplified);
        // Levels do not depend on deviations, which may be measured later.
        let distance = self
            .source
            .distance_at_vertices(part, self.vertices, &simplified);
        let reach = FACING_REACH * distance;
        if self.source.flipped_share(&simplified, reach) > MAX_FLIPPED_SHARE {
            return None;
        }
        let clusters = split_into_clusters(&simplified.positions, &simplified.corners, self.config);
        let measured = self.measure(part, &simplified, &clusters, finer.deviation_in_scaled);
        Some((simplified, clusters, measured))
    }

    /// Measures the deviation from the source, if enabled.
    fn measure(
        &self,
        part: &[Cluster],
        simplified: &Simplified,
        clusters: &[Vec<u32>],
        finer_in_scaled: f32,
    ) -> Measured {
        if !self.config.measure_deviation {
            return Measured {
                deviation_in_scaled: f32::INFINITY,
                samples: vec![Vec::new(); clusters.len()],
            };
        }
        self.source
            .measure(part, self.vertices, simplified, clusters, finer_in_scaled)
    }
}
