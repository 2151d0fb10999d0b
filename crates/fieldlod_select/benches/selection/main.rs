//! Selection against the sphere test of clusterlod, in one run: run with
//! `cargo bench -p fieldlod_select`.
//!
//! Each result is checked before it is timed. Ratios are of medians of interleaved rounds, so that what
//! else the machine does weighs on both alike.

mod baseline;
#[path = "../common/mod.rs"]
mod common;
#[path = "../../tests/common/synthetic.rs"]
mod synthetic;

use std::hint::black_box;
use std::time::Duration;

use baseline::SphereTable;
use common::{look, medians, settings};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{
    AdvancedSettings, GroupTable, InstanceView, LodSettings, Scene, Selector, View, group_error_px,
    refine,
};
use glam::{Affine3A, Vec3};

const FOCAL_PX: f32 = 935.3;

fn main() {
    criterion_over_groups();
    whole_frames();
    scene_sizes();
}

fn ns(time: Duration, count: usize) -> f64 {
    time.as_secs_f64() * 1e9 / count as f64
}

fn ball_with_coarsest_error(levels: u32, error: f32) -> Hierarchy {
    let finest = (1..levels).fold(error, |error, _| error / 2.2);
    synthetic::ball(levels, finest)
}

/// The criterion over all groups of one mesh.
fn criterion_over_groups() {
    println!("\ngroups   height  ours ns/group  baseline ns/group  ratio  refined");
    let settings = settings();
    for levels in [6, 8, 10] {
        let hierarchy = ball_with_coarsest_error(levels, 0.02);
        let (table, spheres) = (GroupTable::new(&hierarchy), SphereTable::new(&hierarchy));
        let count = hierarchy.groups.len();
        for height in [0.02f32, 0.1, 0.5, 3.0] {
            let eye = Vec3::new(0.3, 0.4, 0.866) * (1.0 + height);
            let view = look(eye, Vec3::new(0.9, 0.1, 0.3));
            let instance = InstanceView::new(&view, &Affine3A::IDENTITY);
            let (mut bits, mut baseline_bits) = (Vec::new(), Vec::new());
            check(&hierarchy, &table, &instance, &settings);
            spheres.refine(eye, FOCAL_PX, &mut baseline_bits);
            let expected = SphereTable::naive(&hierarchy, eye, FOCAL_PX);
            assert!(
                expected
                    .iter()
                    .enumerate()
                    .all(|(i, &e)| baseline_bits[i / 64] >> (i % 64) & 1 == u64::from(e))
            );
            let repeats = (200_000 / count).max(1);
            let [ours, baseline] = medians(
                41,
                [
                    &mut || {
                        for _ in 0..repeats {
                            refine(&table, black_box(&instance), &settings, &[], &mut bits);
                            black_box(&bits);
                        }
                    },
                    &mut || {
                        for _ in 0..repeats {
                            baseline_bits.clear();
                            spheres.refine(black_box(eye), FOCAL_PX, &mut baseline_bits);
                            black_box(&baseline_bits);
                        }
                    },
                ],
            );
            let refined: u32 = bits.iter().map(|word| word.count_ones()).sum();
            let (ours, baseline) = (ns(ours, count * repeats), ns(baseline, count * repeats));
            println!(
                "{count:8} {height:6}  {ours:13.3}  {baseline:14.3}  {:5.2}  {refined:7}",
                ours / baseline
            );
        }
    }
}

fn check(
    hierarchy: &Hierarchy,
    table: &GroupTable,
    instance: &InstanceView,
    settings: &LodSettings,
) {
    let mut bits = Vec::new();
    refine(table, instance, settings, &[], &mut bits);
    for (index, group) in hierarchy.groups.iter().enumerate() {
        let expected = group_error_px(group, instance, settings, false) > settings.threshold_px();
        assert_eq!(
            bits[index / 64] >> (index % 64) & 1 == 1,
            expected,
            "group {index}"
        );
    }
}

/// 11,664 balls of 85 groups on a plain.
struct Plain {
    scene: Scene,
    spheres: SphereTable,
    places: Vec<Vec3>,
    group_count: usize,
}

impl Plain {
    fn new() -> Self {
        let hierarchy = synthetic::ball(3, 0.004);
        let mut scene = Scene::default();
        let mesh = scene.add_mesh(&hierarchy);
        let side = || (0..108u8).map(|i| (f32::from(i) - 53.5) * 3.0);
        let places: Vec<Vec3> = side()
            .flat_map(|x| side().map(move |z| Vec3::new(x, 0.0, z)))
            .collect();
        for &place in &places {
            scene.add_instance(mesh, Affine3A::from_translation(place), 1.0);
        }
        scene.update();
        Self {
            scene,
            spheres: SphereTable::new(&hierarchy),
            group_count: hierarchy.groups.len() * places.len(),
            places,
        }
    }

    /// The baseline's frame: every group of every instance.
    fn scan(&self, eye: Vec3, bits: &mut Vec<u64>) {
        bits.clear();
        for &place in &self.places {
            self.spheres.refine(eye - place, FOCAL_PX, bits);
        }
    }
}

