//! The levels above the last cluster: the whole mesh at once, on down to a dozen triangles.
//!
//! Nothing needs to be locked here, since nothing is left beside. So this is also the way out for
//! what is stuck: pieces in all groups that could not be simplified on their own.

mod area;

use meshopt::SimplifyVertex;

use self::area::keep_area;
use crate::groups::{Cluster, Groups, triangle_count};
use crate::report::{BakeReport, Fallback, FallbackKind};
use crate::simplify::{Simplified, Simplifier, SimplifyMode};

/// Where the tail ends.
const FEWEST_TRIANGLES: usize = 12;
/// What opens closed surfaces is the lesser evil above this only.
const MOST_TRIANGLES: usize = 512;
/// Keeps a unit's vertices within the reach of 16-bit indices: 256 at most in a cluster.
const MOST_CLUSTERS_IN_A_UNIT: usize = 128;

/// Goes on simplifying `clusters` as a whole, and adds the terminal group at the end.
pub(crate) fn simplify_tail(
    simplifier: &Simplifier<'_>,
    mut clusters: Vec<Cluster>,
    groups: &mut Groups,
    report: &mut BakeReport,
) {
    let mut error_in_local = 0.0f32;
    while triangle_count(&clusters) > FEWEST_TRIANGLES {
        let corners: Vec<u32> = clusters
            .iter()
            .flat_map(|cluster| &cluster.corners)
            .copied()
            .collect();
        let Some((simplified, mode)) = simplify_whole(simplifier, &corners) else {
            break;
        };
        let (from, to) = (corners.len() / 3, simplified.corners.len() / 3);
        let least = simplifier.wrong_texture_in_scaled(&simplified, mode);
        let [least, own] = [least, simplified.error_in_scaled.max(least)]
            .map(|length| (length * simplifier.input.local_from_scaled).min(f32::MAX));
        error_in_local = error_in_local.max(own);
        let group = groups.add(clusters, error_in_local, MOST_CLUSTERS_IN_A_UNIT);
        groups.0[group as usize].deviation_in_local = least;
        if let Some(kind) = kind_of(mode) {
            report.fallbacks.push(Fallback {
                kind,
                group,
                from,
                to,
            });
        }
        clusters = simplifier.clusterize(&simplified.corners, group);
        report.whole_mesh_levels += 1;
    }
    report.coarsest_triangles = triangle_count(&clusters);
    groups.add(clusters, f32::INFINITY, MOST_CLUSTERS_IN_A_UNIT);
}

fn kind_of(mode: SimplifyMode) -> Option<FallbackKind> {
    match mode {
        SimplifyMode::Careful | SimplifyMode::ShapeOnly => None,
        SimplifyMode::Prune => Some(FallbackKind::Pruned),
        SimplifyMode::PositionsOnly => Some(FallbackKind::AttributesIgnored),
        SimplifyMode::Sloppy => Some(FallbackKind::Sloppy),
    }
}

/// By the gentlest mode that gets anywhere.
fn simplify_whole(
    simplifier: &Simplifier<'_>,
    corners: &[u32],
) -> Option<(Simplified, SimplifyMode)> {
    let triangles = corners.len() / 3;
    let wanted = (triangles as f32 * simplifier.config.simplify_ratio) as usize;
    let target = wanted.max(FEWEST_TRIANGLES.min(triangles / 2)) * 3;
    let mut locks = simplifier.input.locks.clone();
    for mode in [
        SimplifyMode::Careful,
        SimplifyMode::Prune,
        SimplifyMode::PositionsOnly,
        SimplifyMode::Sloppy,
    ] {
        if mode == SimplifyMode::Sloppy && triangles <= MOST_TRIANGLES {
            return None;
        }
        if mode == SimplifyMode::PositionsOnly {
            locks.fill(SimplifyVertex::empty());
        }
        let simplified = simplifier.simplify(corners, &locks, target, mode);
        let enough = triangles > MOST_TRIANGLES || !vanishes(&simplified);
        if !simplifier.is_coarser(&simplified, corners.len()) || !enough {
            continue;
        }
        let simplified = match mode {
            SimplifyMode::Careful => keep_area(simplifier, corners, target, simplified),
            _ => simplified,
        };
        return Some((simplified, mode));
    }
    None
}

/// Whether only a token is left: a single triangle stands for little.
fn vanishes(simplified: &Simplified) -> bool {
    simplified.corners.len() <= 3
}
