//! A world of 100 rocks of 327,680 triangles under 256 MiB on the GPU and 256 MiB on their way there, from
//! simulated disks: how much is missing while one walks, drives and teleports through it, by how many pixels,
//! and how much is read. In units of a rock's radius of about a metre.
//!
//! `cargo bench -p fieldlod_stream --bench disks`. Nothing is timed: the disks are simulated, at 60 frames a
//! second, and the results are the same on every machine. Eight different rocks are baked; each of the 100 has
//! pages of its own.

#[path = "../tests/simulation/mod.rs"]
mod simulation;

use fieldlod_hierarchy::PagedMesh;
use fieldlod_stream::StreamSettings;
use glam::Vec3;

use simulation::{Disk, FRAMES_A_SECOND, FrameReport, World, rocks};

const MIB: f64 = (1 << 20) as f64;
const SECONDS: f64 = 60.0;

/// How the eye moves: metres a second, and seconds between jumps.
struct Pace {
    name: &'static str,
    speed: f64,
    jump_every: f64,
}

const PACES: [Pace; 3] = [
    Pace {
        name: "walking",
        speed: 1.5,
        jump_every: f64::INFINITY,
    },
    Pace {
        name: "driving",
        speed: 15.0,
        jump_every: f64::INFINITY,
    },
    Pace {
        name: "teleporting",
        speed: 1.5,
        jump_every: 5.0,
    },
];

fn main() {
    let page_bytes = 128 << 10;
    let rocks = rocks(100, 8, 7, page_bytes);
    let pages: usize = rocks.iter().map(|rock| rock.pages.len()).sum();
    let groups: usize = rocks.iter().map(|rock| rock.graph.groups.len()).sum();
    let units: usize = rocks.iter().map(|rock| rock.graph.units.len()).sum();
    println!("{groups} groups of {units} units");
    let all = rocks
        .iter()
        .flat_map(|rock| &rock.pages)
        .map(|page| f64::from(page.mesh_bytes));
    println!(
        "{pages} pages, {:.0} MiB on the GPU if all are resident",
        all.sum::<f64>() / MIB
    );
    println!(
        "{:.0} kB of main memory for each rock's tables",
        table_kilobytes(&rocks)
    );
    println!(
        "{:>12} {:>8} {:>6} {:>4} | {:>8} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>6} {:>6}",
        "pace",
        "GPU MiB",
        "MB/s",
        "ms",
        "GPU peak",
        "loading",
        "missing",
        "over 2",
        "mean px",
        "most px",
        "MB/s in",
        "x thr",
        "Mtri"
    );
    for gpu_mib in [256, 128, 26] {
        for pace in &PACES {
            for (megabytes, milliseconds) in
                [(10.0, 5.0), (10.0, 500.0), (100.0, 5.0), (100.0, 500.0)]
            {
                let disk = Disk {
                    bytes_a_second: megabytes * 1e6,
                    latency_seconds: milliseconds * 1e-3,
                };
                report(&rocks, pace, gpu_mib, disk);
            }
        }
    }
}

/// What this process has in memory, as Linux counts it.
fn resident_kilobytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB"));
    kilobytes
        .and_then(|number| number.parse().ok())
        .unwrap_or(f64::NAN)
}

/// What a rock without a page takes: all that selection and streaming keep of it, in ten worlds beside each
/// other.
fn table_kilobytes(rocks: &[PagedMesh]) -> f64 {
    let before = resident_kilobytes();
    let world = |_| World::new(rocks, StreamSettings::default(), Disk::IDEAL);
    let worlds: Vec<World> = (0..10).map(world).collect();
    (resident_kilobytes() - before) / (worlds.len() * rocks.len()) as f64
}

fn report(rocks: &[PagedMesh], pace: &Pace, gpu_mib: u64, disk: Disk) {
    let settings = StreamSettings {
        gpu_bytes: gpu_mib << 20,
        loading_bytes: 256 << 20,
        ..StreamSettings::default()
    };
    let mut world = World::new(rocks, settings, disk);
    let frames: Vec<FrameReport> = (0..(SECONDS * FRAMES_A_SECOND) as u64)
        .map(|frame| {
            let (eye, target) = pose(pace, frame as f64 / FRAMES_A_SECOND);
            world.frame(eye, target)
        })
        .collect();
    // From when the first second is over: the world is new until then.
    let frames = &frames[FRAMES_A_SECOND as usize..];
    let count = frames.len() as f64;
    let share = |is: fn(&FrameReport) -> bool| {
        frames.iter().filter(|frame| is(frame)).count() as f64 / count
    };
    let most = |of: fn(&FrameReport) -> f64| frames.iter().map(of).fold(0.0, f64::max);
    let sum = |of: fn(&FrameReport) -> f64| frames.iter().map(of).sum::<f64>();
    println!(
        "{:>12} {gpu_mib:>8} {:>6} {:>4} | {:>8.1} {:>7.1} {:>7.3} {:>7.3} {:>7.2} {:>7.1} {:>7.2} {:>6.2} {:>6.2}",
        pace.name,
        disk.bytes_a_second * 1e-6,
        disk.latency_seconds * 1e3,
        most(|frame| frame.gpu_bytes as f64) / MIB,
        most(|frame| frame.loading_bytes as f64) / MIB,
        share(|frame| frame.missing > 0),
        share(|frame| frame.missing_px > 2.0),
        sum(|frame| f64::from(frame.missing_px)) / count,
        most(|frame| f64::from(frame.missing_px)),
        sum(|frame| frame.read_bytes as f64) * 1e-6 / (count / FRAMES_A_SECOND),
        most(|frame| f64::from(frame.coarsening)),
        sum(|frame| frame.triangles as f64) / count * 1e-6,
    );
}

/// Along a loop through the field of rocks; after a jump, from elsewhere on it.
fn pose(pace: &Pace, seconds: f64) -> (Vec3, Vec3) {
    let jumps = (seconds / pace.jump_every).floor();
    let at = |seconds: f64| {
        let way = seconds * pace.speed + jumps * 61.0;
        let turn = (way / 60.0) as f32;
        Vec3::new(
            18.0 + 14.0 * turn.cos(),
            1.6,
            18.0 + 10.0 * (turn * 2.0).sin(),
        )
    };
    (
        at(seconds),
        at(seconds + 2.0 / pace.speed.min(2.0)) - Vec3::Y * 0.4,
    )
}
