//! A plain reading of the cut rule and of what "no holes" means, to hold bakes against.

#![allow(dead_code, reason = "each suite uses its part")]

pub(crate) mod gltf_file;

use std::collections::HashMap;

use fieldlod_hierarchy::Hierarchy;
use glam::Vec3;

/// The triangles, as source vertices, of the cut that refines the groups for which `criterion`
/// holds: the rule on [`Hierarchy`], word for word.
pub(crate) fn cut(hierarchy: &Hierarchy, criterion: impl Fn(usize) -> bool) -> Vec<[u32; 3]> {
    let refined = refined_groups(hierarchy, criterion);
    let is_drawn = |unit: &&fieldlod_hierarchy::Unit| {
        let consumer_refined = refined[unit.consumed_by as usize];
        let producer_refined = unit.producer().is_some_and(|group| refined[group as usize]);
        consumer_refined && !producer_refined
    };
    let drawn = hierarchy.units.iter().filter(is_drawn);
    drawn
        .flat_map(|unit| hierarchy.source_triangles_of(unit))
        .collect()
}

fn refined_groups(hierarchy: &Hierarchy, criterion: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut refined = Vec::with_capacity(hierarchy.groups.len());
    for (index, group) in hierarchy.groups.iter().enumerate() {
        let finer = hierarchy.finer_groups(group);
        let finer_refined = finer.iter().any(|&finer| refined[finer as usize]);
        refined.push(group.is_terminal() || finer_refined || criterion(index));
    }
    refined
}

/// A criterion that looks random and is not: a hash of group and seed, true for about `percent`.
pub(crate) fn random_criterion(seed: u64, percent: u64) -> impl Fn(usize) -> bool {
    move |group| {
        let mut bits = (group as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (seed << 7);
        bits = (bits ^ (bits >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (bits >> 33) % 100 < percent
    }
}

/// Refines the groups whose error is above `threshold`.
pub(crate) fn error_criterion(hierarchy: &Hierarchy, threshold: f32) -> impl Fn(usize) -> bool {
    move |group| hierarchy.groups[group].error_in_local > threshold
}

/// Vertices at one place count as one: index of the first at each place.
pub(crate) fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut first_at: HashMap<[u32; 3], u32> = HashMap::new();
    let bits = |p: &Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let vertices = positions.iter().enumerate();
    vertices
        .map(|(v, p)| *first_at.entry(bits(p)).or_insert(v as u32))
        .collect()
}

/// The edges, by welded vertices, that are not matched by as many in the opposite direction: how
/// many more there are from the first to the second.
pub(crate) fn open_edges(triangles: &[[u32; 3]], weld: &[u32]) -> HashMap<(u32, u32), i32> {
    let mut surplus: HashMap<(u32, u32), i32> = HashMap::new();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| weld[v as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let sign = if from < to { 1 } else { -1 };
            *surplus.entry((from.min(to), from.max(to))).or_default() += sign;
        }
    }
    surplus.retain(|&(from, to), count| from != to && *count != 0);
    surplus
}
