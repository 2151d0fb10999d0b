//! Whole frames on the adapter at hand, each method at its error from the truth, with shadows and without.
//!
//! `cargo bench -p fieldlod_tests --bench whole_frame -- town 4000` draws a town of 4,000 entities; `town` alone has
//! 46,717. Other scenes are `forest`, `rocks` and `boulders`, the default. The methods draw in turn. "frame" is a whole
//! update with the wait for the GPU; "main" and "render" are its parts on the CPU. `-- walkthrough` draws the
//! walkthrough at full detail and by the plugin, with and without visible flux.
//!
//! The camera has four samples per pixel, Bevy's default. The truth has 64, as in the bench `truth`. The distances of
//! hand-made levels have a common factor, at which their error from the truth is that of the plugin at 1 px (`high`).
//! `-- town medium` also finds the factor for the plugin at 2 px. Errors are RMSE of 255.
//!
//! `FIELDLOD_PICTURES=folder` writes a picture of each.
//!
//! Bevy's meshlets have a program of their own, `benches/meshlets`: they link another version of meshoptimizer under
//! the same C symbols. `-- meshlets` runs it too.

#[path = "../truth/measure.rs"]
#[expect(dead_code, reason = "the bench `truth` uses more of it")]
mod measure;
#[path = "../walkthrough.rs"]
mod walkthrough;

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use bevy::math::UVec2;
use bevy::prelude::Transform;
use bevy::render::view::Msaa;
use fieldlod_tests::frame_times::{FrameTimes, median};
use fieldlod_tests::scenes::{Method, Scene, SceneApp};
use fieldlod_tests::stage::Stage;

use measure::{Linear, SUPERSAMPLED, pictures, rmse};

const SIZE_PX: UVec2 = UVec2::new(960, 540);
/// Metres along the path of compared pictures, and of timed frames.
const COMPARED: [f32; 2] = [0.0, 2.4];
const STEPS: u8 = 7;
const STEP: f32 = 0.4;
/// Largest number of rounds over the steps, and the time after which no round starts.
const ROUNDS: usize = 40;
const LAST_ROUND: Duration = Duration::from_secs(20);
/// Steps of the search for the factor of distances. Each halves the interval.
const SEARCH_STEPS: usize = 9;
/// Relative difference up to which errors count as equal. Each change of a level is a step of the error, so that
/// a smaller difference may be out of reach.
const SAME: f64 = 0.03;

fn main() -> Result<(), String> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let has = |name: &str| args.iter().any(|arg| arg == name);
    if has("walkthrough") {
        return compare_walkthrough();
    }
    let size = args.iter().find_map(|arg| arg.parse().ok());
    let scene = args.iter().find_map(|name| Scene::named(name, size));
    let scene = scene.unwrap_or_else(|| Scene::named("boulders", size).expect("a name"));
    compare_methods(&scene, has("medium"));
    if has("meshlets") {
        return run_meshlets();
    }
    Ok(())
}

fn compare_methods(scene: &Scene, also_as_medium: bool) {
    let full_detail = Method::Full { gpu: false };
    let Some(mut truth) = app_of(scene, full_detail, SUPERSAMPLED) else {
        return;
    };
    println!("{}, {}", scene.name, truth.adapter());
    let poses = COMPARED.map(|metres| scene.pose(metres));
    let (truth, _) = pictures(&mut truth, &poses, SUPERSAMPLED);
    let app = |method| app_of(scene, method, 1).expect("there was an adapter");
    let mut full = app(full_detail);
    let (of_full, _) = pictures(&mut full, &poses, 1);
    let references = References {
        poses,
        truth,
        full: of_full,
    };
    let row = |name, app| Row::new(name, app, &references);
    let mut rows = vec![
        row("full detail", full),
        row("full, NoCpuCulling", app(Method::Full { gpu: true })),
        row("plugin, low", app(Method::auto_lod(4.0))),
        row("plugin, medium", app(Method::auto_lod(2.0))),
        row("plugin, high", app(Method::auto_lod(1.0))),
    ];
    let mut matched = vec![(4, ["ranges", "ranges, NoCpuCulling"])];
    if also_as_medium {
        matched.push((3, ["ranges, as medium", "NoCpuCulling, as medium"]));
    }
    for (plugin, names) in matched {
        let mut ranges = app(Method::Ranges { gpu: false });
        let factor = match_error(&mut ranges, rows[plugin].error, &references);
        let mut on_gpu = app(Method::Ranges { gpu: true });
        on_gpu.scale_ranges(factor);
        rows.push(row(names[0], ranges));
        rows.push(row(names[1], on_gpu));
        println!("{}: distances times {factor:.3}", names[0]);
    }
    for has_shadows in [true, false] {
        println!("{}", if has_shadows { "shadows" } else { "no shadows" });
        time(&mut rows, has_shadows);
        print(&rows);
    }
}

/// An app with a picture `scale` times as large.
fn app_of(scene: &Scene, method: Method, scale: u32) -> Option<SceneApp> {
    let mut app = SceneApp::new(Stage::stock()?, scene, method, SIZE_PX * scale, true);
    app.set_msaa(Msaa::Sample4);
    app.wait_for_levels();
    Some(app)
}

/// The pictures with which all methods are compared.
struct References {
    poses: [Transform; 2],
    truth: Vec<Linear>,
    full: Vec<Linear>,
}

