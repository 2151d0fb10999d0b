//! `fieldlod-lab props`: what each level of a whole mesh looks like, by its size on screen.

use std::path::PathBuf;

use clap::Args;
use fieldlod_bake::BakeConfig;
use fieldlod_cli::output::{Failure, print};
use fieldlod_lab::chart::Generated;
use fieldlod_lab::props::{self, Pop, PropResult};
use fieldlod_lab::render::Renderer;

use crate::models::Model;

/// Draw every level of whole meshes beside its source, at several sizes, and tell how far they differ:
/// RMSE, FLIP, the area covered, and what the selection draws at 1 px.
///
/// Needs a graphics adapter; one in software will do.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf, .glb or .fieldlod files [default: plants that the program makes]. Of each, the
    /// mesh with most triangles is taken, all its primitives together.
    models: Vec<PathBuf>,
    /// Directions that each is seen from.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=1000))]
    directions: u32,
    /// Fly towards each instead, and tell what changes of level do to a frame.
    #[arg(long, conflicts_with = "directions")]
    flight: bool,
    /// Bake levels of cards, too, for plants whose material is known.
    #[arg(long)]
    cards: bool,
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
    let config = BakeConfig {
        cards: arguments.cards,
        ..BakeConfig::default()
    };
    if arguments.flight {
        return fly(&renderer, &models, &config, arguments.json);
    }
    let measured = models.iter().map(|model| {
        let baked = model.bake_plant(&config)?;
        Ok(props::measure(
            &renderer,
            &model.name(),
            &baked,
            arguments.directions,
        )?)
    });
    let results: Vec<PropResult> = measured.collect::<Result<_, Failure>>()?;
    print(&results, arguments.json, |results| props::table(results))
}

fn fly(
    renderer: &Renderer,
    models: &[Model],
    config: &BakeConfig,
    as_json: bool,
) -> Result<(), Failure> {
    let flown = models.iter().map(|model| {
        let baked = model.bake_plant(config)?;
        Ok((model.name(), props::pops(&props::fly(renderer, &baked)?)))
    });
    let results: Vec<(String, Vec<Pop>)> = flown.collect::<Result<_, Failure>>()?;
    print(&results, as_json, |results| props::pop_table(results))
}
