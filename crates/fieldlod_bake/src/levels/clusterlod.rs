//! meshoptimizer's clusterlod as it is: what levels and their building are compared with.

use fieldlod_hierarchy::{Hierarchy, NO_GROUP};
use meshopt::{ClodCluster, ClodConfig, ClodGroup, ClodMesh, clod_default_config};

use crate::config::BakeConfig;
use crate::levels::assemble::assemble;
use crate::levels::clusters::Cluster;
use crate::levels::groups::Groups;
use crate::levels::vertices::{LevelVertices, adapter};
use crate::mesh::{MeshError, SourceMesh};

/// How much clusterlod's demo weighs a change of the unit normal by 1.
const NORMAL_WEIGHT: f32 = 0.5;

/// The hierarchy that clusterlod builds on its own: the baseline for levels.
///
/// Clusters and groups are of the size that `config` says, and the first texture coordinates count
/// as it says; all else is clusterlod's default. Its vertices are those of the mesh. Groups that it
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
    let vertices = vertices_of(mesh, config);
    let groups = build_groups(mesh, &vertices, config);
    let hierarchy = assemble(mesh, vertices, &groups.0);
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    Ok(hierarchy)
}

/// How many triangles clusterlod makes of `mesh` on its own, as for [`clusterlod_hierarchy`]: what
/// the speed of a bake is compared with. `mesh` must be valid.
#[doc(hidden)]
pub fn bare_clusterlod(mesh: &SourceMesh, config: &BakeConfig) -> usize {
    let mut triangles = 0;
    build(mesh, &vertices_of(mesh, config), config, |_, clusters| {
        triangles += clusters.iter().map(|c| c.indices.len() / 3).sum::<usize>();
        0
    });
    triangles
}

/// Positions, normals and first texture coordinates, all that clusterlod's demo knows.
fn vertices_of(mesh: &SourceMesh, config: &BakeConfig) -> LevelVertices {
    let known = SourceMesh {
        positions: mesh.positions.clone(),
        normals: mesh.normals.clone(),
        uvs: mesh.uvs.clone(),
        indices: mesh.indices.clone(),
        ..SourceMesh::default()
    };
    let config = BakeConfig {
        normal_weight: NORMAL_WEIGHT,
        ..config.clone()
    };
    LevelVertices::of(&known, &config)
}

/// The groups of all levels, finer before coarser; those that were not simplified are terminal.
fn build_groups(mesh: &SourceMesh, vertices: &LevelVertices, config: &BakeConfig) -> Groups {
    let mut groups = Groups::default();
    let mut is_simplified: Vec<bool> = Vec::new();
    build(mesh, vertices, config, |group, clusters| {
        let clusters: Vec<Cluster> = clusters.iter().map(cluster).collect();
        for producer in clusters.iter().map(|cluster| cluster.produced_by) {
            if producer != NO_GROUP {
                is_simplified[producer as usize] = true;
            }
        }
        is_simplified.push(false);
        // No less than the errors of the finer groups, or a cut could draw two levels of one place.
        let own = (group.simplified.error * vertices.local_from_scaled).min(f32::MAX);
        let finer = groups.finer_of(&clusters).map(|finer| finer.error_in_local);
        let error_in_local = finer.fold(own.max(0.0), f32::max);
        groups.add(clusters, error_in_local, f32::INFINITY, 0..0) as i32
    });
    // What nothing came of stands for itself.
    let groups_and_ends = groups.0.iter_mut().zip(is_simplified);
    for (group, _) in groups_and_ends.filter(|(_, is_simplified)| !is_simplified) {
        group.error_in_local = f32::INFINITY;
    }
    groups
}

fn cluster(cluster: &ClodCluster<'_>) -> Cluster {
    Cluster {
        produced_by: u32::try_from(cluster.refined).unwrap_or(NO_GROUP),
        corners: cluster.indices.to_vec(),
        places: Vec::new(),
    }
}

fn build(
    mesh: &SourceMesh,
    vertices: &LevelVertices,
    config: &BakeConfig,
    output: impl FnMut(ClodGroup, &[ClodCluster<'_>]) -> i32,
) {
    let count = vertices.positions.len() as u32;
    let rows: Vec<f32> = (0..count)
        .flat_map(|vertex| vertices.row(vertex))
        .copied()
        .collect();
    let clod = ClodMesh {
        indices: &mesh.indices,
        vertices: &adapter(&vertices.positions),
        vertex_attributes: &rows,
        vertex_attributes_stride: vertices.layout.width() * size_of::<f32>(),
        vertex_lock: Some(&vertices.protection),
        attribute_weights: &vertices.layout.weights,
        attribute_protect_mask: 0,
    };
    let config = ClodConfig {
        partition_size: config.group_clusters,
        ..clod_default_config(config.cluster_triangles)
    };
    meshopt::clod_build(config, &clod, output);
}
