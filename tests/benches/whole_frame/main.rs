//! Whole frames, on whatever adapter there is: full detail, this plugin at one pixel, and three levels
//! behind Bevy's `VisibilityRange`, at distances that give the same image error.
//!
//! `cargo bench -p fieldlod_tests --bench whole_frame`. The methods draw in turn, so that all share what
//! else the machine does; "ms" are whole updates until the GPU is done, then the main world, the render world with
//! the extraction, and the GPU's own clock where it has one, for all but shadows, which Bevy does not time.
//! `-- --walkthrough` draws half a second of the walkthrough on the same adapter afterwards, by each method; a path to
//! the program may follow, if it was built before.
//!
//! Bevy's meshlets are not among the methods: their feature links another version of meshoptimizer under the same C
//! symbols, and has to compile Bevy anew. `benches/meshlets` is a program of its own for them.

mod field_of_rocks;
mod levels;
mod walkthrough;

use std::process::ExitCode;
use std::time::{Duration, Instant};

use bevy_fieldlod::LodKind;
use field_of_rocks::{Method, RockScene};
use fieldlod_tests::frame_times::{FrameTimes, median};
use image::RgbaImage;
use levels::Level;

/// Steps of the camera along which frames are timed.
const STEPS: usize = 7;
/// Rounds of those steps, at most, and when no other begins.
const ROUNDS: usize = 40;
const LAST_ROUND: Duration = Duration::from_secs(20);
/// Steps at which pictures are compared.
const COMPARED: [usize; 3] = [0, 3, 6];
/// Halvings of the interval in which the scale of the distances is searched, at most.
const SEARCH_STEPS: usize = 16;
/// Image errors that differ by no more than this share are the same. Each rock that changes its level
/// is a step of the error, so that not every error is to be had.
const SAME: f64 = 0.02;

fn main() -> ExitCode {
    compare_methods();
    let mut args = std::env::args().skip_while(|arg| arg != "--walkthrough");
    match args.next() {
        Some(_) => walkthrough::compare(args.find(|arg| !arg.starts_with('-')).as_deref()),
        None => ExitCode::SUCCESS,
    }
}

fn compare_methods() {
    let levels = levels::by_rock();
    let Some(mut full) = RockScene::new(&levels, Method::Full) else {
        return;
    };
    let pictures = full.pictures(&COMPARED);
    let mut rows = vec![
        measured("full detail", full, &pictures),
        measured(
            "plugin, 1 px",
            scene(&levels, Method::AutoLod(LodKind::Auto)),
            &pictures,
        ),
        measured(
            "plugin, 1 px, whole meshes",
            scene(&levels, Method::AutoLod(LodKind::WholeMesh)),
            &pictures,
        ),
    ];
    let range = ranges_of_error(&levels, rows[1].error, &pictures);
    rows.push(measured("VisibilityRange, 3 levels", range, &pictures));
    time(&mut rows);
    print(&rows);
}

fn scene(levels: &[Vec<Level>], method: Method) -> RockScene {
    RockScene::new(levels, method).expect("the first one had an adapter")
}

/// The scene drawn by one method, and what was measured.
struct Row {
    name: &'static str,
    scene: RockScene,
    /// Root mean square of the difference from full detail, of 255.
    error: f64,
    triangles: u64,
    times: Vec<Duration>,
    parts: Vec<FrameTimes>,
}

fn measured(name: &'static str, mut scene: RockScene, full: &[RgbaImage]) -> Row {
    let error = rmse(&scene.pictures(&COMPARED), full);
    Row {
        name,
        error,
        triangles: scene.triangles_drawn(),
        scene,
        times: Vec::new(),
        parts: Vec::new(),
    }
}

/// The levels at a scale of their distances at which the image error is `error`, but for [`SAME`].
fn ranges_of_error(levels: &[Vec<Level>], error: f64, full: &[RgbaImage]) -> RockScene {
    let (mut near, mut far) = (0.02f32, 8.0f32);
    for _ in 0..SEARCH_STEPS {
        let scale = (near * far).sqrt();
        let mut scene = scene(levels, Method::Ranges { scale });
        let found = rmse(&scene.pictures(&COMPARED), full);
        eprintln!("distances times {scale:.3}: image error {found:.3} for {error:.3}");
        if (found - error).abs() <= SAME * error {
            return scene;
        }
        if found > error {
            near = scale;
        } else {
            far = scale;
        }
    }
    panic!("no scale of the distances gives the same image error");
}

fn time(rows: &mut [Row]) {
    let begin = Instant::now();
    for _ in 0..ROUNDS {
        for step in 0..STEPS {
            for row in &mut *rows {
                row.scene.go_to(step);
                let start = Instant::now();
                let parts = row.scene.draw();
                row.times.push(start.elapsed());
                row.parts.push(parts);
            }
        }
        if begin.elapsed() > LAST_ROUND {
            break;
        }
    }
}

fn rmse(pictures: &[RgbaImage], full: &[RgbaImage]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (picture, full) in pictures.iter().zip(full) {
        for (a, b) in picture.pixels().zip(full.pixels()) {
            for channel in 0..3 {
                let off = f64::from(a.0[channel]) - f64::from(b.0[channel]);
                sum += off * off;
                count += 1.0;
            }
        }
    }
    f64::sqrt(sum / count)
}

fn print(rows: &[Row]) {
    println!("{}", rows[0].scene.adapter());
    println!(
        "{:<28} {:>10} {:>10} {:>8} {:>9} {:>8} {:>7} {:>8} {:>8} {:>8}",
        "", "RMSE /255", "triangles", "entities", "mesh MB", "ms", "ratio", "main", "render", "GPU"
    );
    let ms = |times: &mut dyn Iterator<Item = Duration>| median(times).as_secs_f64() * 1e3;
    let frame_ms = |row: &Row| ms(&mut row.times.iter().copied());
    let of_full = frame_ms(&rows[0]);
    for row in rows {
        let gpu_ms = row.scene.gpu_ms();
        println!(
            "{:<28} {:>10.3} {:>10} {:>8} {:>9.1} {:>8.2} {:>7.3} {:>8.2} {:>8.2} {:>8}",
            row.name,
            row.error,
            row.triangles,
            row.scene.mesh_entities(),
            row.scene.mesh_bytes() as f64 / 1e6,
            frame_ms(row),
            frame_ms(row) / of_full,
            ms(&mut row.parts.iter().map(|parts| parts.main)),
            ms(&mut row.parts.iter().map(|parts| parts.extract + parts.render)),
            gpu_ms.map_or("-".into(), |ms| format!("{ms:.2}")),
        );
    }
}
