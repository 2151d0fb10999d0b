//! A flight towards a plant, frame by frame: no change of its level is a pop.

mod common;

use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_lab::props;

#[test]
fn no_change_of_a_crowns_level_pops() {
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
        assert!((1.0 / 1.5..=1.5).contains(&pop.flip_ratio), "{pop:?}");
        assert!(pop.area_step.abs() <= 0.02, "{pop:?}");
    }
}
