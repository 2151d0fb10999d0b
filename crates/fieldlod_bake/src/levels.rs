//! The levels: lock, partition, simplify, output, as meshoptimizer's clusterlod does, but with the
//! groups of a level side by side on all cores, and with nothing given up.
//!
//! Where clusterlod makes a group that cannot be simplified ("stuck") the coarsest of its piece of
//! surface, here its clusters go to the next level as they are and are grouped with others. No
//! piece leaves the game before all do, so that no neighbour can pull away from it. What no group
//! can simplify any more, the [tail](crate::tail) simplifies as a whole.

use std::collections::BTreeMap;

use fieldlod_hierarchy::NO_GROUP;
use meshopt::SimplifyVertex;
use rayon::prelude::*;

use crate::input::SimplifierInput;
use crate::simplify::{Simplified, Simplifier};
use crate::tail::simplify_tail;
use crate::{BakeConfig, BakeReport};

/// A round of simplifications that keeps more than this share of all triangles is the last.
const MOST_KEPT_BY_A_ROUND: f32 = 0.95;

/// A group: what it consumes and how far its simplification strays.
pub(crate) struct RawGroup {
    pub(crate) level: u32,
    /// Never less than that of a finer group; infinite for a terminal group.
    pub(crate) error_in_local: f32,
    /// Filled in when all groups are known; see [`crate::deviation`].
    pub(crate) deviation_in_local: f32,
    pub(crate) units: Vec<RawUnit>,
}

impl RawGroup {
    /// Whether nothing coarser stands for it.
    pub(crate) fn is_terminal(&self) -> bool {
        self.error_in_local == f32::INFINITY
    }
}

/// The clusters of one group that share the group that produced them.
pub(crate) struct RawUnit {
    pub(crate) produced_by: u32,
    /// One triangle list per cluster, as indices of source vertices.
    pub(crate) clusters: Vec<Vec<u32>>,
}

impl RawUnit {
    pub(crate) fn is_source(&self) -> bool {
        self.produced_by == NO_GROUP
    }
}

/// A patch of triangles that waits for a group to consume it.
pub(crate) struct Cluster {
    pub(crate) produced_by: u32,
    /// A triangle list of source vertices.
    pub(crate) corners: Vec<u32>,
}

/// All groups so far, finer before coarser.
#[derive(Default)]
pub(crate) struct Groups(pub(crate) Vec<RawGroup>);

impl Groups {
    /// Adds the group that consumes `clusters`; `error` is that of its simplification, in local
    /// units. Each unit is one producer's, and has no more than `most_clusters`.
    pub(crate) fn add(&mut self, clusters: Vec<Cluster>, error: f32, most_clusters: usize) -> u32 {
        let mut by_producer: BTreeMap<u32, Vec<Vec<u32>>> = BTreeMap::new();
        for Cluster {
            produced_by,
            corners,
        } in clusters
        {
            by_producer.entry(produced_by).or_default().push(corners);
        }
        let finer = by_producer
            .keys()
            .filter_map(|&finer| self.0.get(finer as usize));
        let level = finer
            .clone()
            .map(|finer| finer.level + 1)
            .max()
            .unwrap_or(0);
        let error_in_local = finer
            .map(|finer| finer.error_in_local)
            .fold(error, f32::max);
        let units = by_producer
            .into_iter()
            .flat_map(|(produced_by, mut clusters)| {
                let mut units = Vec::new();
                while !clusters.is_empty() {
                    let rest = clusters.split_off(most_clusters.min(clusters.len()));
                    units.push(RawUnit {
                        produced_by,
                        clusters,
                    });
                    clusters = rest;
                }
                units
            });
        let units = units.collect();
        self.0.push(RawGroup {
            level,
            error_in_local,
            deviation_in_local: 0.0,
            units,
        });
        self.0.len() as u32 - 1
    }
}

/// Clusters and simplifies the mesh with these `indices` level by level. Groups come finer before
/// coarser.
///
/// `on_triangles` hears how many triangles each group consumed. The mesh must be valid: nothing is
/// checked on the other side.
pub(crate) fn build_levels(
    indices: &[u32],
    input: &SimplifierInput,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> (Vec<RawGroup>, BakeReport) {
    let simplifier = Simplifier::new(input, config);
    let mut report = BakeReport::default();
    let mut groups = Groups::default();
    let mut clusters = simplifier.clusterize(indices, NO_GROUP);
    while clusters.len() > 1 {
        let before = triangle_count(&clusters);
        let parts = simplifier.partition(clusters);
        let locks = lock_between(&parts, input);
        let simplified: Vec<Option<Simplified>> = parts
            .par_iter()
            .map(|part| simplifier.simplify_group(part, &locks))
            .collect();
        clusters = Vec::new();
        let mut made = Vec::new();
        for (part, simplified) in parts.into_iter().zip(simplified) {
            let Some(simplified) = simplified else {
                report.stuck_groups += 1;
                clusters.extend(part);
                continue;
            };
            on_triangles(triangle_count(&part));
            let error = simplified.error_in_scaled * input.local_from_scaled;
            made.push((groups.add(part, error, usize::MAX), simplified.corners));
        }
        let new = made
            .into_par_iter()
            .map(|(group, corners)| simplifier.clusterize(&corners, group));
        clusters.extend(new.collect::<Vec<_>>().into_iter().flatten());
        if triangle_count(&clusters) as f32 > before as f32 * MOST_KEPT_BY_A_ROUND {
            break;
        }
    }
    simplify_tail(
        &simplifier,
        clusters,
        &mut groups,
        &mut report,
        on_triangles,
    );
    (groups.0, report)
}

pub(crate) fn triangle_count(clusters: &[Cluster]) -> usize {
    clusters
        .iter()
        .map(|cluster| cluster.corners.len() / 3)
        .sum()
}

/// Locks the vertices that lie in several of `parts`, so that what they become fits together.
fn lock_between(parts: &[Vec<Cluster>], input: &SimplifierInput) -> Vec<SimplifyVertex> {
    const NONE: u32 = u32::MAX;
    const SEVERAL: u32 = u32::MAX - 1;
    let mut owner = vec![NONE; input.positions.len()];
    for (part, clusters) in (0u32..).zip(parts) {
        for &vertex in clusters.iter().flat_map(|cluster| &cluster.corners) {
            let owner = &mut owner[input.same_position[vertex as usize] as usize];
            *owner = if *owner == NONE || *owner == part {
                part
            } else {
                SEVERAL
            };
        }
    }
    let vertices = input.same_position.iter().zip(&input.locks);
    let lock = |(&first, &lock): (&u32, &SimplifyVertex)| match owner[first as usize] {
        SEVERAL => lock | SimplifyVertex::Lock,
        _ => lock,
    };
    vertices.map(lock).collect()
}
