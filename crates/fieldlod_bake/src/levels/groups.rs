//! Groups of all levels, not yet bounded and ordered.

use std::ops::Range;

use fieldlod_hierarchy::NO_GROUP;

use crate::levels::clusters::Cluster;

/// Limit for the clusters of a unit, which backs of two-sided sheets may double. A cluster has at most 256 vertices, so
/// a unit has at most 65,536, and 16-bit indices suffice.
const MAX_CLUSTERS_IN_UNIT: usize = 128;

/// A group with its units and the error of its simplification.
pub(crate) struct RawGroup {
    pub(crate) level: u32,
    /// At least the error of each finer group; infinite for a terminal group.
    pub(crate) error_in_local: f32,
    /// At least the deviation of each finer group; infinite for a terminal group, or if deviations are not measured.
    pub(crate) deviation_in_local: f32,
    pub(crate) units: Vec<RawUnit>,
    /// Vertices that the group's simplification created.
    pub(crate) made: Range<u32>,
}

/// Clusters of one group that were produced by the same finer group.
pub(crate) struct RawUnit {
    pub(crate) produced_by: u32,
    /// One triangle list per cluster.
    pub(crate) clusters: Vec<Vec<u32>>,
}

/// All groups, finer before coarser.
#[derive(Default)]
pub(crate) struct Groups(pub(crate) Vec<RawGroup>);

impl Groups {
    /// The group that produced each cluster. Source clusters have none.
    pub(crate) fn finer_of(&self, clusters: &[Cluster]) -> impl Iterator<Item = &RawGroup> {
        let producers = clusters.iter().map(|cluster| cluster.produced_by);
        let producers = producers.filter(|&producer| producer != NO_GROUP);
        producers.map(|producer| &self.0[producer as usize])
    }

    /// Adds the group that consumes `clusters`, and returns its index.
    pub(crate) fn add(
        &mut self,
        mut clusters: Vec<Cluster>,
        error_in_local: f32,
        deviation_in_local: f32,
        made: Range<u32>,
    ) -> u32 {
        let levels = self.finer_of(&clusters).map(|finer| finer.level + 1);
        let level = levels.max().unwrap_or(0);
        clusters.sort_by_key(|cluster| cluster.produced_by);
        let same = clusters.chunk_by_mut(|a, b| a.produced_by == b.produced_by);
        let units = same.flat_map(|same| same.chunks_mut(MAX_CLUSTERS_IN_UNIT));
        let take = |cluster: &mut Cluster| std::mem::take(&mut cluster.corners);
        let units = units.map(|clusters| RawUnit {
            produced_by: clusters[0].produced_by,
            clusters: clusters.iter_mut().map(take).collect(),
        });
        let units = units.collect();
        self.0.push(RawGroup {
            level,
            error_in_local,
            deviation_in_local,
            units,
            made,
        });
        self.0.len() as u32 - 1
    }

    /// Adds the terminal group.
    pub(crate) fn add_terminal(&mut self, clusters: Vec<Cluster>) {
        self.add(clusters, f32::INFINITY, f32::INFINITY, 0..0);
    }
}
