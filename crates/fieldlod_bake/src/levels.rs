//! The levels: clusterlod's groups, then the [tail](crate::tail) above what it leaves.

use crate::config::BakeConfig;
use crate::groups::{Cluster, Groups, RawGroup};
use crate::input::SimplifierInput;
use crate::report::BakeReport;
use crate::simplify::Simplifier;
use crate::tail::simplify_tail;
use crate::watertight::simplify_watertight;

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
