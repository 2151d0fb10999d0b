//! Walks through a generated scene with view-dependent levels of detail: ruins in wooded hills with two hundred million
//! triangles.
//!
//! With a display it opens a window. Without one it renders the camera path to pictures. Without a graphics adapter
//! it only selects levels along the path and prints the numbers. A software adapter gets a reduced [`quality`].

mod adapter;
mod args;
mod cameras;
mod noise;
mod output;
mod quality;
mod scene;
mod shapes;

use std::process::ExitCode;

use adapter::Adapter;
use args::Args;
use clap::Parser;
use output::{offscreen, windowed};
use quality::Quality;

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("walkthrough: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Chooses the quality and the kind of output.
fn run(args: &Args) -> Result<(), String> {
    let adapter = if args.headless {
        Adapter::None
    } else {
        adapter::find()
    };
    let quality = Quality::choose(args, adapter);
    if quality.is_reduced {
        eprintln!("walkthrough: quality: {}", quality.description());
    }
    if adapter == Adapter::None {
        if !args.headless {
            eprintln!("walkthrough: {}", adapter::NOT_FOUND);
        }
        return offscreen::run(args, &quality, None);
    }
    match args.picture_directory() {
        Some(directory) => offscreen::run(args, &quality, Some(&directory)),
        None => windowed::run(args, &quality),
    }
}
