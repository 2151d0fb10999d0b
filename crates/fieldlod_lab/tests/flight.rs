//! A flight towards a plant, frame by frame: how much a change of its level is seen.

mod common;

use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_lab::props;

/// What is wished for is a ratio of 1.5 and a step of 0.02; the worst of these crowns are 1.64 and 0.016.
#[test]
fn changes_of_a_crowns_level_are_small() {
    let Some((renderer, _one)) = common::renderer() else {
        return;
    };
    let mut flights = Vec::new();
    for (leaves, seed) in [(1500, 1), (1500, 2), (4000, 1)] {
        let crown = fixtures::crown(leaves, seed);
        let baked = bake_mesh(&crown, &BakeConfig::default()).unwrap();
        let frames = props::fly(&renderer, &baked).unwrap();
        flights.push((format!("crown {leaves} {seed}"), props::pops(&frames)));
    }
    println!("{}", props::pop_table(&flights));
    let pops: Vec<_> = flights.into_iter().flat_map(|(_, pops)| pops).collect();
    assert!(pops.len() >= 4, "{pops:?}");
    for pop in &pops {
        assert!(pop.triangles[0] < pop.triangles[1], "{pop:?}");
        assert!((1.0 / 1.75..=1.75).contains(&pop.flip_ratio), "{pop:?}");
        assert!(pop.area_step.abs() <= 0.02, "{pop:?}");
    }
}
