//! The first start: time until the first picture and until all levels are drawn, and memory.
//!
//! `cargo bench -p fieldlod_tests --bench first_start -- town` draws the town by Bevy alone and by the plugin. The
//! plugin starts with an empty cache, with the cache of that start, and with a file that was baked ahead. Each is a
//! process of its own, without the shader cache of drivers. Other scenes and sizes are those of the bench
//! `whole_frame`. `-- walkthrough` starts the walkthrough.
//!
//! The first picture is complete: all pipelines are compiled. The plugin draws sources until their levels are ready, so
//! that its first picture has full detail.

#[path = "../process.rs"]
mod process;
#[path = "../walkthrough.rs"]
mod walkthrough;

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use bevy::asset::AssetPlugin;
use bevy::math::UVec2;
use bevy::prelude::{AssetServer, default};
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::windowless;
use fieldlod_tests::frame_times::median;
use fieldlod_tests::scenes::{Method, Scene, SceneApp};
use fieldlod_tests::stage::Stage;

/// Kinds of start.
const WAYS: [&str; 4] = ["Bevy alone", "first start", "second start", "baked ahead"];
/// Environment variables of a measuring process: one of [`WAYS`], and the folder of the cache and of the baked file.
const WAY: &str = "FIELDLOD_WAY";
const FOLDER: &str = "FIELDLOD_FOLDER";
const BAKED: &str = "scene.fieldlod";
const SIZE_PX: UVec2 = UVec2::new(960, 540);
const TIMED: usize = 5;

fn main() -> Result<(), String> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if args.iter().any(|arg| arg == "walkthrough") {
        return start_walkthrough();
    }
    let size = args.iter().find_map(|arg| arg.parse().ok());
    let scene = || args.iter().find_map(|name| Scene::named(name, size));
    if let (Ok(way), Ok(folder)) = (std::env::var(WAY), std::env::var(FOLDER)) {
        let start = Instant::now();
        let scene = scene().or_else(|| Scene::named("town", size));
        measure(&way, Path::new(&folder), &scene.expect("a name"), start);
        return Ok(());
    }
    let error = |error: std::io::Error| error.to_string();
    let folder = tempfile::tempdir().map_err(error)?;
    let scene = scene().or_else(|| Scene::named("town", size));
    let baked = scene.expect("a name").bake().to_bytes();
    std::fs::write(folder.path().join(BAKED), baked).map_err(error)?;
    println!(
        "seconds: generated, first picture, all levels | ms per frame then | MB: meshes on the GPU, process, its peak"
    );
    for way in WAYS {
        let mut child = Command::new(std::env::current_exe().map_err(error)?);
        child.args(&args).env(WAY, way).env(FOLDER, folder.path());
        child
            .env("MESA_SHADER_CACHE_DISABLE", "true")
            .env("__GL_SHADER_DISK_CACHE", "0");
        let status = child.status().map_err(error)?;
        if !status.success() {
            return Err(format!("{way}: {status}"));
        }
    }
    Ok(())
}

/// Runs an app and prints its times and its memory.
fn measure(way: &str, folder: &Path, scene: &Scene, start: Instant) {
    let generated = start.elapsed().as_secs_f64();
    let plugins = windowless()
        .disable::<PipelinedRenderingPlugin>()
        .set(AssetPlugin {
            file_path: folder.display().to_string(),
            ..default()
        });
    let Some(stage) = Stage::stock_with(plugins) else {
        return;
    };
    let method = if way == WAYS[0] {
        Method::Full { gpu: false }
    } else {
        Method::auto_lod(1.0)
    };
    let mut app = SceneApp::new(stage, scene, method, SIZE_PX, true);
    let world = app.world_mut();
    if way == WAYS[3] {
        let baked = world.resource::<AssetServer>().load(BAKED);
        let mut marks = world.query::<&mut AutoLod>();
        for mut mark in marks.iter_mut(world) {
            mark.baked = Some(baked.clone());
        }
    } else if way != WAYS[0] {
        world.resource_mut::<FieldLodAppConfig>().cache_folder = Some(folder.into());
    }
    app.set_active(true);
    let mut first_picture = None;
    while first_picture.is_none() || !app.has_levels() {
        app.draw();
        if app.is_complete() {
            first_picture.get_or_insert(start.elapsed().as_secs_f64());
        }
    }
    app.draw();
    let all_levels = start.elapsed().as_secs_f64();
    let frame = median((0..TIMED).map(|_| app.draw().0)).as_secs_f64() * 1e3;
    let megabytes = |name| process::number("status", name) as f64 * 1.024e-3;
    println!(
        "{way:<14}{generated:>6.2}{:>8.2}{all_levels:>8.2} |{frame:>9.1} |{:>8.1}{:>9.1}{:>9.1}",
        first_picture.unwrap_or_default(),
        app.mesh_bytes() as f64 * 1e-6,
        megabytes("VmRSS:"),
        megabytes("VmHWM:"),
    );
}

/// Starts the walkthrough by Bevy alone, by the plugin without a cache, and with the cache of that run.
fn start_walkthrough() -> Result<(), String> {
    println!("seconds: generated, first picture of the walkthrough");
    walkthrough::remove_cache()?;
    for (way, options) in [(WAYS[0], &["--plain"][..]), (WAYS[1], &[]), (WAYS[2], &[])] {
        let options = [&["--still", "0"], options].concat();
        let summary = walkthrough::summary_of(&options)?;
        let seconds = |name: &str| summary[name].as_f64().unwrap_or(f64::NAN);
        println!(
            "{way:<14}{:>6.2}{:>8.2}",
            seconds("generate_s"),
            seconds("first_picture_s")
        );
    }
    Ok(())
}
