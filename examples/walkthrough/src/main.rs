//! A scene to walk through: generated ruins in wooded hills, two hundred million triangles of
//! them, drawn with view-dependent levels of detail.
//!
//! With a display it opens a window; without one it renders the camera path to pictures; without
//! any graphics adapter it still selects along the path and prints the numbers.

mod adapter;
mod animation;
mod args;
mod cameras;
mod contact_sheet;
mod flight;
mod ground;
mod guests;
mod headless;
mod hours;
mod hud;
mod lamps;
mod noise;
mod offscreen;
mod path;
mod report;
mod scene;
mod shapes;
mod sky;
mod stage;
mod windowed;
mod woods;

use std::process::ExitCode;

use args::Args;
use clap::Parser;

const NO_ADAPTER: &str = "no Vulkan adapter found, so this run only selects; on Debian and Ubuntu \
                          the package mesa-vulkan-drivers provides a software one";

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("walkthrough: {fault}");
            ExitCode::FAILURE
        }
    }
}

/// Chooses how to show the scene.
fn run(args: &Args) -> Result<(), String> {
    if args.headless {
        return headless::run(args);
    }
    if !adapter::is_available() {
        eprintln!("walkthrough: {NO_ADAPTER}");
        return headless::run(args);
    }
    match args.picture_directory() {
        Some(directory) => offscreen::run(args, &directory),
        None => windowed::run(args),
    }
}