/// The scene drawn by one method, and its measurements.
struct Row {
    name: &'static str,
    app: SceneApp,
    /// From the truth.
    error: f64,
    /// From full detail as Bevy draws it.
    error_from_full: f64,
    triangles: u64,
    /// Each frame with the wait for the GPU, and its parts.
    times: Vec<(Duration, FrameTimes)>,
}

impl Row {
    fn new(name: &'static str, mut app: SceneApp, references: &References) -> Self {
        let (pictures, triangles) = pictures(&mut app, &references.poses, 1);
        if let Some(folder) = std::env::var_os("FIELDLOD_PICTURES") {
            let file = Path::new(&folder).join(format!("{name}.png"));
            pictures[0]
                .to_image()
                .save(file)
                .expect("the folder exists");
        }
        let error = rmse(&pictures, &references.truth);
        let error_from_full = rmse(&pictures, &references.full);
        eprintln!("{name}: {error:.3} from the truth, {triangles} triangles");
        let times = Vec::new();
        Self {
            name,
            app,
            error,
            error_from_full,
            triangles,
            times,
        }
    }

    /// The median of a time, in milliseconds.
    fn median_ms(&self, time: fn(&(Duration, FrameTimes)) -> Duration) -> f64 {
        median(self.times.iter().map(time)).as_secs_f64() * 1e3
    }
}

/// Scales the distances of hand-made levels until the error from the truth is `error`, up to [`SAME`]. Returns the
/// factor with the nearest error.
fn match_error(app: &mut SceneApp, error: f64, references: &References) -> f32 {
    let (mut near, mut far) = (0.05f32, 20.0f32);
    let (mut best, mut distance) = (1.0, f64::INFINITY);
    for _ in 0..SEARCH_STEPS {
        let factor = (near * far).sqrt();
        app.scale_ranges(factor);
        let found = rmse(&pictures(app, &references.poses, 1).0, &references.truth);
        eprintln!("distances times {factor:.3}: error {found:.3} for {error:.3}");
        if (found - error).abs() < distance {
            (best, distance) = (factor, (found - error).abs());
        }
        if distance <= SAME * error {
            break;
        }
        if found > error {
            near = factor;
        } else {
            far = factor;
        }
    }
    app.scale_ranges(best);
    best
}

fn time(rows: &mut [Row], has_shadows: bool) {
    for row in &mut *rows {
        row.times.clear();
        row.app.set_shadows(has_shadows);
        // The first frames compile pipelines and allocate shadow maps.
        for _ in 0..2 {
            row.app.draw();
        }
    }
    let start = Instant::now();
    for _ in 0..ROUNDS {
        for step in 0..STEPS {
            for row in &mut *rows {
                row.app.go_to(f32::from(step) * STEP);
                row.times.push(row.app.draw());
            }
        }
        if start.elapsed() > LAST_ROUND {
            break;
        }
    }
}

fn print(rows: &[Row]) {
    println!(
        "{:<23} {:>9} {:>9} {:>10} {:>8} {:>8} {:>8} {:>7} {:>8} {:>8}",
        "",
        "truth",
        "full",
        "triangles",
        "entities",
        "mesh MB",
        "frame",
        "of full",
        "main",
        "render"
    );
    let of_full = rows[0].median_ms(|(whole, _)| *whole);
    for row in rows {
        let ms = row.median_ms(|(whole, _)| *whole);
        println!(
            "{:<23} {:>9.3} {:>9.3} {:>10} {:>8} {:>8.1} {ms:>8.2} {:>7.3} {:>8.2} {:>8.2}",
            row.name,
            row.error,
            row.error_from_full,
            row.triangles,
            row.app.entities(),
            row.app.mesh_bytes() as f64 / 1e6,
            ms / of_full,
            row.median_ms(|(_, parts)| parts.main),
            row.median_ms(|(_, parts)| parts.extract + parts.render),
        );
    }
}

/// Prints medians over the frames of the walkthrough's path.
fn compare_walkthrough() -> Result<(), String> {
    const COLUMNS: [&str; 6] = [
        "triangles_drawn",
        "frame_ms",
        "main_ms",
        "render_ms",
        "wait_ms",
        "selection_ms",
    ];
    println!(
        "{:<28}{}",
        "",
        COLUMNS.map(|name| format!("{name:>16}")).concat()
    );
    let methods: [(&str, &[&str]); 3] = [
        ("full detail", &["--plain"]),
        ("plugin, 1 px", &[]),
        ("plugin, 1 px, visible flux", &["--visible-flux"]),
    ];
    for (name, options) in methods {
        let summary = walkthrough::summary_of(&[&["--full"], options].concat())?;
        let column = |name| summary[name]["median"].as_f64().unwrap_or(f64::NAN);
        let columns = COLUMNS.map(|name| format!("{:>16.2}", column(name)));
        println!("{name:<28}{}", columns.concat());
    }
    Ok(())
}

/// Runs the program of the meshlets, which fails if the adapter cannot run them.
fn run_meshlets() -> Result<(), String> {
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/meshlets/Cargo.toml");
    let program = Command::new(env!("CARGO"))
        .args(["run", "--release", "--manifest-path", manifest])
        .status();
    match program.map(|status| status.code()) {
        Ok(Some(0)) => Ok(()),
        Ok(Some(2)) => {
            println!("meshlets: this adapter cannot run them");
            Ok(())
        }
        other => Err(format!("meshlets: {other:?}")),
    }
}
