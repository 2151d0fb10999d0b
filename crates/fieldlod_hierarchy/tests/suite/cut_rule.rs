//! Compares the methods of the cut rule to a literal implementation.

use fieldlod_hierarchy::Hierarchy;
use fieldlod_hierarchy::fixtures::{self, Random};
use proptest::prelude::*;

/// A group is refined if it is marked, terminal, or has a refined finer group.
fn is_refined(hierarchy: &Hierarchy, marked: &[bool], group: usize) -> bool {
    let data = &hierarchy.groups[group];
    let mut finer = hierarchy.finer_groups(data).iter();
    data.is_terminal()
        || marked[group]
        || finer.any(|&finer| is_refined(hierarchy, marked, finer as usize))
}

proptest! {
    #[test]
    fn drawn_units_follow_the_cut_rule(seed: u64, percent in 0usize..=100) {
        let hierarchy = fixtures::grid_pyramid(3);
        let mut random = Random::new(seed);
        let groups = 0..hierarchy.groups.len();
        let marked: Vec<bool> = groups.clone().map(|_| random.index(100) < percent).collect();
        let expected: Vec<bool> = groups.map(|g| is_refined(&hierarchy, &marked, g)).collect();
        let mut refined = marked.clone();
        hierarchy.close_refinement(&mut refined);
        prop_assert_eq!(&refined, &expected);
        let drawn: Vec<usize> = hierarchy.drawn_units(&refined).collect();
        let by_rule = (0..hierarchy.units.len()).filter(|&unit| {
            let unit = &hierarchy.units[unit];
            let producer = unit.producer().map(|group| refined[group as usize]);
            refined[unit.consumed_by as usize] && producer != Some(true)
        });
        prop_assert_eq!(drawn, by_rule.collect::<Vec<_>>());
    }
}

#[test]
fn fixtures_are_valid_and_have_the_source_hash() {
    for hierarchy in [fixtures::two_level_strip(), fixtures::grid_pyramid(2)] {
        hierarchy.validate().unwrap();
        let source: Vec<usize> = hierarchy.source_units().collect();
        let triangles = source.iter().map(|&unit| &hierarchy.units[unit]);
        let triangles = triangles.flat_map(|unit| hierarchy.triangles_of(unit));
        let indices: Vec<u32> = triangles.flatten().collect();
        assert_eq!(indices.len() as u64, hierarchy.source_triangle_count() * 3);
        let hash = hierarchy.source_vertices().source_hash(&indices);
        assert_eq!(hash, hierarchy.source);
    }
}
