//! Meshes that are loaded in parts: only available groups are refined, and nothing is missing.

mod common;

use std::collections::{BTreeMap, BTreeSet};

use common::world::{Placed, World, step_of_walk};
use common::{hierarchies, look, perspective, vector};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{
    Cut, InstanceId, InstanceView, LodSettings, Selector, group_error_px, select,
};
use glam::{Affine3A, Vec3};
use proptest::prelude::*;

/// Whether a group is loaded, at random.
fn is_loaded(seed: u64, density: u64, group: u32) -> bool {
    let mixed = (u64::from(group) + 1).wrapping_mul(seed | 1) ^ seed;
    mixed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32 & 7 < density
}

/// The groups of the coarsest cut.
fn always_refined(hierarchy: &Hierarchy) -> Vec<bool> {
    let mut refined = vec![false; hierarchy.groups.len()];
    hierarchy.close_refinement(&mut refined);
    refined
}

/// The groups that may be refined: those of the coarsest cut, and loaded groups whose coarser groups may be refined.
fn available(hierarchy: &Hierarchy, is_loaded: impl Fn(u32) -> bool) -> Vec<bool> {
    let mut available = always_refined(hierarchy);
    for group in (0..available.len()).rev() {
        let consumes = |coarser: &usize| {
            let coarser = &hierarchy.groups[*coarser];
            hierarchy.finer_groups(coarser).contains(&(group as u32))
        };
        let mut coarser = (0..available.len()).filter(consumes);
        let is_reached = coarser.all(|coarser| available[coarser]);
        available[group] |= is_reached && is_loaded(group as u32);
    }
    available
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn cuts_skip_missing_groups_and_demand_lists_them(
        eyes in prop::collection::vec(vector(), 2..6),
        seeds in prop::collection::vec((any::<u64>(), 0u64..9), 6),
        error_px in 0.3f32..4.0,
    ) {
        let place = |index: usize| {
            let at = Vec3::X * (index as f32 * 3.0);
            Placed::new(index % 4, Affine3A::from_translation(at))
        };
        let mut world = World::new(&(0..8).map(place).collect::<Vec<_>>());
        let mut selector = Selector::default();
        let mut cuts: BTreeMap<InstanceId, (Cut, BTreeSet<u32>)> = BTreeMap::new();
        let settings = LodSettings::with_error_px(error_px);
        for (eye, &(seed, density)) in eyes.iter().zip(&seeds) {
            let view = look(perspective(1.0), *eye * 12.0 + Vec3::X * 10.0, Vec3::X * 9.0);
            let is_loaded = |group| is_loaded(seed, density, group);
            for &mesh in &world.meshes[..4] {
                world.scene.set_available(mesh, is_loaded);
            }
            selector.select(&world.scene, &view, &settings);
            for change in selector.changes() {
                let (_, followed) = cuts.entry(change.instance).or_default();
                prop_assert!(change.left.iter().all(|unit| followed.remove(unit)));
                prop_assert!(change.entered.iter().all(|&unit| followed.insert(unit)));
            }
            let mut demand: BTreeMap<InstanceId, Vec<(u32, Option<f32>)>> = BTreeMap::new();
            selector.demand(&world.scene, |one| {
                demand.entry(one.instance).or_default().push((one.group, one.missing_px));
            });
            for (id, placed) in &world.placed {
                let hierarchy = &hierarchies()[placed.mesh];
                let (cut, followed) = cuts.get_mut(id).unwrap();
                select(hierarchy, &placed.placement, &view, &settings, cut);
                let refined = cut.refined();
                let may = available(hierarchy, is_loaded);
                let both: Vec<bool> = refined.iter().zip(&may).map(|(a, b)| *a && *b).collect();
                let expected: Vec<u32> = hierarchy.drawn_units(&both).map(|unit| unit as u32).collect();
                prop_assert_eq!(selector.units(&world.scene, *id), &expected);
                prop_assert!(followed.iter().eq(&expected));
                // The demand lists the refined groups, and the errors of missing groups.
                let always = always_refined(hierarchy);
                let wide = InstanceView::new(&view.with_margins(&settings), &placed.placement);
                let wanted = (0..refined.len()).filter(|&group| refined[group] && !always[group]);
                let wanted = wanted.map(|group| {
                    // `demand` runs after the decision, so the group counts as refined.
                    let error = group_error_px(&hierarchy.groups[group], &wide, &settings, true);
                    (group as u32, (!may[group]).then_some(error))
                });
                prop_assert_eq!(demand.remove(id).unwrap_or_default(), wanted.collect::<Vec<_>>());
            }
        }
    }
}

