//! Tests of memory budgets, complete cuts, evictions, slow disks and unreadable pages.

mod simulation;

use std::collections::HashMap;
use std::sync::LazyLock;
use std::time::Duration;

use fieldlod_hierarchy::{Page, PagedMesh};
use fieldlod_select::{AdvancedSettings, LodSettings, Offscreen};
use fieldlod_stream::{Residency, StreamPageId, StreamSettings};
use glam::Vec3;
use proptest::prelude::*;

use simulation::{Disk, World, rocks};

static ROCKS: LazyLock<Vec<PagedMesh>> = LazyLock::new(|| rocks(9, 2, 5, 8 << 10));

const EYE: Vec3 = Vec3::new(3.0, 1.6, -2.0);
const TARGET: Vec3 = Vec3::new(4.0, 0.5, 4.0);

fn gpu_bytes<'a>(pages: impl Iterator<Item = &'a Page>) -> u64 {
    pages.map(|page| u64::from(page.mesh_bytes)).sum()
}

fn all_bytes() -> u64 {
    gpu_bytes(ROCKS.iter().flat_map(|rock| &rock.pages))
}

fn first_page_bytes() -> u64 {
    gpu_bytes(ROCKS.iter().map(|rock| &rock.pages[0]))
}

fn budget(gpu_bytes: u64) -> StreamSettings {
    StreamSettings {
        gpu_bytes,
        loading_bytes: 1 << 20,
        ..StreamSettings::default()
    }
}

fn world(gpu_bytes: u64) -> World {
    World::new(&ROCKS, budget(gpu_bytes), Disk::IDEAL)
}

/// Bytes that the view wants without a budget.
fn wanted_bytes() -> u64 {
    let mut world = world(u64::MAX);
    for _ in 0..3 {
        world.frame(EYE, TARGET);
    }
    world.residency.statistics().wanted_bytes
}

#[test]
fn streamed_cut_converges_to_the_full_cut() {
    let disk = Disk {
        bytes_per_second: 2e6,
        latency_seconds: 0.05,
    };
    let mut streamed = World::new(&ROCKS, budget(wanted_bytes() * 5 / 4), disk);
    let mut complete = world(u64::MAX);
    for rock in &complete.rocks {
        complete.scene.set_available(rock.id, |_| true);
    }
    let view = simulation::view(EYE, TARGET);
    let (scene, settings) = (&complete.scene, &complete.settings);
    let (mut missing, mut frames) = (u32::MAX, 0);
    while missing > 0 || streamed.residency.statistics().loaded == 0 {
        missing = streamed.frame(EYE, TARGET).missing;
        complete.selector.select(scene, &view, settings);
        assert!(streamed.draws_complete_cuts());
        frames += 1;
        assert!(frames < 600, "{missing} pages are still missing");
    }
    assert!(frames > 10, "the disk is too fast for this test");
    for rock in &streamed.rocks {
        let units = streamed.selector.units(&streamed.scene, rock.instance);
        assert_eq!(units, complete.selector.units(scene, rock.instance));
    }
    assert_eq!(streamed.residency.coarsening(), 1.0);
}

/// With half or a tenth of the wanted bytes, the coarsening becomes constant. At least 70 % of the budget is used.
#[test]
fn coarsening_becomes_constant_with_a_small_budget() {
    for share in [2, 10] {
        let gpu_bytes = (wanted_bytes() / share).max(first_page_bytes());
        let mut world = world(all_bytes());
        for _ in 0..5 {
            world.frame(EYE, TARGET);
        }
        world.residency.set_settings(budget(gpu_bytes));
        let mut constant = None;
        for frame in 0..1200 {
            let report = world.frame(EYE, TARGET);
            assert!(frame < 100 || report.gpu_bytes <= gpu_bytes);
            assert!(world.draws_complete_cuts());
            if frame >= 600 {
                let coarsening = *constant.get_or_insert(report.coarsening);
                assert_eq!((report.missing, report.coarsening), (0, coarsening));
            }
        }
        assert!(constant > Some(1.0));
        let wanted = world.residency.statistics().wanted_bytes;
        assert!(wanted * 10 >= gpu_bytes * 7, "{wanted} of {gpu_bytes}");
        // No page is loaded twice within two seconds.
        let mut loads: HashMap<StreamPageId, u64> = HashMap::new();
        for &(frame, page, is_load) in &world.log {
            if is_load && let Some(before) = loads.insert(page, frame) {
                assert!(frame - before > 120, "{page:?}: {before} and {frame}");
            }
        }
    }
}

