//! Meshes that are loaded in parts: what is not at hand is not refined, and nothing is missing.

mod common;

use std::collections::{BTreeMap, BTreeSet};

use common::{hierarchies, look, perspective, vector};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{
    Cut, InstanceId, InstanceView, LodSettings, MeshId, Scene, Selector, group_error_px, select,
};
use glam::{Affine3A, Vec3};
use proptest::prelude::*;

/// Whether a group is at hand, at random.
fn is_at_hand(seed: u64, density: u64, group: u32) -> bool {
    let mixed = (u64::from(group) + 1).wrapping_mul(seed | 1) ^ seed;
    mixed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32 & 7 < density
}

/// The groups that may be refined, straight from the words: those that always are, and those at hand
/// whose coarser groups may be too.
fn available(hierarchy: &Hierarchy, at_hand: impl Fn(u32) -> bool) -> Vec<bool> {
    let mut available = vec![false; hierarchy.groups.len()];
    hierarchy.close_refinement(&mut available);
    for group in (0..available.len()).rev() {
        let consumes = |coarser: &&usize| {
            let coarser = &hierarchy.groups[**coarser];
            hierarchy.finer_groups(coarser).contains(&(group as u32))
        };
        let all: Vec<usize> = (0..available.len()).collect();
        let is_reached = all
            .iter()
            .filter(consumes)
            .all(|&coarser| available[coarser]);
        available[group] |= is_reached && at_hand(group as u32);
    }
    available
}

/// An instance, its last cut of all groups, and what its changes add up to.
struct Placed {
    mesh: usize,
    at: Affine3A,
    id: InstanceId,
    cut: Cut,
    units: BTreeSet<u32>,
}

fn placed(scene: &mut Scene, meshes: &[MeshId]) -> Vec<Placed> {
    let place = |index: usize| {
        let mesh = index % meshes.len();
        let at = Affine3A::from_translation(Vec3::new(index as f32 * 3.0, 0.0, 0.0));
        Placed {
            mesh,
            at,
            id: scene.add_instance(meshes[mesh], at, 1.0),
            cut: Cut::default(),
            units: BTreeSet::new(),
        }
    };
    (0..8).map(place).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn cuts_are_those_of_the_groups_at_hand(
        eyes in prop::collection::vec(vector(), 2..6),
        seeds in prop::collection::vec((any::<u64>(), 0u64..9), 6),
        error_px in 0.3f32..4.0,
    ) {
        let hierarchies = &hierarchies()[..4];
        let mut scene = Scene::default();
        let meshes: Vec<MeshId> = hierarchies.iter().map(|h| scene.add_mesh(h)).collect();
        let mut instances = placed(&mut scene, &meshes);
        scene.update();
        let mut selector = Selector::default();
        let settings = LodSettings::with_error_px(error_px);
        for (eye, &(seed, density)) in eyes.iter().zip(&seeds) {
            let view = look(perspective(1.0), *eye * 12.0 + Vec3::X * 10.0, Vec3::X * 9.0);
            let at_hand = |group| is_at_hand(seed, density, group);
            for &mesh in &meshes {
                scene.set_available(mesh, at_hand);
            }
            selector.select(&scene, &view, &settings);
            for change in selector.changes() {
                let instance = instances.iter_mut().find(|i| i.id == change.instance).unwrap();
                prop_assert!(change.left.iter().all(|unit| instance.units.remove(unit)));
                prop_assert!(change.entered.iter().all(|&unit| instance.units.insert(unit)));
            }
            let mut demand: BTreeMap<InstanceId, Vec<(u32, Option<f32>)>> = BTreeMap::new();
            selector.demand(&scene, |one| {
                demand.entry(one.instance).or_default().push((one.group, one.missing_px));
            });
            for instance in &mut instances {
                let hierarchy = &hierarchies[instance.mesh];
                select(hierarchy, &instance.at, &view, &settings, &mut instance.cut);
                let refined = instance.cut.refined();
                let may = available(hierarchy, at_hand);
                let both: Vec<bool> = refined.iter().zip(&may).map(|(a, b)| *a && *b).collect();
                let expected: Vec<u32> = hierarchy.drawn_units(&both).map(|unit| unit as u32).collect();
                prop_assert_eq!(selector.units(&scene, instance.id), &expected);
                prop_assert!(instance.units.iter().eq(&expected));
                // What is asked for, and how far off is what is drawn instead.
                let mut always = vec![false; refined.len()];
                hierarchy.close_refinement(&mut always);
                let wide = InstanceView::new(&view.with_margins(&settings), &instance.at);
                let asked = (0..refined.len()).filter(|&group| refined[group] && !always[group]);
                let asked = asked.map(|group| {
                    // Sought after the decision: as a group that is refined now.
                    let error = group_error_px(&hierarchy.groups[group], &wide, &settings, true);
                    (group as u32, (!may[group]).then_some(error))
                });
                prop_assert_eq!(demand.remove(&instance.id).unwrap_or_default(), asked.collect::<Vec<_>>());
            }
        }
    }
}

/// A budget of triangles counts what is drawn, not what would be.
#[test]
fn a_budget_counts_what_is_at_hand() {
    let hierarchy = &hierarchies()[0];
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(hierarchy);
    let id = scene.add_instance(mesh, Affine3A::IDENTITY, 1.0);
    let half = hierarchy.groups.len() as u32 / 2;
    scene.set_available(mesh, |group| group >= half);
    scene.update();
    let view = look(perspective(1.0), Vec3::new(0.0, 0.3, 2.0), Vec3::ZERO);
    let mut selector = Selector::default();
    let fine = LodSettings::with_error_px(0.05);
    selector.select(&scene, &view, &fine);
    let all = selector.triangle_count();
    // One that suffices for all that is there changes nothing.
    let settings = LodSettings {
        triangle_budget: Some(all),
        ..fine
    };
    selector.select(&scene, &view, &settings);
    assert_eq!(selector.triangle_count(), all);
    assert_eq!(selector.threshold_px(), fine.error_px);
    assert!(!selector.units(&scene, id).is_empty());
    // And a smaller one is kept.
    let settings = LodSettings {
        triangle_budget: Some(all / 2),
        ..fine
    };
    selector.select(&scene, &view, &settings);
    assert!(selector.triangle_count() <= all / 2);
    assert!(selector.triangle_count() >= all / 4);
}
