//! Triangle budgets are kept, used up and recovered from.

mod common;

use common::world::{Placed, World, step_of_walk};
use common::{look, perspective};
use fieldlod_select::{LodSettings, Selector, View};
use glam::{Affine3A, Vec3};

fn forest() -> World {
    World::forest(3, 20, 3.0)
}

fn triangles_without_budget(world: &World, view: &View) -> u64 {
    world.select(view, &LodSettings::default()).triangle_count()
}

/// A budget is used up unless the thresholds need less, and never exceeded.
fn assert_kept(world: &World, view: &View, selector: &Selector, budget: u64) {
    let count = selector.triangle_count();
    assert!(count <= budget, "{count} of {budget}");
    let threshold_px = selector.threshold_px().unwrap();
    assert!(threshold_px >= 1.0, "{threshold_px}");
    let wanted = budget.min(triangles_without_budget(world, view));
    assert!(count as f64 > 0.9 * wanted as f64, "{count} of {wanted}");
}

#[test]
fn budget_is_kept_along_walk_with_few_thresholds() {
    let world = forest();
    let free = triangles_without_budget(&world, &step_of_walk(0));
    for share in [0.5, 0.7, 0.9] {
        let budget = (free as f64 * share) as u64;
        let settings = LodSettings::with_triangle_budget(budget);
        let mut selector = Selector::default();
        let (mut thresholds, mut last) = (0, None);
        for step in 0..120 {
            let view = step_of_walk(step);
            selector.select(&world.scene, &view, &settings);
            assert_kept(&world, &view, &selector, budget);
            thresholds += usize::from(last != selector.threshold_px());
            last = selector.threshold_px();
        }
        assert!(thresholds < 40, "{budget}: {thresholds} thresholds");
    }
}

#[test]
fn budget_is_kept_after_jumps_zooms_and_new_budgets() {
    let world = forest();
    let mut selector = Selector::default();
    for (eye, fov_y) in [
        (Vec3::new(5.0, 1.5, 4.0), 1.0),
        (Vec3::new(30.0, 9.0, -20.0), 1.0),
        (Vec3::new(5.0, 1.5, 4.0), 0.4),
        (Vec3::new(55.0, 3.0, -3.0), 1.3),
    ] {
        for budget in [100_000, 200_000, 400_000, 900_000] {
            let settings = LodSettings::with_triangle_budget(budget);
            for frame in 0..20u8 {
                let sway = Vec3::X * (f32::from(frame % 4) * 0.01);
                let view = look(perspective(fov_y), eye + sway, Vec3::new(28.0, 0.0, -30.0));
                selector.select(&world.scene, &view, &settings);
                if frame > 2 {
                    assert_kept(&world, &view, &selector, budget);
                }
            }
        }
    }
}

#[test]
fn unreachable_budget_is_rarely_searched_and_recovers() {
    let world = forest();
    let mut selector = Selector::default();
    // The coarsest levels have more triangles.
    let settings = LodSettings::with_triangle_budget(10);
    let mut searches = 0;
    for step in 0..60 {
        selector.select(&world.scene, &step_of_walk(step), &settings);
        searches += usize::from(selector.statistics().budget_tries > 0);
    }
    assert!(searches <= 4, "{searches}");
    assert_eq!(selector.threshold_px(), Some(f32::INFINITY));
    let settings = LodSettings::with_triangle_budget(200_000);
    let view = step_of_walk(60);
    for _ in 0..3 {
        selector.select(&world.scene, &view, &settings);
    }
    assert_kept(&world, &view, &selector, 200_000);
}

#[test]
fn search_ends_with_few_large_groups() {
    let world = World::new(&[Placed::new(0, Affine3A::IDENTITY)]);
    let view = look(perspective(1.0), Vec3::Z * 3.0, Vec3::ZERO);
    let free = triangles_without_budget(&world, &view);
    for budget in (1..20).map(|step| free * step / 20) {
        let settings = LodSettings::with_triangle_budget(budget);
        let mut selector = Selector::default();
        // No later frame searches, because nothing moves.
        let searches = (0..100).map(|_| {
            selector.select(&world.scene, &view, &settings);
            selector.statistics().budget_tries
        });
        let late: usize = searches.skip(4).sum();
        assert_eq!(late, 0, "{budget}");
    }
}
