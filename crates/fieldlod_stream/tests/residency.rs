//! Budgets, holes and thrashing, disks that are slow and pages that cannot be read.

mod simulation;

use std::collections::HashMap;
use std::sync::LazyLock;
use std::time::Duration;

use fieldlod_hierarchy::PagedMesh;
use fieldlod_select::{AdvancedSettings, LodSettings, Offscreen};
use fieldlod_stream::{Residency, StreamPageId, StreamSettings};
use glam::Vec3;
use proptest::prelude::*;

use simulation::{Disk, World, rocks};

static ROCKS: LazyLock<Vec<PagedMesh>> = LazyLock::new(|| rocks(9, 2, 5, 8 << 10));

const EYE: Vec3 = Vec3::new(3.0, 1.6, -2.0);
const TARGET: Vec3 = Vec3::new(4.0, 0.5, 4.0);

fn bytes_of(rocks: &[PagedMesh]) -> u64 {
    let pages = rocks.iter().flat_map(|rock| &rock.pages);
    pages.map(|page| u64::from(page.mesh_bytes)).sum()
}

/// Of the first pages of all.
fn least_bytes() -> u64 {
    ROCKS
        .iter()
        .map(|rock| u64::from(rock.pages[0].mesh_bytes))
        .sum()
}

fn budget(gpu_bytes: u64) -> StreamSettings {
    StreamSettings {
        gpu_bytes,
        loading_bytes: 1 << 20,
        ..StreamSettings::default()
    }
}

/// What one view wants with all memory there is.
fn wanted_bytes() -> u64 {
    let mut world = World::new(&ROCKS, budget(u64::MAX), Disk::IDEAL);
    for _ in 0..3 {
        world.frame(EYE, TARGET);
    }
    world.residency.statistics().wanted_bytes
}

#[test]
fn streamed_cut_converges_to_the_full_cut() {
    let disk = Disk {
        bytes_a_second: 2e6,
        latency_seconds: 0.05,
    };
    let mut streamed = World::new(&ROCKS, budget(wanted_bytes() * 5 / 4), disk);
    let mut whole = World::new(&ROCKS, budget(u64::MAX), Disk::IDEAL);
    for (mesh, id, _) in &whole.meshes {
        let all = mesh.graph.groups.len() as u32;
        whole.scene.set_available(*id, |group| group < all);
    }
    let (mut before, mut frames) = (u64::MAX, 0);
    while streamed.residency.statistics().loaded == 0 || before > 0 {
        before = u64::from(streamed.frame(EYE, TARGET).missing);
        whole.selector.select(
            &whole.scene,
            &simulation::view(EYE, TARGET),
            &whole.settings,
        );
        assert!(streamed.draws_whole_cuts());
        frames += 1;
        assert!(frames < 600, "still {before} pages missing");
    }
    assert!(frames > 10, "the disk is too fast to show anything");
    for &instance in &streamed.instances {
        let units = streamed.selector.units(&streamed.scene, instance);
        assert_eq!(units, whole.selector.units(&whole.scene, instance));
    }
    assert_eq!(streamed.residency.coarsening(), 1.0);
}

/// With half and a tenth of what a view wants: coarser, whole, within the budget, and at rest.
#[test]
fn small_budget_settles() {
    for share in [2, 10] {
        let gpu_bytes = (wanted_bytes() / share).max(least_bytes());
        let mut world = World::new(&ROCKS, budget(gpu_bytes), Disk::IDEAL);
        let mut last = Vec::new();
        for frame in 0..1200 {
            let report = world.frame(EYE, TARGET);
            assert!(report.gpu_bytes <= gpu_bytes);
            assert!(world.draws_whole_cuts());
            last.push(report.coarsening);
            if frame > 600 {
                assert_eq!(report.missing, 0);
            }
        }
        assert!(last[1199] > 1.0);
        assert!(
            last[600..].windows(2).all(|pair| pair[0] == pair[1]),
            "{:?}",
            &last[1100..]
        );
        // The last of the budget is in use, or the first pages take it.
        let statistics = world.residency.statistics();
        assert!(
            statistics.wanted_bytes * 10 >= gpu_bytes * 7,
            "{statistics:?} of {gpu_bytes}"
        );
        assert_no_thrashing(&world);
    }
}

/// No page is loaded twice within two seconds.
fn assert_no_thrashing(world: &World) {
    let mut loads: HashMap<StreamPageId, u64> = HashMap::new();
    for &(frame, page, is_load) in &world.log {
        if is_load && let Some(before) = loads.insert(page, frame) {
            assert!(
                frame - before > 120,
                "{page:?} in frames {before} and {frame}"
            );
        }
    }
}

