//! A walk through rocks that are read in parts: memory, missing detail, bytes read and time of the main thread.
//!
//! `FIELDLOD_WORLD=folder cargo bench -p fieldlod_tests --bench world` bakes 100 different rocks of 327,680 triangles
//! into the folder, unless they are there, and walks at 60 frames per second without a renderer. `-- 10` uses ten
//! rocks.

#[path = "../process.rs"]
mod process;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{BakeConfig, bake_mesh};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, PageOptions, PagedFile};
use fieldlod_tests::apps::{finish, rendererless, run_until_ready, spawn_camera};

const MIB: f64 = (1 << 20) as f64;
const FRAME: Duration = Duration::from_nanos(16_666_667);
const SECONDS: u32 = 12;
/// Distance of the rocks, in metres. Their radius is about one.
const SPACING: f32 = 4.0;

/// Names, metres per second, and seconds between jumps.
const PACES: [(&str, f32, f32); 3] = [
    ("walking", 1.5, f32::INFINITY),
    ("driving", 15.0, f32::INFINITY),
    ("teleporting", 1.5, 3.0),
];

fn main() {
    let folder = std::env::var_os("FIELDLOD_WORLD").map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| std::env::temp_dir().join("fieldlod-world"));
    let count = std::env::args().find_map(|arg| arg.parse().ok());
    let count = count.unwrap_or(100);
    let bytes = bake_rocks(&folder, count);
    println!("{count} rocks, {:.0} MB of files", bytes as f64 * 1e-6);
    println!(
        "pace, GPU MiB | seconds to first picture, to full detail | peak GPU MiB, process MiB | share of frames with missing \
         pages, mean px, max px | MB/s read | main thread ms: median, 95 %, max"
    );
    for gpu_mib in [1024, 256, 26] {
        for pace in PACES {
            walk(&folder, count, gpu_mib, pace);
        }
    }
}

/// Bakes and writes missing files. Returns the bytes of all files.
fn bake_rocks(folder: &Path, count: u32) -> u64 {
    std::fs::create_dir_all(folder).unwrap();
    let files = (0..count).map(|seed| {
        let path = folder.join(file_name(seed));
        if !path.exists() {
            let rock = bake_mesh(&fieldlod_tests::rock(7, seed), &BakeConfig::fast()).unwrap();
            let file = BakedFile {
                primitives: vec![BakedPrimitive::new(0, 0, "rock", rock)],
            };
            let bytes = PagedFile::to_bytes(&file, PageOptions::default());
            std::fs::write(&path, bytes).unwrap();
        }
        path.metadata().unwrap().len()
    });
    files.sum()
}

fn file_name(seed: u32) -> String {
    format!("rock-{seed}.fieldpages")
}

fn resident_mib() -> f64 {
    process::number("status", "VmRSS:") as f64 / 1024.0
}

fn app_in(folder: &Path, count: u32, gpu_mib: u64) -> (App, Entity) {
    let mut app = App::new();
    let assets = AssetPlugin {
        file_path: folder.display().to_string(),
        ..default()
    };
    app.add_plugins((rendererless().set(assets), FieldLodPlugin));
    app.insert_resource(FieldLodAppConfig {
        memory: LodMemory {
            gpu_bytes: gpu_mib << 20,
            main_bytes: 256 << 20,
            ..default()
        },
        ..default()
    });
    finish(&mut app);
    let camera = spawn_camera(app.world_mut(), UVec2::new(1280, 720), Transform::default());
    let side = f64::from(count).sqrt().ceil() as u32;
    for seed in 0..count {
        let file = app.world().resource::<AssetServer>().load(file_name(seed));
        let place = Vec3::new((seed % side) as f32, 0.0, (seed / side) as f32) * SPACING;
        let rock = LodMesh3d::new(file, 0, 0);
        app.world_mut()
            .spawn((rock, Transform::from_translation(place)));
    }
    (app, camera)
}

/// The pose on a loop through the rocks. A jump goes to another part of the loop.
fn pose((_, speed, jump_every): (&str, f32, f32), seconds: f32) -> Transform {
    let jumps = (seconds / jump_every).floor();
    let at = |seconds: f32| {
        let turn = (seconds * speed + jumps * 61.0) / 60.0;
        Vec3::new(
            18.0 + 14.0 * turn.cos(),
            1.6,
            18.0 + 10.0 * (turn * 2.0).sin(),
        )
    };
    let target = at(seconds + 2.0 / speed.min(2.0)) - Vec3::Y * 0.4;
    Transform::from_translation(at(seconds)).looking_at(target, Vec3::Y)
}

#[derive(Clone, Copy, Default)]
struct Frame {
    memory: FieldLodMemory,
    missing_px: f32,
    milliseconds: f64,
}

fn walk(folder: &Path, count: u32, gpu_mib: u64, pace: (&str, f32, f32)) {
    let begun = Instant::now();
    let before_mib = resident_mib();
    let (mut app, camera) = app_in(folder, count, gpu_mib);
    app.world_mut().entity_mut(camera).insert(pose(pace, 0.0));
    run_until_ready(&mut app, count);
    let first = begun.elapsed();
    let memory = |app: &App| *app.world().resource::<FieldLodMemory>();
    while memory(&app).missing_pages > 0 && begun.elapsed().as_secs() < 20 {
        app.update();
    }
    let sharp = begun.elapsed();
    let read_before = process::number("io", "rchar:");
    let mut process_mib = 0.0f64;
    let frames = (0..SECONDS * 60).map(|frame| {
        let start = Instant::now();
        app.world_mut()
            .entity_mut(camera)
            .insert(pose(pace, frame as f32 / 60.0));
        app.update();
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        process_mib = process_mib.max(if frame % 30 == 0 { resident_mib() } else { 0.0 });
        std::thread::sleep(FRAME.saturating_sub(start.elapsed()));
        let stats = app.world().get::<FieldLodViewStats>(camera);
        Frame {
            memory: memory(&app),
            missing_px: stats.map_or(0.0, |stats| stats.missing_px),
            milliseconds,
        }
    });
    let frames: Vec<Frame> = frames.collect();
    let read = (process::number("io", "rchar:") - read_before) as f64 / f64::from(SECONDS);
    let mean = |of: fn(&Frame) -> f64| frames.iter().map(of).sum::<f64>() / frames.len() as f64;
    let max = |of: fn(&Frame) -> f64| frames.iter().map(of).fold(0.0, f64::max);
    let mut times: Vec<f64> = frames.iter().map(|frame| frame.milliseconds).collect();
    times.sort_by(f64::total_cmp);
    println!(
        "{:>11} {gpu_mib:>4} | {:.2} {:.2} | {:.1} {:.0} | {:.3} {:.2} {:.1} | {:.2} | {:.1} {:.1} {:.1}",
        pace.0,
        first.as_secs_f64(),
        sharp.as_secs_f64(),
        max(|frame| (frame.memory.resident_bytes + frame.memory.coming_bytes) as f64) / MIB,
        process_mib - before_mib,
        mean(|frame| f64::from(u8::from(frame.memory.missing_pages > 0))),
        mean(|frame| f64::from(frame.missing_px)),
        max(|frame| f64::from(frame.missing_px)),
        read * 1e-6,
        times[times.len() / 2],
        times[times.len() * 95 / 100],
        times[times.len() - 1],
    );
}