/// 1.4 m/s at 60 Hz, with head-bob, turning slowly.
fn walk(step: u32) -> (Vec3, View) {
    let step = step as f32;
    let bob = (step * 0.1) % 2.0;
    let eye = Vec3::new(0.4, 1.7 + 0.03 * (bob - 1.0).abs(), 20.0 - step * 0.0233);
    (
        eye,
        look(eye, eye + Vec3::new(0.2 + step * 0.0005, -0.1, -1.0)),
    )
}

fn whole_frames() {
    let plain = Plain::new();
    for settings in [LodSettings::with_error_px(1.0), settings()] {
        frames_at(&plain, &settings);
    }
}

fn frames_at(plain: &Plain, settings: &LodSettings) {
    let [mut fresh, mut kept, mut still] = [
        Selector::default(),
        Selector::default(),
        Selector::default(),
    ];
    let mut bits = Vec::new();
    let no_memory = LodSettings {
        advanced: AdvancedSettings {
            hysteresis: 1.0,
            edge_hysteresis: 0.0,
            ..settings.advanced
        },
        ..*settings
    };
    for step in 0..100 {
        let (_, view) = walk(step);
        fresh.clear();
        fresh.select(&plain.scene, &view, &no_memory);
        kept.select(&plain.scene, &view, &no_memory);
        assert_eq!(fresh.triangle_count(), kept.triangle_count());
    }
    println!("{:?}", fresh.statistics());
    still.select(&plain.scene, &walk(0).1, settings);
    let step = std::cell::Cell::new(100);
    let [baseline, scratch, walking, standing] = medians(
        400,
        [
            &mut || {
                step.set(step.get() + 1);
                plain.scan(walk(step.get()).0, &mut bits);
                black_box(&bits);
            },
            &mut || {
                fresh.clear();
                fresh.select(&plain.scene, &walk(step.get()).1, settings);
            },
            &mut || kept.select(&plain.scene, &walk(step.get()).1, settings),
            &mut || still.select(&plain.scene, &walk(0).1, settings),
        ],
    );
    println!(
        "\n{} instances, {} groups, walking, ours at {} px",
        plain.places.len(),
        plain.group_count,
        settings.threshold_px()
    );
    for (name, time) in [
        ("baseline scan", baseline),
        ("from scratch", scratch),
        ("incremental", walking),
        ("still", standing),
    ] {
        println!(
            "{name:12} {:9.1} us  ratio {:.4}",
            time.as_secs_f64() * 1e6,
            time.as_secs_f64() / baseline.as_secs_f64()
        );
    }
    println!("{:?}", kept.statistics());
}

/// The same dozen balls in front of the camera, and ever more far ahead and behind.
fn scene_of_size(count: u32, hierarchy: &Hierarchy) -> (Scene, Vec<Vec3>) {
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(hierarchy);
    let place = |index: u32| {
        let (x, z) = ((index % 12) as f32 * 3.0 - 16.0, (index / 12) as f32 * 3.0);
        match index {
            0..12 => Vec3::new(x * 0.5, 0.0, 8.0),
            _ if index.is_multiple_of(2) => Vec3::new(x * 8.0, 0.0, 40.0 + z),
            _ => Vec3::new(x * 8.0, 0.0, -150.0 - z),
        }
    };
    let places: Vec<Vec3> = (0..count).map(place).collect();
    for &place in &places {
        scene.add_instance(mesh, Affine3A::from_translation(place), 1.0);
    }
    scene.update();
    (scene, places)
}

fn scene_sizes() {
    println!("\ninstances  from scratch us  incremental us  scan us  triangles near");
    let settings = settings();
    let hierarchy = synthetic::ball(3, 0.004);
    let spheres = SphereTable::new(&hierarchy);
    for instances in [1u32, 10, 100, 1_000, 10_000, 100_000] {
        let (scene, places) = scene_of_size(instances, &hierarchy);
        let [mut fresh, mut kept] = [Selector::default(), Selector::default()];
        let mut bits = Vec::new();
        let step = std::cell::Cell::new(0);
        let rounds = if instances < 100_000 { 300 } else { 60 };
        let [scratch, walking, scan] = medians(
            rounds,
            [
                &mut || {
                    step.set(step.get() + 1);
                    fresh.clear();
                    fresh.select(&scene, &walk(step.get()).1, &settings);
                },
                &mut || kept.select(&scene, &walk(step.get()).1, &settings),
                &mut || {
                    bits.clear();
                    let eye = walk(step.get()).0;
                    for &place in &places {
                        spheres.refine(eye - place, FOCAL_PX, &mut bits);
                    }
                    black_box(&bits);
                },
            ],
        );
        let [scratch_us, walking_us, scan_us] =
            [scratch, walking, scan].map(|time| time.as_secs_f64() * 1e6);
        println!(
            "{instances:9}  {scratch_us:15.2}  {walking_us:14.2}  {scan_us:7.2}  {}",
            kept.triangle_count()
        );
    }
}