#[test]
fn only_first_pages_load_with_tiny_budget() {
    let mut world = world(first_page_bytes() / 2);
    assert!(world.residency.is_budget_too_small());
    for frame in 0..200u16 {
        let turn = f32::from(frame) * 0.1;
        world.frame(EYE, EYE + Vec3::new(turn.cos(), 0.0, turn.sin()));
        assert!(world.draws_complete_cuts());
    }
    let is_first_load = |&(_, page, is_load): &(u64, StreamPageId, bool)| is_load && page.page == 0;
    assert!(world.log.iter().all(is_first_load));
    assert_eq!(world.log.len(), ROCKS.len());
}

#[test]
fn unreadable_page_is_retried_with_growing_delays() {
    let mut first = world(all_bytes());
    first.frame(EYE, TARGET);
    let wanted: Vec<StreamPageId> = first.log.iter().map(|(_, page, _)| *page).collect();
    let broken = *wanted.iter().find(|page| page.page > 0).unwrap();
    let mut world = world(all_bytes());
    world.broken.push(broken);
    for _ in 0..1000 {
        world.frame(EYE, TARGET);
        assert!(world.draws_complete_cuts());
    }
    for &page in &wanted {
        assert_eq!(world.is_resident(page), page != broken);
    }
    let tries = world.log.iter().filter(|(_, page, _)| *page == broken);
    let tries: Vec<u64> = tries.map(|(frame, ..)| *frame).collect();
    let delays: Vec<u64> = tries.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(delays.len() >= 2, "{tries:?}");
    let grows = |pair: &[u64]| pair[1] > pair[0] * 3 / 2;
    assert!(delays.windows(2).all(grows), "{delays:?}");
    assert_eq!(world.residency.statistics().failed, tries.len() as u64);
    world.broken.clear();
    for _ in 0..1000 {
        world.frame(EYE, TARGET);
    }
    assert!(world.is_resident(broken));
}

#[test]
fn mesh_can_be_removed_while_loading() {
    let mut residency = Residency::new(budget(u64::MAX));
    let [kept, removed] = [0, 1].map(|rock| residency.add_mesh(&ROCKS[rock]));
    let load = residency.update(Duration::ZERO).load;
    residency.demand(removed, ROCKS[1].groups_of(1)[0], Some(5.0));
    residency.remove_mesh(removed);
    residency.remove_mesh(removed);
    assert_eq!(load.len(), 2);
    assert!(residency.set_loaded(load[0]));
    assert!(!residency.set_loaded(load[1]));
    residency.set_failed(load[1]);
    residency.demand(removed, 0, Some(5.0));
    assert_eq!(residency.update(Duration::ZERO), Default::default());
    let statistics = residency.statistics();
    let first = gpu_bytes(ROCKS[0].pages[..1].iter());
    assert_eq!(
        (statistics.resident_bytes, statistics.wanted_bytes),
        (first, first)
    );
    assert_eq!(statistics.loading_bytes, 0);
    assert_eq!(statistics.loading_gpu_bytes, 0);
    assert!(residency.is_resident(kept, ROCKS[0].groups_of(0)[0]));
    assert!(!residency.is_resident(removed, ROCKS[1].groups_of(0)[0]));
}

/// A frame that visited removed meshes would make this test take minutes.
#[test]
fn removed_meshes_do_not_slow_later_frames() {
    let rock = rock_with_sizes(&[50, 60, 40]);
    let mut residency = Residency::new(budget(u64::MAX));
    let kept = residency.add_mesh(&rock);
    for _ in 0..100_000 {
        let mesh = residency.add_mesh(&rock);
        let first = StreamPageId { mesh, page: 0 };
        assert!(residency.update(Duration::ZERO).load.contains(&first));
        residency.remove_mesh(mesh);
    }
    assert!(residency.set_loaded(StreamPageId {
        mesh: kept,
        page: 0
    }));
    assert_eq!(residency.statistics().loading_bytes, 0);
}