#[test]
fn first_pages_are_loaded_first_and_stay() {
    let mut world = World::new(&ROCKS, budget(least_bytes() / 2), Disk::IDEAL);
    assert!(world.residency.is_budget_too_small());
    for frame in 0..200u16 {
        let turn = f32::from(frame) * 0.1;
        world.frame(EYE, EYE + Vec3::new(turn.cos(), 0.0, turn.sin()));
        assert!(world.draws_whole_cuts());
    }
    let loaded = world.log.iter().filter(|(_, _, is_load)| *is_load);
    assert!(loaded.clone().all(|(_, page, _)| page.page == 0));
    assert_eq!(loaded.count(), ROCKS.len());
    assert_eq!(world.residency.statistics().evicted, 0);
}

/// A page that cannot be read is asked for again, more and more rarely; all else is drawn.
#[test]
fn broken_page_does_not_block_others() {
    let mut world = World::new(&ROCKS, budget(bytes_of(&ROCKS)), Disk::IDEAL);
    world.frame(EYE, TARGET);
    let wanted: Vec<StreamPageId> = world.log.iter().map(|(_, page, _)| *page).collect();
    let broken = *wanted.iter().find(|page| page.page > 0).unwrap();
    let mut world = World::new(&ROCKS, budget(bytes_of(&ROCKS)), Disk::IDEAL);
    world.broken.push(broken);
    for _ in 0..1000 {
        world.frame(EYE, TARGET);
        assert!(world.draws_whole_cuts());
    }
    assert!(
        wanted
            .iter()
            .all(|&page| world.residency.is_resident(page) == (page != broken))
    );
    let tries: Vec<u64> = world
        .log
        .iter()
        .filter(|(_, page, _)| *page == broken)
        .map(|(frame, ..)| *frame)
        .collect();
    let waits: Vec<u64> = tries.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!((3..=6).contains(&tries.len()), "{tries:?}");
    assert!(
        waits.windows(2).all(|pair| pair[1] > pair[0] * 3 / 2),
        "{waits:?}"
    );
    assert_eq!(world.residency.statistics().failed, tries.len() as u64);
    // Once it can be read again, it is.
    world.broken.clear();
    for _ in 0..1000 {
        world.frame(EYE, TARGET);
    }
    assert!(world.residency.is_resident(broken));
    assert_eq!(world.residency.statistics().missing_pages, 0);
}

#[test]
fn meshes_can_be_removed_while_loading() {
    let mut residency = Residency::new(budget(u64::MAX));
    let [stays, goes] = [0, 1].map(|rock| residency.add_mesh(&ROCKS[rock]));
    let orders = residency.update(Duration::ZERO);
    assert_eq!(orders.load.len(), 2);
    residency.demand(goes, 0, Some(5.0));
    residency.remove_mesh(goes);
    residency.remove_mesh(goes);
    let accepted: Vec<bool> = orders
        .load
        .iter()
        .map(|&page| residency.set_loaded(page))
        .collect();
    assert_eq!(accepted, [true, false]);
    residency.set_failed(orders.load[1]);
    residency.demand(goes, 0, Some(5.0));
    assert_eq!(residency.update(Duration::ZERO), Default::default());
    let statistics = residency.statistics();
    assert_eq!(
        statistics.resident_bytes,
        u64::from(ROCKS[0].pages[0].mesh_bytes)
    );
    assert_eq!(
        (statistics.loading_bytes, statistics.loading_gpu_bytes),
        (0, 0)
    );
    assert!(residency.is_at_hand(stays, ROCKS[0].groups_of(0)[0]));
    assert!(!residency.is_at_hand(goes, ROCKS[1].groups_of(0)[0]));
}

/// A smaller budget is kept to as soon as what is in use allows.
#[test]
fn budget_can_shrink() {
    let mut world = World::new(&ROCKS, budget(bytes_of(&ROCKS)), Disk::IDEAL);
    for _ in 0..5 {
        world.frame(EYE, TARGET);
    }
    let gpu_bytes = (world.residency.statistics().resident_bytes / 3).max(least_bytes());
    world.residency.set_settings(budget(gpu_bytes));
    for frame in 0..200 {
        let report = world.frame(EYE, TARGET);
        assert!(world.draws_whole_cuts());
        assert!(frame < 100 || report.gpu_bytes <= gpu_bytes);
    }
}

