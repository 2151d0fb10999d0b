//! The hierarchy of meshoptimizer's unmodified clusterlod, as a baseline.

use fieldlod_hierarchy::{Hierarchy, NO_GROUP};
use meshopt::{ClodCluster, ClodConfig, ClodGroup, ClodMesh, clod_default_config};

use crate::config::BakeConfig;
use crate::levels::assemble::assemble;
use crate::levels::clusters::Cluster;
use crate::levels::groups::Groups;
use crate::levels::vertices::LevelVertices;
use crate::mesh::adapter;
use crate::mesh::surfaces::Surfaces;
use crate::mesh::topology::Topology;
use crate::mesh::{MeshError, SourceMesh};

/// Weight of a unit normal in clusterlod's demo.
const NORMAL_WEIGHT: f32 = 0.5;

/// Builds the hierarchy of clusterlod alone, as a baseline for levels.
///
/// `config` sets the size of clusters and groups; everything else is clusterlod's default. Vertices are the vertices of
/// the mesh. A group that clusterlod cannot simplify stays terminal, and cuts may be open beside it. Errors are
/// clusterlod's; deviations are not measured.
///
/// # Errors
/// The errors of [`bake_mesh`](crate::bake_mesh).
pub fn clusterlod_hierarchy(
    mesh: &SourceMesh,
    config: &BakeConfig,
) -> Result<Hierarchy, MeshError> {
    config.validate()?;
    mesh.validate()?;
    let vertices = vertices_of(mesh);
    let groups = build_groups(mesh, &vertices, config);
    let hierarchy = assemble(mesh, vertices, &groups.0);
    debug_assert_eq!(hierarchy.validate(), Ok(()));
    Ok(hierarchy)
}

/// Runs clusterlod alone, for speed comparisons. Returns the number of triangles of all levels. `mesh` must be valid.
#[must_use]
pub fn bare_clusterlod(mesh: &SourceMesh, config: &BakeConfig) -> usize {
    let mut triangles = 0;
    build(mesh, &vertices_of(mesh), config, |_, clusters| {
        triangles += clusters.iter().map(|c| c.indices.len() / 3).sum::<usize>();
        0
    });
    triangles
}

/// Vertices with the attributes of clusterlod's demo: positions, normals and first texture coordinates.
fn vertices_of(mesh: &SourceMesh) -> LevelVertices {
    let mut known = mesh.clone();
    known.tangents.clear();
    known.uvs_1.clear();
    known.colors.clear();
    LevelVertices::of(
        &known,
        Topology::exact(mesh),
        Surfaces::default(),
        NORMAL_WEIGHT,
    )
}

/// Groups of all levels, finer before coarser. Groups that were not simplified are terminal.
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
        // Errors must not shrink towards coarser groups. Otherwise, a cut could draw two levels of the same surface.
        let own = (group.simplified.error * vertices.local_from_scaled).min(f32::MAX);
        let finer = groups.finer_of(&clusters).map(|finer| finer.error_in_local);
        let error_in_local = finer.fold(own.max(0.0), f32::max);
        groups.add(clusters, error_in_local, f32::INFINITY, 0..0) as i32
    });
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
        samples: Vec::new(),
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
