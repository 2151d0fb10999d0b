//! The call into meshoptimizer's clusterlod, which clusters, groups and simplifies.

use std::collections::BTreeMap;

use fieldlod_hierarchy::NO_GROUP;
use meshopt::{ClodCluster, ClodConfig, ClodGroup, ClodMesh};

use crate::config::BakeConfig;
use crate::groups::{RawGroup, RawUnit};
use crate::input::SimplifierInput;
use crate::mesh::SourceMesh;

/// Clusters and simplifies the mesh with these `indices` level by level. Groups come finer before
/// coarser; those that cannot be simplified are terminal.
///
/// `on_triangles` hears how many triangles each group consumed. The mesh must be valid: nothing is
/// checked on the other side.
pub(crate) fn simplify_to_groups(
    indices: &[u32],
    input: &SimplifierInput,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> Vec<RawGroup> {
    let mut groups: Vec<RawGroup> = Vec::new();
    run(indices, input, config, |group, clusters| {
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
/// follows: what a bake's speed is compared with. `mesh` must be valid.
#[doc(hidden)]
pub fn bare_clusterlod(mesh: &SourceMesh, config: &BakeConfig) -> usize {
    let input = SimplifierInput::of(mesh, config);
    let mut triangles = 0;
    run(&mesh.indices, &input, config, |_, clusters| {
        triangles += clusters.iter().map(|c| c.indices.len() / 3).sum::<usize>();
        0
    });
    triangles
}

fn run(
    indices: &[u32],
    input: &SimplifierInput,
    config: &BakeConfig,
    output: impl FnMut(ClodGroup, &[ClodCluster<'_>]) -> i32,
) {
    let vertices = input.vertices();
    let mesh = ClodMesh {
        indices,
        vertices: &vertices,
        vertex_attributes: &input.attributes,
        vertex_attributes_stride: input.attribute_stride(),
        vertex_lock: Some(&input.locks),
        attribute_weights: &input.weights,
        attribute_protect_mask: input.protect_mask,
    };
    let config = ClodConfig {
        cluster_spatial: input.is_crowded,
        partition_size: config.group_clusters,
        // Neighbouring groups follow each other, so that a part of the mesh is a part of the file.
        partition_sort: true,
        simplify_ratio: config.simplify_ratio,
        simplify_threshold: config.stuck_ratio,
        simplify_fallback_sloppy: config.sloppy_fallback,
        ..meshopt::clod_default_config(config.cluster_triangles)
    };
    meshopt::clod_build(config, &mesh, output);
}

fn split_by_producer(clusters: &[ClodCluster<'_>]) -> Vec<RawUnit> {
    let mut units: BTreeMap<u32, Vec<Vec<u32>>> = BTreeMap::new();
    for cluster in clusters {
        let produced_by = u32::try_from(cluster.refined).unwrap_or(NO_GROUP);
        let of_producer = units.entry(produced_by).or_default();
        of_producer.push(cluster.indices.to_vec());
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
    let producers = units.iter().filter(|unit| !unit.is_source());
    producers
        .map(|unit| finer[unit.produced_by as usize].error_in_local)
        .fold(own.max(0.0), f32::max)
}
