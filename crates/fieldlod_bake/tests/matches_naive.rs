//! The bake's measuring against the plain way of measuring.

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, bake_mesh_with_report, fixtures, naive};
use fieldlod_hierarchy::Hierarchy;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Rows of samples on each triangle of either surface.
const ROWS: u32 = 5;
/// What a bake adds for places between its samples.
const MARGIN: f64 = 1.03;
/// By how much what is found may exceed what is stated, as `verify` allows.
const BEYOND: f64 = 1.05;
/// By how much what is stated may exceed what is found, margin apart. Not for what lies between the
/// samples: a bake may take a triangle that is near enough for the nearest.
const ABOVE: f64 = 1.35;
/// The same for the group that is measured best.
const AT_BEST_ABOVE: f64 = 1.08;

fn small_mesh() -> impl Strategy<Value = SourceMesh> {
    let bumps = || proptest::collection::vec(-1.0f32..1.0, 16);
    let shape = prop_oneof![
        (0u32..1000).prop_map(|seed| fixtures::rock(2, seed)),
        Just(fixtures::height_field(12)),
        Just(fixtures::torus_knot(40, 5)),
    ];
    // Vertices moved at random, so that no two meshes are measured at the same places.
    (shape, bumps(), 0.0f32..0.05).prop_map(|(mut mesh, bumps, strength)| {
        for (index, position) in mesh.positions.iter_mut().enumerate() {
            *position *= 1.0 + strength * bumps[index * 7 % bumps.len()];
        }
        // Where textures are torn, more is stated than is measured.
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

/// The largest of each level; groups that are not simplified are left out.
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
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, rng_seed: RngSeed::Fixed(4), ..ProptestConfig::default() })]

    /// Where a level has but one group, it is clear which place of the source is whose.
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
        // There, both find the same place.
        prop_assert!(shares[0] <= MARGIN * AT_BEST_ABOVE, "{shares:?}");
    }

    #[test]
    fn groups_hold_their_stated_deviation(mesh in small_mesh()) {
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
