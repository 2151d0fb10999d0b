//! `fieldlod-lab characters`: levels of skinned and morphed meshes in held-out clips.

use std::path::PathBuf;

use clap::Args;
use fieldlod_bake::import_gltf;
use fieldlod_cli::output::{Failure, print};
use fieldlod_lab::characters::{self, CharacterResult, PictureOptions};
use fieldlod_lab::render::Renderer;

/// Bake characters with half of their clips, and measure the levels in the other half: the greatest ratio of measured
/// to stated deviation. Also compares triangles with plain simplification, at equal deviation and at equal image error.
///
/// Pictures need a graphics adapter; a software adapter is enough.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf or .glb files.
    #[arg(required = true)]
    models: Vec<PathBuf>,
    /// Number of view directions. 0 draws no pictures.
    #[arg(long, default_value_t = 8)]
    directions: u32,
    /// Largest number of poses in pictures.
    #[arg(long, default_value_t = 6)]
    poses: usize,
    /// Print all figures as a JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let renderer = (arguments.directions > 0).then(Renderer::new).transpose()?;
    let options = PictureOptions {
        directions: arguments.directions,
        poses: arguments.poses.max(1),
        radii_px: vec![12.0, 50.0, 200.0],
    };
    let mut results: Vec<CharacterResult> = Vec::new();
    for path in &arguments.models {
        let import = import_gltf(path).map_err(|error| Failure::new(path, error))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let drawing = renderer.as_ref().map(|renderer| (renderer, &options));
        let mut failed = Vec::new();
        results.extend(characters::measure(&name, import, drawing, &mut failed)?);
        failed.iter().for_each(|line| eprintln!("warning: {line}"));
    }
    print(&results, arguments.json, |results| {
        characters::table(results)
    })
}
