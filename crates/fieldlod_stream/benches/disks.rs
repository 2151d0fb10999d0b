//! Missing pages of a world of 100 rocks with 327,680 triangles, for two GPU budgets, two simulated disks and
//! three kinds of movement. A rock has a radius of about a metre.
//!
//! `cargo bench -p fieldlod_stream --bench disks`. All machines give the same results, except for main memory.
//! The 100 rocks are copies of eight baked rocks. Each copy has its own pages.

#[path = "../tests/simulation/mod.rs"]
mod simulation;

use fieldlod_hierarchy::PagedMesh;
use fieldlod_stream::StreamSettings;
use glam::Vec3;

use simulation::{Disk, FRAMES_PER_SECOND, FrameReport, World, rocks};

const MIB: f64 = (1 << 20) as f64;
const SECONDS: f64 = 60.0;
const PICTURE_HEIGHT: f32 = 720.0;
/// Mean of the loop of [`pose`], which is 104.4 m long.
const METRES_PER_RADIAN: f64 = 104.4 / std::f64::consts::TAU;

/// A kind of movement: its name, mean metres per second, and seconds between jumps.
type Pace = (&'static str, f64, f64);

const PACES: [Pace; 3] = [
    ("walking", 1.5, f64::INFINITY),
    ("driving", 15.0, f64::INFINITY),
    ("teleporting", 1.5, 5.0),
];

fn main() {
    let rocks = rocks(100, 8, 7, 128 << 10);
    let pages = rocks.iter().flat_map(|rock| &rock.pages);
    let gpu_bytes = pages.clone().map(|page| f64::from(page.mesh_bytes));
    let (count, gpu_mib) = (pages.count(), gpu_bytes.sum::<f64>() / MIB);
    println!("{count} pages, {gpu_mib:.0} MiB on the GPU if all are resident");
    let kilobytes = table_kilobytes(&rocks);
    println!("{kilobytes:.0} kB of main memory per rock for tables");
    println!(
        "       pace  GPU MiB   MB/s   ms | GPU peak loading missing  over 2 mean px  max px MB/s in  x thr"
    );
    for gpu_mib in [256, 26] {
        for pace in PACES {
            for (megabytes, milliseconds) in [(10.0, 500.0), (100.0, 5.0)] {
                let disk = Disk {
                    bytes_per_second: megabytes * 1e6,
                    latency_seconds: milliseconds * 1e-3,
                };
                report(&rocks, pace, gpu_mib, disk);
            }
        }
    }
}

/// Main memory of this process in kB; NaN on systems other than Linux.
fn resident_kilobytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB"));
    kilobytes.map_or(f64::NAN, |number| number.parse().unwrap_or(f64::NAN))
}

/// Main memory per rock without resident pages, in kB: the mean over ten worlds.
fn table_kilobytes(rocks: &[PagedMesh]) -> f64 {
    let before = resident_kilobytes();
    let world = |_| World::new(rocks, StreamSettings::default(), Disk::IDEAL);
    let worlds: Vec<World> = (0..10).map(world).collect();
    (resident_kilobytes() - before) / (worlds.len() * rocks.len()) as f64
}

fn report(rocks: &[PagedMesh], pace: Pace, gpu_mib: u64, disk: Disk) {
    let settings = StreamSettings {
        gpu_bytes: gpu_mib << 20,
        loading_bytes: 256 << 20,
        ..StreamSettings::default()
    };
    let mut world = World::new(rocks, settings, disk);
    let draw = |frame| {
        let (eye, target) = pose(pace, f64::from(frame) / FRAMES_PER_SECOND);
        let report = world.frame(eye, target);
        // Errors are infinite while the eye is inside the bounds of missing geometry.
        let missing_px = report.missing_px.min(PICTURE_HEIGHT);
        FrameReport {
            missing_px,
            ..report
        }
    };
    let frames: Vec<FrameReport> = (0..(SECONDS * FRAMES_PER_SECOND) as u32)
        .map(draw)
        .collect();
    // The first second is skipped, because first pages load in it.
    let frames = &frames[FRAMES_PER_SECOND as usize..];
    let max = |of: fn(&FrameReport) -> f64| frames.iter().map(of).fold(0.0, f64::max);
    let mean =
        |of: fn(&FrameReport) -> f64| frames.iter().map(of).sum::<f64>() / frames.len() as f64;
    println!(
        "{:>11} {gpu_mib:>8} {:>6} {:>4} | {:>8.1} {:>7.1} {:>7.3} {:>7.3} {:>7.2} {:>7.1} {:>7.2} {:>6.2}",
        pace.0,
        disk.bytes_per_second * 1e-6,
        disk.latency_seconds * 1e3,
        max(|frame| frame.gpu_bytes as f64) / MIB,
        max(|frame| frame.loading_bytes as f64) / MIB,
        mean(|frame| f64::from(frame.missing > 0)),
        mean(|frame| f64::from(frame.missing_px > 2.0)),
        mean(|frame| f64::from(frame.missing_px)),
        max(|frame| f64::from(frame.missing_px)),
        mean(|frame| frame.read_bytes as f64) * 1e-6 * FRAMES_PER_SECOND,
        max(|frame| f64::from(frame.coarsening)),
    );
}

/// Eye and target on a loop through the rocks.
fn pose((_, speed, jump_every): Pace, seconds: f64) -> (Vec3, Vec3) {
    let jumps = (seconds / jump_every).floor();
    let at = |seconds: f64| {
        let angle = ((seconds * speed + jumps * 61.0) / METRES_PER_RADIAN) as f32;
        let (x, z) = (14.0 * angle.cos(), 10.0 * (angle * 2.0).sin());
        Vec3::new(18.0 + x, 1.6, 18.0 + z)
    };
    let target = at(seconds + 2.0 / speed.min(2.0)) - Vec3::Y * 0.4;
    (at(seconds), target)
}
