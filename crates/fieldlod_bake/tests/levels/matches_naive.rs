//! Compares the deviations of a bake with brute-force deviations.

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, bake_mesh_with_report, fixtures, naive};
use fieldlod_hierarchy::Hierarchy;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Rows of samples on each triangle of both surfaces.
const ROWS: u32 = 5;
/// The margin that the bake adds.
const MARGIN: f64 = 1.05;
/// Limit for measured / stated deviations, as in `verify`.
const BEYOND: f64 = 1.05;
/// Limit for stated / measured deviations without the margin. Densely refined parts may stop at a triangle that is near
/// enough instead of the nearest.
const ABOVE: f64 = 1.32;
/// The same limit for the group with the smallest ratio.
const AT_BEST_ABOVE: f64 = 1.06;

fn small_mesh() -> impl Strategy<Value = SourceMesh> {
    let bumps = || proptest::collection::vec(-1.0f32..1.0, 16);
    let shape = prop_oneof![
        (0u32..1000).prop_map(|seed| fixtures::rock(2, seed)),
        Just(fixtures::height_field(12)),
        Just(fixtures::torus_knot(40, 5)),
    ];
    // Vertices move at random, so that each mesh has other sample positions.
    (shape, bumps(), 0.0f32..0.05).prop_map(|(mut mesh, bumps, strength)| {
        for (index, position) in mesh.positions.iter_mut().enumerate() {
            *position *= 1.0 + strength * bumps[index * 7 % bumps.len()];
        }
        // Torn textures would raise the stated deviation.
        mesh.uvs.clear();
        mesh
    })
}

fn small_groups() -> BakeConfig {
    BakeConfig {
        cluster_triangles: 16,
        group_clusters: 4,
        ..BakeConfig::default()
    }
}

fn stated(hierarchy: &Hierarchy) -> impl Iterator<Item = f64> + '_ {
    let groups = hierarchy.groups.iter();
    groups.map(|group| f64::from(group.deviation_in_local))
}

/// The largest value of each level, without terminal groups.
fn by_level(hierarchy: &Hierarchy, values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut largest = vec![0.0f64; hierarchy.level_count() as usize];
    for (group, value) in hierarchy.groups.iter().zip(values) {
        if !group.is_terminal() {
            let largest = &mut largest[group.level as usize];
            *largest = largest.max(value);
        }
    }
    largest
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10, failure_persistence: None, rng_seed: RngSeed::Fixed(4), ..ProptestConfig::default() })]

    /// With one group per level, every sample belongs to that group.
    #[test]
    fn whole_meshes_match_naive_deviations(mesh in small_mesh()) {
        let (hierarchy, report) = bake_mesh_with_report(&mesh, &BakeConfig::default()).unwrap();
        let found = naive::deviations(&hierarchy, ROWS).in_both_directions(&hierarchy);
        let pairs = stated(&hierarchy).zip(found).filter(|(_, found)| found.is_finite());
        let mut shares: Vec<f64> = pairs.map(|(stated, found)| stated / found).collect();
        shares.sort_by(f64::total_cmp);
        prop_assert!(shares.len() >= 3, "{report:?}");
        prop_assert!(shares[0] * BEYOND >= 1.0, "{shares:?}");
        prop_assert!(shares[shares.len() - 1] <= MARGIN * ABOVE, "{shares:?}");
        // For this group, both find the same farthest point.
        prop_assert!(shares[0] <= MARGIN * AT_BEST_ABOVE, "{shares:?}");
    }

    #[test]
    fn groups_stay_within_stated_deviation(mesh in small_mesh()) {
        let hierarchy = bake_mesh(&mesh, &small_groups()).unwrap();
        let found = naive::deviations(&hierarchy, ROWS);
        for (stated, found) in stated(&hierarchy).zip(&found.from_simplified) {
            prop_assert!(stated * BEYOND >= *found, "{stated} for {found}");
        }
        let found = found.in_both_directions(&hierarchy).into_iter();
        let levels = by_level(&hierarchy, stated(&hierarchy));
        for (stated, found) in levels.into_iter().zip(by_level(&hierarchy, found)) {
            prop_assert!(stated * BEYOND >= found, "{stated} for {found}");
        }
    }
}
