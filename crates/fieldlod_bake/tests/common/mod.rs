//! Cuts of all kinds, and what "no holes" means, to check bakes against.

#![allow(dead_code, reason = "each suite uses its part")]

pub(crate) mod character;
pub(crate) mod gltf_file;

use std::collections::HashMap;

use fieldlod_hierarchy::Hierarchy;
use fieldlod_hierarchy::fixtures::Random;
use glam::Vec3;

/// The triangles, as source vertices, of the cut that refines the groups for which `criterion`
/// holds.
pub(crate) fn cut(
    hierarchy: &Hierarchy,
    mut criterion: impl FnMut(usize) -> bool,
) -> Vec<[u32; 3]> {
    let mut refined = vec![false; hierarchy.groups.len()];
    hierarchy.refine_by(&mut refined, |group, _| criterion(group));
    let drawn = hierarchy
        .drawn_units(&refined)
        .map(|unit| &hierarchy.units[unit]);
    drawn
        .flat_map(|unit| hierarchy.triangles_of(unit))
        .collect()
}

/// A criterion that is true for about `percent`, at random.
pub(crate) fn random_criterion(seed: u64, percent: usize) -> impl FnMut(usize) -> bool {
    let mut random = Random::new(seed);
    move |_| random.index(100) < percent
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
