//! Groups as they come out of the simplifier, before they are bounded and ordered.

use std::collections::BTreeMap;

use fieldlod_hierarchy::NO_GROUP;

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

pub(crate) fn triangle_count(clusters: &[Cluster]) -> usize {
    clusters
        .iter()
        .map(|cluster| cluster.corners.len() / 3)
        .sum()
}
