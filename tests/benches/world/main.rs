//! A walk of the plugin through 100 different rocks of 327,680 triangles that are read in parts: memory, what is missing
//! and by how many pixels, bytes read and time of the main thread.
//!
//! `FIELDLOD_WORLD=folder cargo bench -p fieldlod_tests --bench world` bakes the rocks into the folder, unless they are
//! there, and walks. Frames are 60 a second by the clock, files are those of the system, without a renderer. `-- 10` does
//! with ten rocks. Figures are in `crates/fieldlod_stream/benches/RECORD.md`.

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
/// Between rocks of a radius of about one, in metres.
const SPACING: f32 = 4.0;

/// Names, metres a second, and seconds between jumps.
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
    if std::env::args().any(|arg| arg == "bake") {
        return;
    }
    println!(
        "pace, GPU MiB | at start: s to first, s to sharp | peak GPU MiB, loading MiB, process MiB | frames with pages \
         missing, over 2 px, mean px, most px | MB/s read, of pages, x threshold | main thread ms: median, 95 %, most"
    );
    for gpu_mib in [1024, 256, 26] {
        for pace in PACES {
            walk(&folder, count, gpu_mib, pace);
        }
    }
}

/// Writes those that are not there; bytes of all files.
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

/// What this process has in memory, as Linux counts it.
fn resident_mib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB"));
    kilobytes.map_or(f64::NAN, |number| number.trim().parse().unwrap_or(f64::NAN)) / 1024.0
}

fn app_in(folder: &Path, count: u32, gpu_mib: u64) -> (App, Entity) {
    let mut app = App::new();
    let assets = AssetPlugin {
        file_path: folder.display().to_string(),
        ..default()
    };
    app.add_plugins((rendererless().set(assets), FieldLodPlugin));
    app.insert_resource(FieldLodConfig {
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

/// Along a loop through the rocks; after a jump, from elsewhere on it.
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
    let read_before = bytes_read();
    let pages_before = memory(&app).loaded_file_bytes;
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
    let read = (bytes_read() - read_before) as f64 / f64::from(SECONDS);
    let of_pages = (memory(&app).loaded_file_bytes - pages_before) as f64 / f64::from(SECONDS);
    let share = |is: fn(&Frame) -> bool| {
        frames.iter().filter(|frame| is(frame)).count() as f64 / frames.len() as f64
    };
    let most = |of: fn(&Frame) -> f64| frames.iter().map(of).fold(0.0, f64::max);
    let mut times: Vec<f64> = frames.iter().map(|frame| frame.milliseconds).collect();
    times.sort_by(f64::total_cmp);
    println!(
        "{:>11} {gpu_mib:>4} | {:.2} {:.2} | {:.1} {:.1} {:.0} | {:.3} {:.3} {:.2} {:.1} | {:.2} {:.2} {:.2} | {:.1} {:.1} {:.1}",
        pace.0,
        first.as_secs_f64(),
        sharp.as_secs_f64(),
        most(|frame| (frame.memory.resident_bytes + frame.memory.coming_bytes) as f64) / MIB,
        most(|frame| frame.memory.loading_bytes as f64) / MIB,
        process_mib - before_mib,
        share(|frame| frame.memory.missing_pages > 0),
        share(|frame| frame.missing_px > 2.0),
        frames
            .iter()
            .map(|frame| f64::from(frame.missing_px))
            .sum::<f64>()
            / frames.len() as f64,
        most(|frame| f64::from(frame.missing_px)),
        read * 1e-6,
        of_pages * 1e-6,
        most(|frame| f64::from(frame.memory.coarsening)),
        times[times.len() / 2],
        times[times.len() * 95 / 100],
        times[times.len() - 1],
    );
}

/// Bytes that this process has read so far, from disks or what the system keeps of them.
fn bytes_read() -> u64 {
    let counts = std::fs::read_to_string("/proc/self/io").unwrap_or_default();
    let line = counts.lines().find_map(|line| line.strip_prefix("rchar:"));
    line.and_then(|line| line.trim().parse().ok()).unwrap_or(0)
}
