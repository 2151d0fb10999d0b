//! The first start: time until each material is on the screen while meshes are baked.
//!
//! `cargo bench -p fieldlod_tests --bench first_start`. Eight materials, each with its own pipeline, are drawn while thirty
//! rocks of 81,920 triangles are baked: by the plugin, by tasks of the pool on which Bevy compiles pipelines, and not at
//! all. Each case is a process of its own, without the shader cache of drivers.

use std::process::Command;
use std::time::{Duration, Instant};

use bevy::prelude::*;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::tasks::AsyncComputeTaskPool;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{BakeConfig, bake_mesh};
use fieldlod_tests::apps::{bevy_mesh, windowless};
use fieldlod_tests::stage::{Pending, Stage};
use image::RgbaImage;

/// The ways to bake the rocks.
const WAYS: [&str; 3] = ["plugin", "bevy's pool", "no bakes"];
const ROCKS: u32 = 30;
const SUBDIVISIONS: u32 = 6;
/// Quads in a row, and rows.
const COLUMNS: usize = 4;
const MATERIALS: usize = 2 * COLUMNS;
const DEADLINE: Duration = Duration::from_secs(100);

fn main() {
    let way = std::env::args().find(|arg| WAYS.contains(&arg.as_str()));
    if let Some(way) = way {
        return measure(&way);
    }
    println!("seconds until each of {MATERIALS} materials is on the screen");
    for way in WAYS {
        let program = std::env::current_exe().expect("a program knows its path");
        let mut child = Command::new(program);
        child
            .arg(way)
            .env("MESA_SHADER_CACHE_DISABLE", "true")
            .env("__GL_SHADER_DISK_CACHE", "0");
        assert!(child.status().is_ok_and(|status| status.success()), "{way}");
    }
}

/// Runs an app and prints the time of each material.
fn measure(way: &str) {
    let plugins = windowless().disable::<PipelinedRenderingPlugin>();
    let Some(mut stage) = Stage::unfinished_with(plugins) else {
        return;
    };
    stage.finish();
    spawn_quads(&mut stage);
    let pose = Transform::from_xyz(0.0, 0.0, 4.0);
    let eye = stage.add_eye(pose, Color::BLACK, FieldLodCamera::default());
    let start = Instant::now();
    let bakes = start_bakes(&mut stage, way);
    // Pictures of all frames. Each arrives some frames later.
    let mut pending: Vec<Pending> = Vec::new();
    let mut shown = [None; MATERIALS];
    let mut baked_after = None;
    while shown.contains(&None) || baked_after.is_none() {
        assert!(start.elapsed() < DEADLINE, "{shown:?} {baked_after:?}");
        pending.extend(stage.request(&[&eye]));
        stage.app.update();
        pending.retain(|one| match one.take() {
            Some(picture) => {
                record_shown(&picture, start.elapsed(), &mut shown);
                false
            }
            None => true,
        });
        if baked_after.is_none() && are_done(&stage, &bakes) {
            baked_after = Some(start.elapsed());
        }
    }
    let mut seconds: Vec<f64> = shown.iter().flatten().map(Duration::as_secs_f64).collect();
    seconds.sort_by(f64::total_cmp);
    let seconds: Vec<String> = seconds.iter().map(|s| format!("{s:.2}")).collect();
    let baked = baked_after.unwrap_or_default().as_secs_f64();
    println!("{way:<12} {}; baked after {baked:.1}", seconds.join(" "));
}

/// Spawns quads with different alpha modes, lit and unlit.
fn spawn_quads(stage: &mut Stage) {
    let quad = stage.add(Mesh::from(Rectangle::new(0.5, 0.5)));
    let modes = [
        AlphaMode::Opaque,
        AlphaMode::Mask(0.5),
        AlphaMode::Blend,
        AlphaMode::Add,
    ];
    for index in 0..MATERIALS {
        let material = stage.add(StandardMaterial {
            alpha_mode: modes[index % COLUMNS],
            unlit: index >= COLUMNS,
            emissive: LinearRgba::WHITE * 4.0,
            ..default()
        });
        let place = Transform::from_translation(place_of(index));
        stage.spawn((Mesh3d(quad.clone()), MeshMaterial3d(material), place));
    }
}

fn place_of(index: usize) -> Vec3 {
    let cell = [index % COLUMNS, index / COLUMNS].map(|cell| cell as f32);
    Vec3::new(cell[0] * 0.7 - 1.05, cell[1] * 0.7 - 0.35, 0.0)
}

/// Records the time of materials that were not visible before.
fn record_shown(picture: &RgbaImage, now: Duration, shown: &mut [Option<Duration>]) {
    let size = picture.width() as f32;
    // The default field of view is 45° high. The camera is 4 away.
    let px_per_unit = size * 0.5 / (4.0 * 0.414_213_57);
    for (index, shown) in shown.iter_mut().enumerate() {
        let at = place_of(index) * px_per_unit;
        let (x, y) = (size * 0.5 + at.x, size * 0.5 - at.y);
        let pixel = picture.get_pixel(x as u32, y as u32);
        if pixel.0[..3].iter().any(|&channel| channel > 40) {
            shown.get_or_insert(now);
        }
    }
}

/// Starts to bake rocks behind the camera.
fn start_bakes(stage: &mut Stage, way: &str) -> Vec<bevy::tasks::Task<()>> {
    let mut tasks = Vec::new();
    for seed in 0..ROCKS {
        let rock = fieldlod_tests::rock(SUBDIVISIONS, seed);
        match way {
            "plugin" => {
                let mesh = stage.add(bevy_mesh(&rock));
                let behind = Transform::from_xyz(0.0, 0.0, 50.0);
                stage.spawn((Mesh3d(mesh), AutoLod::default(), behind));
            }
            "bevy's pool" => tasks.push(AsyncComputeTaskPool::get().spawn(async move {
                bake_mesh(&rock, &BakeConfig::default()).expect("a rock can be baked");
            })),
            _ => {}
        }
    }
    tasks
}

fn are_done(stage: &Stage, tasks: &[bevy::tasks::Task<()>]) -> bool {
    let progress = stage.app.world().resource::<FieldLodProgress>();
    progress.waiting == 0 && tasks.iter().all(bevy::tasks::Task::is_finished)
}