/// A rock whose pages have these sizes; further pages have the last one.
fn rock_with_sizes(sizes: &[u32]) -> PagedMesh {
    let mut rock = ROCKS[0].clone();
    for (number, page) in rock.pages.iter_mut().enumerate() {
        page.mesh_bytes = sizes[number.min(sizes.len() - 1)];
        page.bytes = 0..0;
    }
    rock
}

/// Demands the given pages and returns the pages that are loaded and evicted.
fn orders_of(residency: &mut Residency, demanded: &[StreamPageId]) -> [Vec<StreamPageId>; 2] {
    for page in demanded {
        let group = ROCKS[0].groups_of(page.page as usize)[0];
        residency.demand(page.mesh, group, Some(5.0));
    }
    let orders = residency.update(Duration::ZERO);
    [orders.load, orders.evict]
}

#[test]
fn finer_pages_wait_for_their_coarser_pages() {
    let (graph, page_of) = (&ROCKS[0].graph, |group: u32| ROCKS[0].page_of(group));
    let in_page_1 = ROCKS[0].groups_of(1).iter();
    let finer_groups =
        in_page_1.flat_map(|&group| graph.finer_groups(&graph.groups[group as usize]));
    let finer_page = finer_groups
        .map(|&group| page_of(group))
        .find(|page| *page > 1)
        .unwrap();
    // The coarser page is larger, so it does not fit while the first page is loading.
    let rock = rock_with_sizes(&[50, 60, 40]);
    let mut residency = Residency::new(StreamSettings {
        loading_bytes: 100,
        ..budget(u64::MAX)
    });
    let mesh = residency.add_mesh(&rock);
    let [first, coarser, finer] = [0, 1, finer_page].map(|page| StreamPageId { mesh, page });
    assert_eq!(orders_of(&mut residency, &[])[0], [first]);
    assert_eq!(orders_of(&mut residency, &[coarser, finer])[0], []);
    residency.set_loaded(first);
    assert_eq!(orders_of(&mut residency, &[coarser])[0], [coarser]);
    residency.set_failed(coarser);
    assert_eq!(orders_of(&mut residency, &[coarser, finer])[0], []);
    // A coarser page that is not demanded belongs to other groups of the finer page.
    assert_eq!(orders_of(&mut residency, &[finer])[0], [finer]);
}

#[test]
fn no_page_is_evicted_for_a_page_that_does_not_fit() {
    let mut residency = Residency::new(budget(100));
    let meshes = [[10, 40], [10, 90]].map(|sizes| residency.add_mesh(&rock_with_sizes(&sizes)));
    let [idle, large] = meshes.map(|mesh| StreamPageId { mesh, page: 1 });
    let [load, _] = orders_of(&mut residency, &[idle]);
    assert_eq!(load.len(), 3);
    load.into_iter()
        .for_each(|page| assert!(residency.set_loaded(page)));
    assert_eq!(orders_of(&mut residency, &[large]), [vec![], vec![]]);
}

/// Frame 0 does not count as an earlier excess, which would double the wait.
#[test]
fn first_excess_waits_the_shortest_time() {
    let mut residency = Residency::new(budget(u64::MAX));
    residency.add_mesh(&ROCKS[0]);
    let mut coarsening_after = |frames: u32, settings| {
        residency.set_settings(settings);
        for _ in 0..frames {
            residency.update(Duration::ZERO);
        }
        residency.coarsening()
    };
    assert_eq!(coarsening_after(150, budget(u64::MAX)), 1.0);
    let raised = coarsening_after(1, budget(0));
    assert!(raised > 1.0);
    assert_eq!(coarsening_after(120, budget(u64::MAX)), raised);
    assert!(coarsening_after(1, budget(u64::MAX)) < raised);
}