#[test]
fn budget_counts_triangles_of_available_groups_only() {
    let mut world = World::new(&[Placed::new(0, Affine3A::IDENTITY)]);
    let half = hierarchies()[0].groups.len() as u32 / 2;
    world
        .scene
        .set_available(world.meshes[0], |group| group >= half);
    let view = look(perspective(1.0), Vec3::new(0.0, 0.3, 2.0), Vec3::ZERO);
    let fine = LodSettings::with_error_px(0.05);
    let all = world.select(&view, &fine).triangle_count();
    // A budget for all available groups changes nothing, and a smaller budget is kept.
    for (budget, least) in [(all, all), (all / 2, all / 4)] {
        let settings = LodSettings {
            triangle_budget: Some(budget),
            ..fine
        };
        let selector = world.select(&view, &settings);
        assert!((least..=budget).contains(&selector.triangle_count()));
        assert_eq!(selector.threshold_px() == fine.error_px, budget == all);
    }
}

#[test]
fn page_decides_only_instances_of_its_mesh() {
    let mut world = World::forest(5, 40, 3.0);
    world.add(&[Placed::new(
        0,
        Affine3A::from_translation(Vec3::new(6.0, 1.5, 0.0)),
    )]);
    world.scene.update();
    let (mesh, view) = (world.meshes[0], step_of_walk(0));
    let settings = LodSettings::with_error_px(0.1);
    let mut selector = world.select(&view, &settings);
    let group_count = hierarchies()[0].groups.len() as u32;
    let mut triangle_counts = Vec::new();
    // Pages arrive, coarse groups first, and leave.
    for loaded in (0..=group_count).rev().chain(1..=group_count) {
        world.scene.set_available(mesh, |group| group >= loaded);
        selector.select(&world.scene, &view, &settings);
        let near_a_change = world.select(&view, &settings).statistics();
        let decided = selector.statistics().instances_decided;
        assert!(decided < near_a_change.instances_decided / 4, "{decided}");
        triangle_counts.push(selector.triangle_count());
    }
    let middle = group_count as usize;
    assert!(triangle_counts[..=middle].is_sorted() && triangle_counts[middle] > triangle_counts[0]);
    triangle_counts.reverse();
    assert!(triangle_counts[..=middle].is_sorted());
}

#[test]
fn complete_mesh_becomes_coarse_without_its_pages() {
    for (mesh, forced_level) in [(0, None), (0, Some(0)), (5, None), (5, Some(0))] {
        let mut world = World::new(&[Placed::new(mesh, Affine3A::IDENTITY)]);
        let view = look(perspective(1.0), Vec3::new(0.0, 0.3, 9.0), Vec3::ZERO);
        let settings = LodSettings {
            forced_level,
            ..LodSettings::with_error_px(0.5)
        };
        let mut selector = world.select(&view, &settings);
        let complete = selector.triangle_count();
        for is_loaded in [false, true] {
            world.scene.set_available(world.meshes[mesh], |_| is_loaded);
            selector.select(&world.scene, &view, &settings);
            let fresh = world.select(&view, &settings);
            assert_eq!(world.cuts(&selector), world.cuts(&fresh));
            assert_eq!(selector.triangle_count() == complete, is_loaded);
        }
    }
}

#[test]
fn demand_skips_instance_that_was_never_selected() {
    let mut world = World::new(&[Placed::new(0, Affine3A::IDENTITY)]);
    world.scene.set_available(world.meshes[0], |_| false);
    let view = look(perspective(1.0), Vec3::new(0.0, 0.3, 2.0), Vec3::ZERO);
    let selector = world.select(&view, &LodSettings::with_error_px(0.05));
    let demand_of = |world: &World| {
        let mut count = 0;
        selector.demand(&world.scene, |_| count += 1);
        count
    };
    assert!(demand_of(&world) > 0);
    // The new instance takes the slot of the removed one.
    let removed = world.ids()[0];
    world.scene.remove(removed);
    world.scene.update();
    let mesh = world.meshes[0];
    world.scene.add_instance(mesh, Affine3A::IDENTITY, 1.0);
    world.scene.update();
    assert_eq!(demand_of(&world), 0);
}
