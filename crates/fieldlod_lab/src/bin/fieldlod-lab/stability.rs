//! `fieldlod-lab stability`: all methods in difficult cases.

use std::path::{Path, PathBuf};

use clap::Args;
use fieldlod_bake::BakeConfig;
use fieldlod_cli::output::{Failure, print, progress_bar};
use fieldlod_lab::object::{ErrorSource, LodObject};
use fieldlod_lab::promise::{self, Effort, PromiseRun};
use fieldlod_lab::stability::{self, Fixture, Report};
use indicatif::ProgressBar;

use crate::models::Model;

/// Run all methods in difficult cases. Users of other systems reported failures in some of them.
///
/// Each case runs on a generated object, or on the primitive of each given model with the most triangles.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf, .glb or .fieldlod files [default: generated objects].
    models: Vec<PathBuf>,
    /// Measure the guarantee of 1 px instead, from random cameras under random placements. Also measures clusterlod's
    /// metric on the same hierarchy and on its own.
    #[arg(long)]
    promise: bool,
    /// Number of cameras.
    #[arg(long, default_value_t = 500, requires = "promise")]
    cameras: usize,
    /// Print all figures as a JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let bar = progress_bar("{msg} {bar:40} {pos}/{len}  {elapsed}");
    bar.set_message("baking");
    let baked = arguments.models.iter().map(|path| Object::bake(path));
    let models = baked.collect::<Result<Vec<_>, Failure>>()?;
    if arguments.promise {
        return run_promise(arguments, models, &bar);
    }
    // Without models, each case runs on its fixture.
    bar.set_message("cases");
    let ours = models.into_iter().map(|object| (object.name, object.ours));
    let report = stability::run(&ours.collect::<Vec<_>>(), &|done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    print(&report, arguments.json, text)
}

fn run_promise(
    arguments: &Arguments,
    models: Vec<Object>,
    bar: &ProgressBar,
) -> Result<(), Failure> {
    let objects = if models.is_empty() {
        Fixture::ALL.map(Object::of_fixture).into()
    } else {
        models
    };
    let effort = Effort {
        cameras: arguments.cameras,
        ..Effort::default()
    };
    bar.set_length(effort.cameras as u64);
    let measure = |object: &Object| {
        let (name, levels) = (&object.name, [&object.ours, &object.clusterlods]);
        bar.set_message(name.clone());
        let progress = |done| bar.set_position(done as u64);
        promise::measure(name, levels, stability::THRESHOLD_PX, effort, &progress)
    };
    let runs: Vec<PromiseRun> = objects.iter().map(measure).collect();
    bar.finish_and_clear();
    print(&runs, arguments.json, |runs| promise::table(runs))
}

/// An object with our levels and with clusterlod's.
struct Object {
    name: String,
    ours: LodObject,
    clusterlods: LodObject,
}

impl Object {
    /// Bakes with the default settings.
    fn bake(path: &Path) -> Result<Self, Failure> {
        let baked = Model::File(path.to_owned()).bake(&BakeConfig::default())?;
        Ok(Self {
            name: baked.name,
            ours: LodObject::new(baked.ours, ErrorSource::Measured),
            clusterlods: LodObject::new(baked.clusterlods, ErrorSource::Reported),
        })
    }

    fn of_fixture(fixture: Fixture) -> Self {
        Self {
            name: format!("{fixture:?}").to_lowercase(),
            ours: fixture.bake(),
            clusterlods: fixture.bake_by_clusterlod(),
        }
    }
}

fn text(report: &Report) -> String {
    let mut text = String::new();
    for object in &report.objects {
        text.push_str(&stability::table(object));
        text.push('\n');
    }
    text.push_str(
        "px: largest displacement at a threshold of 1 px (fails above 1.5);\n\
         fl: groups per frame that change and change back within 5 frames; he: open edges;\n\
         x: triangles chosen, relative to fieldlod guaranteed; xc: relative to the coarsest cut, for objects\n\
         out of view (both fail above 1.25).",
    );
    text
}
