//! Whole frames, on whatever adapter there is: full detail, this plugin at one pixel, and three levels
//! behind Bevy's `VisibilityRange`, at distances that give the same image error.
//!
//! `cargo bench -p fieldlod_tests --bench whole_frame`. The methods draw in turn, so that all share what
//! else the machine does; times are those of whole updates until the GPU is done.

mod field_of_rocks;
mod levels;

use std::time::{Duration, Instant};

use bevy_fieldlod::LodKind;
use field_of_rocks::{Method, RockScene};
use image::RgbaImage;
use levels::Level;

/// Steps of the camera along which frames are timed.
const STEPS: usize = 7;
/// Steps at which pictures are compared.
const COMPARED: [usize; 3] = [0, 3, 6];
/// Halvings of the interval in which the scale of the distances is searched, at most.
const SEARCH_STEPS: usize = 16;
/// Image errors that differ by no more than this share are the same. Each rock that changes its level
/// is a step of the error, so that not every error is to be had.
const SAME: f64 = 0.02;

fn main() {
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
}

fn measured(name: &'static str, mut scene: RockScene, full: &[RgbaImage]) -> Row {
    let error = rmse(&scene.pictures(&COMPARED), full);
    Row {
        name,
        error,
        triangles: scene.triangles_drawn(),
        scene,
        times: Vec::new(),
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
    for step in 0..STEPS {
        for row in &mut *rows {
            row.scene.go_to(step);
            let start = Instant::now();
            row.scene.draw();
            row.times.push(start.elapsed());
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
        "{:<28} {:>10} {:>10} {:>8} {:>9} {:>7} {:>9}",
        "", "RMSE /255", "triangles", "entities", "mesh MB", "ms", "ratio"
    );
    let median = |row: &Row| {
        let mut times = row.times.clone();
        times.sort_unstable();
        times[times.len() / 2].as_secs_f64() * 1e3
    };
    let of_full = median(&rows[0]);
    for row in rows {
        println!(
            "{:<28} {:>10.3} {:>10} {:>8} {:>9.1} {:>7.0} {:>9.3}",
            row.name,
            row.error,
            row.triangles,
            row.scene.mesh_entities(),
            row.scene.mesh_bytes() as f64 / 1e6,
            median(row),
            median(row) / of_full
        );
    }
}
