//! Keeps the surface whole where the simplifier gives up on a part of it.
//!
//! clusterlod locks the vertices between the groups of one level. A group that is stuck, however,
//! leaves the game: at the next level its neighbours take the edge towards it for an open border,
//! simplify that, and a crack opens. So after a build the vertices between stuck groups and others
//! are collected, and the mesh is built again with those locked at all levels. They survived up to
//! the stuck group's level anyway, so that up to there little changes.

use meshopt::ClodConfig;

use crate::clusterlod::build_groups;
use crate::config::BakeConfig;
use crate::groups::RawGroup;
use crate::input::SimplifierInput;

/// Builds after which the levels above the first stuck group are given up.
const MAX_BUILDS: usize = 8;

/// The groups of the mesh with these `indices`, finer before coarser, in which every cut is as
/// closed as the source.
pub(crate) fn simplify_watertight(
    indices: &[u32],
    input: &mut SimplifierInput,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> Vec<RawGroup> {
    let mut builds = 1;
    loop {
        let mut groups = build_groups(indices, input, clod_config(input, config), on_triangles);
        let Some(torn) = Torn::find(&groups, input) else {
            return groups;
        };
        if builds == MAX_BUILDS {
            cut_off_above(&mut groups, torn.lowest_level);
            return groups;
        }
        input.lock_positions(&torn.vertices);
        builds += 1;
    }
}

fn clod_config(input: &SimplifierInput, config: &BakeConfig) -> ClodConfig {
    ClodConfig {
        cluster_spatial: input.is_crowded,
        partition_size: config.group_clusters,
        // Neighbouring groups follow each other, so that a part of the mesh is a part of the file.
        partition_sort: true,
        simplify_ratio: config.simplify_ratio,
        simplify_threshold: config.stuck_ratio,
        simplify_fallback_sloppy: config.sloppy_fallback,
        ..meshopt::clod_default_config(config.cluster_triangles)
    }
}

/// Where cracks may open.
struct Torn {
    /// Vertices between a stuck group and one that was simplified, and not locked.
    vertices: Vec<u32>,
    /// The lowest level at which there are such vertices.
    lowest_level: u32,
}

impl Torn {
    fn find(groups: &[RawGroup], input: &SimplifierInput) -> Option<Self> {
        let mut vertices = Vec::new();
        let mut lowest_level = None;
        for level in groups.chunk_by(|a, b| a.level == b.level) {
            let between = vertices_between(level, input);
            if !between.is_empty() {
                lowest_level = lowest_level.or(Some(level[0].level));
            }
            vertices.extend(between);
        }
        lowest_level.map(|lowest_level| Self {
            vertices,
            lowest_level,
        })
    }
}

/// The vertices that stuck and simplified groups of one level share, apart from locked ones.
fn vertices_between(level: &[RawGroup], input: &SimplifierInput) -> Vec<u32> {
    let (stuck, simplified): (Vec<_>, Vec<_>) = level.iter().partition(|group| group.is_terminal());
    if stuck.is_empty() || simplified.is_empty() {
        return Vec::new();
    }
    let mut is_stuck = vec![false; input.positions.len()];
    for vertex in stuck.iter().flat_map(|group| group.vertices()) {
        is_stuck[input.same_position[vertex as usize] as usize] = true;
    }
    let shared = simplified.iter().flat_map(|group| group.vertices());
    shared
        .filter(|&vertex| is_stuck[input.same_position[vertex as usize] as usize])
        .filter(|&vertex| !input.is_locked(vertex))
        .collect()
}

/// Makes `level` the coarsest. Nothing above means no neighbours that could tear off.
fn cut_off_above(groups: &mut Vec<RawGroup>, level: u32) {
    groups.retain(|group| group.level <= level);
    for group in groups.iter_mut().filter(|group| group.level == level) {
        group.error_in_local = f32::INFINITY;
    }
}
