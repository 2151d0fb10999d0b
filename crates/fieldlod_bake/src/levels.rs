//! The levels: clusterlod's groups, then the [tail](crate::tail) above what it leaves.

use std::collections::BTreeMap;

use fieldlod_hierarchy::NO_GROUP;

use crate::input::SimplifierInput;
use crate::simplify::Simplifier;
use crate::tail::simplify_tail;
use crate::watertight::simplify_watertight;
use crate::{BakeConfig, BakeReport};

/// A group: what it consumes and how far its simplification strays.
pub(crate) struct RawGroup {
    pub(crate) level: u32,
    /// Never less than that of a finer group; infinite for a terminal group.
    pub(crate) error_in_local: f32,
    /// The least to be stated, until all groups are known and measured; see [`crate::deviation`].
    pub(crate) deviation_in_local: f32,
    pub(crate) units: Vec<RawUnit>,
}

impl RawGroup {
    /// Whether nothing coarser stands for it.
    pub(crate) fn is_terminal(&self) -> bool {
        self.error_in_local == f32::INFINITY
    }

    /// The vertices of its triangles, each as often as triangles use it.
    pub(crate) fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        let clusters = self.units.iter().flat_map(|unit| &unit.clusters);
        clusters.flatten().copied()
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
        for cluster in clusters {
            let of_producer = by_producer.entry(cluster.produced_by).or_default();
            of_producer.push(cluster.corners);
        }
        let finer = || {
            let indices = by_producer.keys();
            indices.filter_map(|&finer| self.0.get(finer as usize))
        };
        let level = finer().map(|finer| finer.level + 1).max().unwrap_or(0);
        let errors = finer().map(|finer| finer.error_in_local);
        let error_in_local = errors.fold(error, f32::max);
        let units = by_producer.into_iter();
        let units = units.flat_map(|(produced_by, clusters)| {
            let parts = clusters.chunks(most_clusters).map(<[_]>::to_vec);
            let unit = move |clusters| RawUnit {
                produced_by,
                clusters,
            };
            parts.map(unit).collect::<Vec<_>>()
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
    input: &mut SimplifierInput,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> (Vec<RawGroup>, BakeReport) {
    let groups = simplify_watertight(indices, input, config, on_triangles);
    let (mut groups, ends) = split_off_ends(groups);
    let mut report = BakeReport {
        stuck_groups: ends.stuck_groups,
        ..BakeReport::default()
    };
    let simplifier = Simplifier::new(input, config);
    simplify_tail(&simplifier, ends.clusters, &mut groups, &mut report);
    (groups.0, report)
}

/// What clusterlod leaves at the coarse end.
struct Ends {
    clusters: Vec<Cluster>,
    stuck_groups: usize,
}

/// Takes out the terminal groups, which produce nothing, and numbers the others anew.
fn split_off_ends(groups: Vec<RawGroup>) -> (Groups, Ends) {
    let mut kept = Groups::default();
    let mut clusters = Vec::new();
    let mut new_index = Vec::with_capacity(groups.len());
    let mut terminal_groups = 0usize;
    for mut group in groups {
        for unit in &mut group.units {
            if !unit.is_source() {
                unit.produced_by = new_index[unit.produced_by as usize];
            }
        }
        new_index.push(kept.0.len() as u32);
        if !group.is_terminal() {
            kept.0.push(group);
            continue;
        }
        terminal_groups += 1;
        for unit in group.units {
            let produced_by = unit.produced_by;
            let cluster = |corners| Cluster {
                produced_by,
                corners,
            };
            clusters.extend(unit.clusters.into_iter().map(cluster));
        }
    }
    let stuck_groups = terminal_groups.saturating_sub(1);
    let ends = Ends {
        clusters,
        stuck_groups,
    };
    (kept, ends)
}

pub(crate) fn triangle_count(clusters: &[Cluster]) -> usize {
    clusters
        .iter()
        .map(|cluster| cluster.corners.len() / 3)
        .sum()
}
