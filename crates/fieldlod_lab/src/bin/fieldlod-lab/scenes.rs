//! `fieldlod-lab scenes`: triangles with and without visible flux.

use clap::Args;
use fieldlod_cli::output::{Failure, print, progress_bar};
use fieldlod_lab::render::Renderer;
use fieldlod_lab::scenes::{WorldResult, generated_worlds, measure, table};

/// Draw three generated worlds (hills, a street, a wood) with and without visible flux, and count triangles at equal
/// image error.
///
/// Needs a graphics adapter; a software adapter is enough.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// Print all figures as a JSON object instead of tables.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let renderer = Renderer::new()?;
    let bar = progress_bar("{msg}  {elapsed}");
    bar.set_message("baking");
    let worlds = generated_worlds((640.0, 360.0).into())?;
    let mut results = Vec::new();
    for world in &worlds {
        bar.set_message(world.name.clone());
        results.push(measure(&renderer, world)?);
    }
    bar.finish_and_clear();
    print(&results, arguments.json, |results: &Vec<WorldResult>| {
        results.iter().map(table).collect()
    })
}
