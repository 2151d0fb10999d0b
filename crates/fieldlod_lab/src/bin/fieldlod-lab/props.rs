//! `fieldlod-lab props`: image errors of the levels of whole meshes, by size on screen.

use std::path::PathBuf;

use clap::Args;
use fieldlod_bake::BakeConfig;
use fieldlod_cli::output::{Failure, print};
use fieldlod_lab::chart::Generated;
use fieldlod_lab::props::{self, PropResult};
use fieldlod_lab::render::Renderer;

use crate::models::Model;

/// Draw every level of whole meshes at several sizes and compare it with the source: RMSE, FLIP and the area covered.
///
/// Textures are not drawn: leaves that a texture cuts out are drawn whole. Needs a graphics adapter; a software adapter
/// is enough.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf or .glb files [default: generated plants]. Of each file, the mesh with the most triangles is measured,
    /// with all its primitives.
    models: Vec<PathBuf>,
    /// Print all figures as a JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let renderer = Renderer::new()?;
    let files = arguments.models.iter().cloned().map(Model::File);
    let mut models: Vec<Model> = files.collect();
    if models.is_empty() {
        models.extend(Generated::PLANTS.map(Model::Generated));
    }
    let config = BakeConfig::default();
    let measured = models.iter().map(|model| {
        let baked = model.bake_plant(&config)?;
        Ok(props::measure(&renderer, &model.name(), &baked)?)
    });
    let results: Vec<PropResult> = measured.collect::<Result<_, Failure>>()?;
    print(&results, arguments.json, |results| props::table(results))
}
