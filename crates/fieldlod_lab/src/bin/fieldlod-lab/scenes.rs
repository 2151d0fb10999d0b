//! `fieldlod-lab scenes`: what it is worth to know what hides what.

use std::path::PathBuf;

use clap::Args;
use fieldlod_cli::output::{Failure, print, progress_bar};
use fieldlod_lab::render::Renderer;
use fieldlod_lab::scenes::{Options, WorldResult, generated_worlds, measure, table};

/// Draw worlds of several objects, hills, a street and a wood, with detail chosen by what is not hidden and
/// without, and count triangles at equal error of the pictures.
///
/// Needs a graphics adapter; one in software will do.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The folder for numbers, tables and pictures; made if it is missing.
    #[arg(short, long)]
    out: PathBuf,
    /// Frames of each world.
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=1000))]
    frames: u32,
    /// Draw shadows, and measure how much hidden casters should count.
    #[arg(long)]
    shadows: bool,
    /// Print all figures as a JSON object instead of tables.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let renderer = Renderer::new()?;
    let bar = progress_bar("{msg}  {elapsed}");
    bar.set_message("baking");
    let worlds = generated_worlds(arguments.frames as usize, (640.0, 360.0).into())?;
    let options = Options {
        shadows: arguments.shadows,
        limits: !arguments.shadows,
    };
    let mut results = Vec::new();
    for world in &worlds {
        bar.set_message(world.name.clone());
        results.push(measure(&renderer, world, options, &arguments.out)?);
    }
    bar.finish_and_clear();
    print(&results, arguments.json, |results: &Vec<WorldResult>| {
        results.iter().map(table).collect()
    })
}
