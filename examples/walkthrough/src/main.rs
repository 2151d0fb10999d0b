//! A scene to walk through: generated ruins in wooded hills, two hundred million triangles of
//! them, drawn with view-dependent levels of detail.
//!
//! With a display it opens a window; without one it renders the camera path to pictures; without
//! any graphics adapter it still selects along the path and prints the numbers. Where the adapter
//! is a software one, the scene is shown at a reduced [`quality`].

mod adapter;
mod animation;
mod args;
mod cameras;
mod contact_sheet;
mod export;
mod flight;
mod ground_texture;
mod hud;
mod lamps;
mod layout;
#[cfg(feature = "lab")]
mod measure;
mod models;
mod noise;
mod offscreen;
mod path;
mod pictures;
mod placed;
mod quality;
mod report;
mod scene;
mod shapes;
mod sky;
mod windowed;
mod woods;

use std::process::ExitCode;

use adapter::Adapter;
use args::Args;
use clap::Parser;
use offscreen::Output;
use quality::Quality;

fn main() -> ExitCode {
    let args = Args::parse();
    adapter::provide_runtime_folder();
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("walkthrough: {fault}");
            ExitCode::FAILURE
        }
    }
}

/// Chooses how to show the scene, and how finely.
fn run(args: &Args) -> Result<(), String> {
    if let Some(directory) = &args.write_plants {
        return export::write_plants(directory);
    }
    let adapter = match args.headless {
        true => Adapter::None,
        false => adapter::find(),
    };
    let quality = Quality::choose(args, adapter);
    if let Some(path) = &args.write_scene {
        return match args.rocks {
            Some(count) => export::write_rocks(path, &quality, count),
            None => export::write_scene(path, &quality),
        };
    }
    if quality.is_reduced {
        eprintln!("walkthrough: quality: {}", quality.description());
    }
    if adapter == Adapter::None {
        if !args.headless {
            eprintln!("walkthrough: {}", adapter::NOT_FOUND);
        }
        return offscreen::run(args, &quality, Output::Numbers);
    }
    #[cfg(feature = "lab")]
    if let Some(folder) = &args.measure {
        return measure::run(args, &quality, folder);
    }
    if args.time {
        return offscreen::run(args, &quality, Output::Times);
    }
    match args.picture_directory() {
        Some(directory) => offscreen::run(args, &quality, Output::Pictures(&directory)),
        None => windowed::run(args, &quality),
    }
}
