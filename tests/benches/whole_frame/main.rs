//! Whole frames on the adapter at hand: full detail, the plugin at one pixel, and three hand-made levels with
//! `VisibilityRange` at distances that give the same image error.
//!
//! `cargo bench -p fieldlod_tests --bench whole_frame` draws a field of rocks. The methods draw in turn. "ms" is a whole
//! update with the wait for the GPU; "main" and "render" are its parts on the CPU. `-- --walkthrough` also draws the
//! walkthrough by each method.
//!
//! Bevy's meshlets have a program of their own, `benches/meshlets`: they link another version of meshoptimizer under the
//! same C symbols.

mod field_of_rocks;
mod levels;
mod walkthrough;

use std::time::{Duration, Instant};

use bevy::prelude::Mesh;
use bevy_fieldlod::LodKind;
use field_of_rocks::{Method, RockScene};
use fieldlod_tests::frame_times::{FrameTimes, median};
use image::RgbaImage;

/// Steps of the camera for timed frames.
const STEPS: usize = 7;
/// Rounds over those steps, unless [`LAST_ROUND`] has passed.
const ROUNDS: usize = 40;
const LAST_ROUND: Duration = Duration::from_secs(20);
/// Steps of the camera for compared pictures.
const COMPARED: [usize; 3] = [0, 3, 6];
/// Halvings of the interval of the scale of distances.
const SEARCH_STEPS: usize = 16;
/// Relative difference of equal image errors. Each rock that changes its level is a step of the error, so that not
/// every error can be reached.
const SAME: f64 = 0.02;

fn main() -> Result<(), String> {
    compare_methods();
    if std::env::args().any(|arg| arg == "--walkthrough") {
        walkthrough::compare()?;
    }
    Ok(())
}

fn compare_methods() {
    let levels = levels::by_rock();
    let Some(mut full) = RockScene::new(&levels, Method::Full) else {
        return;
    };
    println!("{}", full.adapter());
    let pictures = full.pictures(&COMPARED);
    let lod = |kind| RockScene::new(&levels, Method::AutoLod(kind)).expect("there is an adapter");
    let mut rows = vec![
        Row::new("full detail", full, &pictures),
        Row::new("plugin, 1 px", lod(LodKind::Auto), &pictures),
        Row::new(
            "plugin, 1 px, whole meshes",
            lod(LodKind::WholeMesh),
            &pictures,
        ),
    ];
    let ranges = ranges_of_error(&levels, rows[1].error, &pictures);
    rows.push(Row::new("VisibilityRange, 3 levels", ranges, &pictures));
    time(&mut rows);
    print(&rows);
}

/// The scene drawn by one method, and its measurements.
struct Row {
    name: &'static str,
    scene: RockScene,
    /// Root mean square of the difference from full detail, of 255.
    error: f64,
    triangles: u64,
    /// Each frame with the wait for the GPU, and its parts.
    times: Vec<(Duration, FrameTimes)>,
}

impl Row {
    fn new(name: &'static str, mut scene: RockScene, full: &[RgbaImage]) -> Self {
        let error = rmse(&scene.pictures(&COMPARED), full);
        Self {
            name,
            error,
            triangles: scene.triangles_drawn(),
            scene,
            times: Vec::new(),
        }
    }

    /// The median of a time, in milliseconds.
    fn median_ms(&self, time: fn(&(Duration, FrameTimes)) -> Duration) -> f64 {
        median(self.times.iter().map(time)).as_secs_f64() * 1e3
    }
}

/// The hand-made levels at a scale of their distances with the image error `error`, up to [`SAME`].
fn ranges_of_error(levels: &[Vec<Mesh>], error: f64, full: &[RgbaImage]) -> RockScene {
    let (mut near, mut far) = (0.02f32, 8.0f32);
    for _ in 0..SEARCH_STEPS {
        let scale = (near * far).sqrt();
        let scene = RockScene::new(levels, Method::Ranges { scale });
        let mut scene = scene.expect("there is an adapter");
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
    let start = Instant::now();
    for _ in 0..ROUNDS {
        for step in 0..STEPS {
            for row in &mut *rows {
                row.scene.go_to(step);
                row.times.push(row.scene.draw());
            }
        }
        if start.elapsed() > LAST_ROUND {
            break;
        }
    }
}

fn rmse(pictures: &[RgbaImage], full: &[RgbaImage]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (picture, full) in pictures.iter().zip(full) {
        for (a, b) in picture.pixels().zip(full.pixels()) {
            for channel in 0..3 {
                sum += (f64::from(a.0[channel]) - f64::from(b.0[channel])).powi(2);
                count += 1.0;
            }
        }
    }
    f64::sqrt(sum / count)
}

fn print(rows: &[Row]) {
    println!(
        "{:<28} {:>9} {:>10} {:>8} {:>8} {:>8} {:>7} {:>8} {:>8}",
        "", "RMSE /255", "triangles", "entities", "mesh MB", "ms", "of full", "main", "render"
    );
    let of_full = rows[0].median_ms(|(whole, _)| *whole);
    for row in rows {
        let ms = row.median_ms(|(whole, _)| *whole);
        println!(
            "{:<28} {:>9.3} {:>10} {:>8} {:>8.1} {ms:>8.2} {:>7.3} {:>8.2} {:>8.2}",
            row.name,
            row.error,
            row.triangles,
            row.scene.mesh_entities(),
            row.scene.mesh_bytes() as f64 / 1e6,
            ms / of_full,
            row.median_ms(|(_, parts)| parts.main),
            row.median_ms(|(_, parts)| parts.extract + parts.render),
        );
    }
}
