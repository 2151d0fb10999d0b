//! Invariants of every cut, for any view.

use std::collections::HashMap;

use fieldlod_hierarchy::{Hierarchy, NO_GROUP};
use fieldlod_select::{Cut, LodSettings, select, select_with};
use glam::{Affine3A, Vec3};
use proptest::prelude::*;

use crate::common::{HIERARCHIES, any_placement, any_view, hierarchies, look, perspective};

/// Walks from every source unit up its chains of simplifications, and counts the units of the cut on
/// the way. The surface is covered once if each chain, by any unit of the next level, passes exactly
/// one unit of the cut.
fn covers_once(hierarchy: &Hierarchy, cut: &Cut) -> bool {
    let mut drawn = vec![false; hierarchy.units.len()];
    for &unit in cut.units() {
        drawn[unit as usize] = true;
    }
    // `above[g]`: the cut covers the surface of g's simplification, by itself or coarser.
    let group_count = hierarchy.groups.len();
    let mut above = vec![None; group_count];
    for group in (0..group_count).rev() {
        let produced = hierarchy
            .units
            .iter()
            .enumerate()
            .filter(|(_, unit)| unit.produced_by == group as u32);
        let covered: Vec<Option<bool>> = produced
            .map(
                |(index, unit)| match (drawn[index], above[unit.consumed_by as usize]) {
                    (true, Some(true)) => None,
                    (is_drawn, coarser) => Some(is_drawn || coarser == Some(true)),
                },
            )
            .collect();
        if covered.iter().any(Option::is_none) || covered.windows(2).any(|pair| pair[0] != pair[1])
        {
            return false;
        }
        above[group] = covered.first().copied().flatten();
    }
    hierarchy
        .units
        .iter()
        .enumerate()
        .filter(|(_, unit)| unit.produced_by == NO_GROUP)
        .all(|(index, unit)| drawn[index] != (above[unit.consumed_by as usize] == Some(true)))
}

/// Edges between welded vertices that the cut has more often in one direction than in the other.
fn open_edges(hierarchy: &Hierarchy, cut: &Cut) -> usize {
    let mut first_at = HashMap::new();
    let positions = &hierarchy.vertices.positions;
    let mut weld = |vertex: u32| {
        let bits = positions[vertex as usize]
            .to_array()
            .map(|x| (x + 0.0).to_bits());
        *first_at.entry(bits).or_insert(vertex)
    };
    let mut surplus: HashMap<(u32, u32), i32> = HashMap::new();
    for &unit in cut.units() {
        for triangle in hierarchy.triangles_of(&hierarchy.units[unit as usize]) {
            let [a, b, c] = triangle.map(&mut weld);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *surplus.entry((from.min(to), from.max(to))).or_default() +=
                    if from < to { 1 } else { -1 };
            }
        }
    }
    surplus
        .iter()
        .filter(|((from, to), count)| from != to && **count != 0)
        .count()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_cut_covers_surface_once_without_holes(
        which in 0usize..HIERARCHIES,
        view in any_view(),
        placement in any_placement(),
        error_px in prop_oneof![Just(0.0f32), 0.05f32..50.0],
    ) {
        let hierarchy = &hierarchies()[which];
        let mut cut = Cut::default();
        select(hierarchy, &placement, &view, &LodSettings::with_error_px(error_px), &mut cut);
        prop_assert!(covers_once(hierarchy, &cut));
        let is_closed_mesh = which == 0;
        prop_assert!(!is_closed_mesh || open_edges(hierarchy, &cut) == 0);
    }

    #[test]
    fn every_criterion_gives_a_valid_cut(which in 0usize..HIERARCHIES, bits in prop::collection::vec(any::<u32>(), 97)) {
        let hierarchy = &hierarchies()[which];
        let mut cut = Cut::default();
        // Any bits at all: NaN, infinities and negative numbers included.
        select_with(hierarchy, &LodSettings::default(), &mut cut, |group| f32::from_bits(bits[group % bits.len()]));
        prop_assert!(covers_once(hierarchy, &cut));
    }

    #[test]
    fn smaller_error_never_draws_less(which in 0usize..HIERARCHIES, view in any_view(), error_px in 0.05f32..20.0, factor in 1.0f32..8.0) {
        let hierarchy = &hierarchies()[which];
        let [mut fine, mut coarse] = [Cut::default(), Cut::default()];
        select(hierarchy, &Affine3A::IDENTITY, &view, &LodSettings::with_error_px(error_px), &mut fine);
        select(hierarchy, &Affine3A::IDENTITY, &view, &LodSettings::with_error_px(error_px * factor), &mut coarse);
        let implies = |(&coarse, &fine): (&bool, &bool)| !coarse || fine;
        prop_assert!(coarse.refined().iter().zip(fine.refined()).all(implies));
    }

    #[test]
    fn cut_is_independent_of_unit_of_length(which in 0usize..HIERARCHIES, distance in 1.5f32..100.0, exponent in -20i32..20) {
        let hierarchy = &hierarchies()[which];
        // A power of two scales without rounding.
        let scale = (0..exponent.abs()).fold(1.0f32, |s, _| if exponent > 0 { s * 2.0 } else { s * 0.5 });
        let cut_at = |scale: f32| {
            let eye = Vec3::new(0.3, 0.5, 1.0) * (distance * scale);
            let mut cut = Cut::default();
            let placement = Affine3A::from_scale(Vec3::splat(scale));
            select(hierarchy, &placement, &look(perspective(1.0), eye, Vec3::ZERO), &LodSettings::default(), &mut cut);
            cut
        };
        prop_assert_eq!(cut_at(1.0), cut_at(scale));
    }
}

#[test]
fn coverage_check_rejects_empty_cut() {
    let hierarchy = &hierarchies()[0];
    let mut cut = Cut::default();
    select_with(hierarchy, &LodSettings::default(), &mut cut, |_| 0.0);
    assert!(covers_once(hierarchy, &cut));
    let coarsest = cut.clone();
    select_with(hierarchy, &LodSettings::default(), &mut cut, |_| f32::MAX);
    assert!(covers_once(hierarchy, &cut));
    assert!(cut.units().len() > coarsest.units().len());
    // Drawing nothing covers nothing.
    assert!(!covers_once(hierarchy, &Cut::default()));
}