#[test]
fn unused_pages_are_evicted_after_keep_unused() {
    let keep_unused = Duration::from_secs(3);
    let settings = StreamSettings {
        keep_unused,
        ..budget(u64::MAX)
    };
    let mut world = World::new(&ROCKS, settings, Disk::IDEAL);
    // Returns loads, evictions and statistics of some seconds at one place.
    let mut stay = |eye: Vec3, seconds: u32| {
        let before = world.log.len();
        for _ in 0..seconds * 60 {
            world.frame(eye, eye + TARGET - EYE);
        }
        let log = &world.log[before..];
        let loads = log.iter().filter(|(_, _, is_load)| *is_load).count();
        (loads, log.len() - loads, world.residency.statistics())
    };
    let elsewhere = EYE + Vec3::new(40.0, 0.0, 40.0);
    let (loads, evictions, near) = stay(EYE, 5);
    assert!(loads > 0 && evictions == 0);
    // A short absence evicts nothing.
    assert!(stay(elsewhere, 2).2.wanted_bytes < near.wanted_bytes / 4);
    assert!(matches!(stay(EYE, 5), (0, 0, _)));
    assert!(matches!(stay(elsewhere, 2), (0, 0, _)));
    let (loads, evictions, far) = stay(elsewhere, 3);
    assert!(loads == 0 && evictions > 0);
    assert_eq!(far.wanted_bytes, far.resident_bytes);
    let (loads, _, back) = stay(EYE, 1);
    assert_eq!(loads, evictions);
    assert_eq!(back.resident_bytes, near.resident_bytes);
}

fn place() -> impl Strategy<Value = Vec3> {
    (-5.0f32..15.0, 0.0f32..3.0, -5.0f32..15.0).prop_map(Vec3::from)
}

fn any_settings() -> impl Strategy<Value = StreamSettings> {
    let gpu_bytes = (0.0f64..1.0).prop_map(|share| {
        let least = first_page_bytes();
        least + ((all_bytes() - least) as f64 * share * share) as u64
    });
    let loading_bytes = prop_oneof![Just(0u64), 1_000u64..1_000_000];
    let keep_unused =
        prop_oneof![Just(0), Just(200), Just(u64::MAX)].prop_map(Duration::from_millis);
    (gpu_bytes, loading_bytes, keep_unused).prop_map(|values| StreamSettings {
        gpu_bytes: values.0,
        loading_bytes: values.1,
        keep_unused: values.2,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn budgets_hold_and_runs_are_repeatable(
        jumps in prop::collection::vec((place(), place(), 1usize..40), 1..6),
        settings in any_settings(),
        bytes_per_second in prop_oneof![1e4f64..1e6, 1e6f64..1e9],
        latency_seconds in 0.0f64..2.0,
        is_on_axis in any::<bool>(),
    ) {
        let pages = ROCKS.iter().flat_map(|rock| &rock.pages);
        let largest = pages.map(|p| u64::from(p.mesh_bytes) + p.bytes.end - p.bytes.start).max();
        let max_loading_bytes = settings.loading_bytes.max(largest.unwrap());
        let disk = Disk { bytes_per_second, latency_seconds };
        let run = || {
            let mut world = World::new(&ROCKS, settings, disk);
            let offscreen = if is_on_axis { Offscreen::OnAxis { bias: 1.0 } } else { Offscreen::Coarsest };
            let advanced = AdvancedSettings { offscreen, ..AdvancedSettings::default() };
            world.settings = LodSettings { advanced, ..LodSettings::with_error_px(1.0) };
            let mut ordered_bytes = 0;
            for &(eye, target, frames) in &jumps {
                for _ in 0..frames {
                    let report = world.frame(eye, target + Vec3::X * 0.01);
                    ordered_bytes += report.read_bytes;
                    let loaded_bytes = world.residency.statistics().loaded_file_bytes;
                    prop_assert!(loaded_bytes <= ordered_bytes);
                    prop_assert!(report.loading_bytes > 0 || loaded_bytes == ordered_bytes);
                    prop_assert!(report.gpu_bytes <= settings.gpu_bytes);
                    prop_assert!(report.loading_bytes <= max_loading_bytes);
                    prop_assert!(world.draws_complete_cuts());
                }
            }
            Ok(world.log)
        };
        prop_assert_eq!(run()?, run()?);
    }
}
