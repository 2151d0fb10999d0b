//! meshoptimizer's clusterlod as it is: what levels and their building are compared with.

use std::collections::BTreeMap;

use fieldlod_hierarchy::{Hierarchy, NO_GROUP};
use meshopt::{ClodCluster, ClodConfig, ClodGroup, ClodMesh, clod_default_config};

use crate::assemble::assemble;
use crate::config::BakeConfig;
use crate::groups::{RawGroup, RawUnit};
use crate::input::SimplifierInput;
use crate::mesh::{MeshError, SourceMesh};

/// How much clusterlod's demo weighs a change of the unit normal by 1.
const NORMAL_WEIGHT: f32 = 0.5;

/// The hierarchy that clusterlod builds on its own: the baseline for levels.
///
/// Clusters and groups are of the size that `config` says, and texture coordinates count as it
/// says; all else is clusterlod's default. Its vertices are those of the mesh. Groups that it
/// cannot simplify stay as they are for good, and a cut may be open beside them. Errors are what
/// clusterlod reports; deviations are left unmeasured.
///
/// # Errors
/// As [`bake_mesh`](crate::bake_mesh).
pub fn clusterlod_hierarchy(
    mesh: &SourceMesh,
    config: &BakeConfig,
) -> Result<Hierarchy, MeshError> {
    config.validate()?;
    mesh.validate()?;
    let input = SimplifierInput::of(mesh, &with_its_weight(config));
    let mut groups = build_groups(&mesh.indices, &input, its_config(config), &|_| ());
    // What nothing came of stands for itself.
    let mut is_simplified = vec![false; groups.len()];
    for unit in groups.iter().flat_map(|group| &group.units) {
        if !unit.is_source() {
            is_simplified[unit.produced_by as usize] = true;
        }
    }
    for (group, is_simplified) in groups.iter_mut().zip(is_simplified) {
        group.deviation_in_local = f32::INFINITY;
        if !is_simplified {
            group.error_in_local = f32::INFINITY;
        }
    }
    let hierarchy = assemble(mesh, &groups)?;
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    Ok(hierarchy)
}

/// How many triangles clusterlod makes of `mesh` on its own, as for [`clusterlod_hierarchy`]: what
/// the speed of a bake is compared with. `mesh` must be valid.
#[doc(hidden)]
pub fn bare_clusterlod(mesh: &SourceMesh, config: &BakeConfig) -> usize {
    let input = SimplifierInput::of(mesh, &with_its_weight(config));
    let mut triangles = 0;
    build(&mesh.indices, &input, its_config(config), |_, clusters| {
        triangles += triangle_count(clusters);
        0
    });
    triangles
}

fn with_its_weight(config: &BakeConfig) -> BakeConfig {
    BakeConfig {
        normal_weight: NORMAL_WEIGHT,
        ..config.clone()
    }
}

fn its_config(config: &BakeConfig) -> ClodConfig {
    ClodConfig {
        partition_size: config.group_clusters,
        ..clod_default_config(config.cluster_triangles)
    }
}

/// Clusters and simplifies the mesh with these `indices` level by level. Groups come finer before
/// coarser; those that cannot be simplified are terminal.
///
/// `on_triangles` hears how many triangles each group consumed. The mesh must be valid: nothing is
/// checked on the other side.
pub(crate) fn build_groups(
    indices: &[u32],
    input: &SimplifierInput,
    config: ClodConfig,
    on_triangles: &dyn Fn(usize),
) -> Vec<RawGroup> {
    let mut groups: Vec<RawGroup> = Vec::new();
    build(indices, input, config, |group, clusters| {
        let index = groups.len();
        let units = split_by_producer(clusters);
        on_triangles(triangle_count(clusters));
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

fn build(
    indices: &[u32],
    input: &SimplifierInput,
    config: ClodConfig,
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
    meshopt::clod_build(config, &mesh, output);
}

fn triangle_count(clusters: &[ClodCluster<'_>]) -> usize {
    clusters.iter().map(|c| c.indices.len() / 3).sum()
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
