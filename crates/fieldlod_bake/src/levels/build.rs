//! Builds levels: clusters are gathered in groups, each group is simplified, and the result is split into clusters.
//! This repeats until a dozen triangles are left, or nothing can be simplified.

use crate::config::BakeConfig;
use crate::deviation::SourceSurface;
use crate::levels::clusters::{clusters_of_source, partition, shared_positions, triangle_count};
use crate::levels::groups::Groups;
use crate::levels::simplified_group::emit;
use crate::levels::step::LevelStep;
use crate::levels::vertices::LevelVertices;
use crate::mesh::SourceMesh;
use crate::plants::plant::Plant;
use crate::progress::Progress;
use crate::report::BakeReport;

/// Simplification ends at this number of triangles: a coarser level would still need one draw call.
const MIN_TRIANGLES: usize = 12;
/// Group size grows by this factor if a level is stuck: larger groups lock fewer vertices. At 2 or 8, nine props keep
/// their levels.
const GROWTH: usize = 4;
/// A level that keeps more than this share of its triangles makes almost no progress. The next level is one group. At
/// 0.96 or 1, nine props keep their levels.
const STALLED_ABOVE: f32 = 0.98;

/// Builds the levels of `mesh`, and measures the deviation of each group from it. Finer groups come before coarser
/// groups. The last group is terminal and contains the remaining triangles. The mesh must be valid, because
/// meshoptimizer does not check it.
pub(crate) fn build_levels(
    mesh: &SourceMesh,
    vertices: &mut LevelVertices,
    config: &BakeConfig,
    progress: &Progress<'_>,
) -> (Groups, BakeReport) {
    let (mut clusters, source) = rayon::join(
        || clusters_of_source(&mesh.indices, vertices, config),
        || SourceSurface::of(mesh, vertices),
    );
    let mut groups = Groups::default();
    let mut report = BakeReport::default();
    let plant = Plant::of(mesh, &vertices.same_position);
    let mut group_clusters = config.group_clusters;
    while triangle_count(&clusters) > MIN_TRIANGLES {
        let before = triangle_count(&clusters);
        // Partition: neighbouring clusters are simplified together.
        let parts = partition(clusters, vertices, group_clusters);
        let is_whole = parts.len() == 1;
        let mut step = LevelStep {
            vertices,
            config,
            source: &source,
            groups: &groups,
            parts: &parts,
            // Lock: vertices that two groups share must stay.
            is_shared: shared_positions(&parts, vertices),
            // Plants: leaves keep their covered area.
            plant: plant.begin_level(&parts, vertices, config, report.has_aggregates),
        };
        // Simplify.
        let simplified = step.simplify();
        // Emit in the order of the groups: the result must not depend on the number of threads.
        clusters = emit(parts, simplified, &mut groups, vertices, &mut report);
        report.whole_mesh_levels += usize::from(is_whole);
        progress.add(before);
        // Stuck: the next level tries larger groups.
        let left = triangle_count(&clusters);
        if left as f32 > before as f32 * config.stuck_ratio {
            if is_whole {
                break;
            }
            group_clusters = larger_groups(group_clusters, left, before);
        }
    }
    groups.add_terminal(clusters);
    (groups, report)
}

/// Group size after a stuck level. If progress stalls, all clusters become one group.
fn larger_groups(group_clusters: usize, left: usize, before: usize) -> usize {
    if left as f32 <= before as f32 * STALLED_ABOVE {
        group_clusters * GROWTH
    } else {
        usize::MAX
    }
}