/// There and back, with room for all: what is behind leaves after a while, and not before.
#[test]
fn unused_pages_are_evicted_after_a_while() {
    let keep_unused = Duration::from_secs(3);
    let settings = StreamSettings {
        keep_unused,
        ..budget(u64::MAX)
    };
    let mut world = World::new(&ROCKS, settings, Disk::IDEAL);
    let mut stand = |eye: Vec3, seconds: u32| {
        let before = world.log.len();
        for _ in 0..seconds * 60 {
            world.frame(eye, eye + TARGET - EYE);
            assert!(world.draws_whole_cuts());
        }
        let statistics = world.residency.statistics();
        (world.log[before..].to_vec(), statistics)
    };
    let elsewhere = EYE + Vec3::new(40.0, 0.0, 40.0);
    let (log, near) = stand(EYE, 5);
    assert!(log.iter().all(|(_, _, is_load)| *is_load));
    assert_eq!(near.wanted_bytes, near.resident_bytes);
    // A short look elsewhere costs nothing.
    assert!(stand(elsewhere, 2).1.wanted_bytes < near.wanted_bytes / 4);
    assert!(stand(EYE, 5).0.is_empty());
    // All but what is in use is gone after some time more than that.
    assert!(stand(elsewhere, 2).0.is_empty());
    let (log, far) = stand(elsewhere, 3);
    assert!(log.iter().all(|(_, _, is_load)| !*is_load) && !log.is_empty());
    assert_eq!(far.wanted_bytes, far.resident_bytes);
    // And comes back.
    let (log, back) = stand(EYE, 1);
    assert!(log.iter().all(|(_, _, is_load)| *is_load));
    assert_eq!(
        (back.resident_bytes, back.missing_pages),
        (near.resident_bytes, 0)
    );
}

fn place() -> impl Strategy<Value = Vec3> {
    (-5.0f32..15.0, 0.0f32..3.0, -5.0f32..15.0).prop_map(Vec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Wherever one jumps, with whatever memory and disk: within the budgets, and never a hole.
    #[test]
    fn budgets_hold_and_cuts_have_no_holes(
        jumps in prop::collection::vec((place(), place(), 1usize..40), 1..6),
        share in 0.0f64..1.0,
        loading_bytes in prop_oneof![Just(0u64), 1_000u64..1_000_000],
        bytes_a_second in prop_oneof![1e4f64..1e6, 1e6f64..1e9],
        latency_seconds in 0.0f64..2.0,
        keep_unused in prop_oneof![Just(Duration::ZERO), Just(Duration::from_millis(200)), Just(Duration::MAX)],
        is_beside in any::<bool>(),
    ) {
        let (least, all) = (least_bytes(), bytes_of(&ROCKS));
        let gpu_bytes = least + ((all - least) as f64 * share * share) as u64;
        let settings = StreamSettings { gpu_bytes, loading_bytes, keep_unused };
        let disk = Disk { bytes_a_second, latency_seconds };
        let run = || {
            let mut world = World::new(&ROCKS, settings, disk);
            let mut ordered_bytes = 0;
            let offscreen = if is_beside { Offscreen::OnAxis { bias: 1.0 } } else { Offscreen::Coarsest };
            world.settings = LodSettings { advanced: AdvancedSettings { offscreen, ..AdvancedSettings::default() }, ..LodSettings::with_error_px(1.0) };
            for &(eye, target, frames) in &jumps {
                for _ in 0..frames {
                    let report = world.frame(eye, target + Vec3::X * 0.01);
                    ordered_bytes += report.read_bytes;
                    let statistics = world.residency.statistics();
                    prop_assert!(statistics.loaded_file_bytes <= ordered_bytes);
                    if statistics.loading_bytes == 0 {
                        prop_assert_eq!(statistics.loaded_file_bytes, ordered_bytes);
                    }
                    let most_loading = loading_bytes.max(most_page_bytes());
                    prop_assert!(report.gpu_bytes <= gpu_bytes);
                    prop_assert!(report.loading_bytes <= most_loading);
                    prop_assert!(world.draws_whole_cuts());
                }
            }
            Ok(world.log)
        };
        // And it depends on nothing else.
        prop_assert_eq!(run()?, run()?);
    }
}

/// What the largest page takes while it is loaded.
fn most_page_bytes() -> u64 {
    let pages = ROCKS.iter().flat_map(|rock| &rock.pages);
    let bytes = pages.map(|page| u64::from(page.mesh_bytes) + page.bytes.end - page.bytes.start);
    bytes.max().unwrap_or(0)
}
