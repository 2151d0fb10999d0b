//! The calls into meshoptimizer's clusterlod, the only ones that build levels.

use std::collections::BTreeMap;

use fieldlod_hierarchy::NO_GROUP;
use meshopt::{ClodCluster, ClodConfig, ClodGroup, ClodMesh, VertexDataAdapter};

use crate::input::SimplifierInput;
use crate::{BakeConfig, SourceMesh};

/// A group as the simplifier emits it: what it consumes and how far it strays.
pub(crate) struct RawGroup {
    pub(crate) level: u32,
    /// Never less than that of a finer group; infinite for a terminal group.
    pub(crate) error_in_local: f32,
    /// Filled in when all groups are known; see [`measure_deviations`](crate::deviation).
    pub(crate) deviation_in_local: f32,
    pub(crate) units: Vec<RawUnit>,
}

impl RawGroup {
    /// Whether it could not be simplified, so that nothing coarser stands for it.
    pub(crate) fn is_stuck(&self) -> bool {
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

/// Clusters and simplifies `mesh` level by level. Groups come finer before coarser.
///
/// `on_triangles` hears how many triangles each group consumed. `mesh` must be valid: nothing is
/// checked on the other side.
pub(crate) fn simplify_to_groups(
    mesh: &SourceMesh,
    input: &SimplifierInput,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> Vec<RawGroup> {
    let vertices = input.vertices();
    let clod_mesh = clod_mesh(mesh, input, &vertices);
    let mut groups: Vec<RawGroup> = Vec::new();
    meshopt::clod_build(clod_config(config), &clod_mesh, |group, clusters| {
        let index = groups.len();
        let units = split_by_producer(clusters);
        on_triangles(clusters.iter().map(|c| c.indices.len() / 3).sum());
        groups.push(RawGroup {
            level: group.depth as u32,
            error_in_local: monotone_error(&group, &units, &groups, input.local_from_scaled),
            deviation_in_local: 0.0,
            units,
        });
        index as i32
    });
    groups
}

/// How many triangles clusterlod makes of `mesh` on its own, with the configuration that a bake
/// gives it: what a bake's speed is compared with. `mesh` must be valid.
#[doc(hidden)]
pub fn bare_clusterlod(mesh: &SourceMesh, config: &BakeConfig) -> usize {
    let input = SimplifierInput::of(mesh, config);
    let vertices = input.vertices();
    let clod_mesh = clod_mesh(mesh, &input, &vertices);
    let mut triangles = 0;
    let config = ClodConfig {
        optimize_clusters: true,
        ..clod_config(config)
    };
    meshopt::clod_build(config, &clod_mesh, |_, clusters| {
        triangles += clusters.iter().map(|c| c.indices.len() / 3).sum::<usize>();
        0
    });
    triangles
}

fn clod_mesh<'a>(
    mesh: &'a SourceMesh,
    input: &'a SimplifierInput,
    vertices: &'a VertexDataAdapter<'a>,
) -> ClodMesh<'a> {
    ClodMesh {
        indices: &mesh.indices,
        vertices,
        vertex_attributes: &input.attributes,
        vertex_attributes_stride: input.attribute_stride(),
        vertex_lock: Some(&input.locks),
        attribute_weights: &input.weights,
        attribute_protect_mask: input.protect_mask,
    }
}

fn clod_config(config: &BakeConfig) -> ClodConfig {
    ClodConfig {
        partition_size: config.group_clusters,
        // Neighbouring groups follow each other, so that a part of the mesh is a part of the file.
        partition_sort: true,
        simplify_ratio: config.simplify_ratio,
        simplify_threshold: config.stuck_ratio,
        simplify_fallback_sloppy: config.sloppy_fallback,
        // Triangles are ordered once, when a unit is assembled.
        optimize_clusters: false,
        ..meshopt::clod_default_config(config.cluster_triangles)
    }
}

fn split_by_producer(clusters: &[ClodCluster<'_>]) -> Vec<RawUnit> {
    let mut units: BTreeMap<u32, Vec<Vec<u32>>> = BTreeMap::new();
    for cluster in clusters {
        let produced_by = u32::try_from(cluster.refined).unwrap_or(NO_GROUP);
        units
            .entry(produced_by)
            .or_default()
            .push(cluster.indices.to_vec());
    }
    let unit = |(produced_by, clusters)| RawUnit {
        produced_by,
        clusters,
    };
    units.into_iter().map(unit).collect()
}

/// The group's error, but no less than those of the groups that produced its units: otherwise a
/// criterion on errors alone could draw two levels of one place.
fn monotone_error(
    group: &ClodGroup,
    units: &[RawUnit],
    finer: &[RawGroup],
    local_from_scaled: f32,
) -> f32 {
    if group.simplified.error == f32::MAX {
        return f32::INFINITY;
    }
    let own = (group.simplified.error * local_from_scaled).min(f32::MAX);
    let producers = units.iter().filter(|unit| unit.produced_by != NO_GROUP);
    producers
        .map(|unit| finer[unit.produced_by as usize].error_in_local)
        .fold(own.max(0.0), f32::max)
}
