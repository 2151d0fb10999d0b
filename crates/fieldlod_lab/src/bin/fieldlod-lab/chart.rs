//! `fieldlod-lab chart`: triangles against image error, for this project and other systems.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use fieldlod_bake::BakeConfig;
use fieldlod_cli::output::{Failure, print, progress_bar};
use fieldlod_lab::chart::{
    COMPARED_AT_PX, Generated, Measure, ModelRatios, Options, Report, chart_model, draw_chart,
};
use fieldlod_lab::method::Method;
use fieldlod_lab::render::Renderer;
use indicatif::ProgressBar;

use crate::models::Model;

/// Draw models at many levels of detail, chosen by the criteria of this and other systems, and chart triangles
/// against image error. The baseline is clusterlod as a whole: its metric on the levels that it builds itself.
///
/// Needs a graphics adapter; a software adapter is enough. Meshes are baked in small units, so that a small picture
/// of a mesh represents a large picture of a finer mesh.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf or .glb files [default: generated models]. Of each file, the primitive with the most triangles is
    /// measured.
    models: Vec<PathBuf>,
    /// The folder for the chart and its numbers; created if it is missing.
    #[arg(short, long)]
    out: PathBuf,
    /// Poses of the camera for each model.
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=1000))]
    poses: u32,
    /// Seed of the poses.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Measure the generated models on which constants were chosen instead of the default models. Files are measured as
    /// well.
    #[arg(long)]
    training: bool,
    /// Also measure the paper's thresholds of curl and aspect ratio, which are off by default.
    #[arg(long)]
    thresholds: bool,
    /// Print all figures as a JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    // A folder that cannot be created must fail before the long measurement.
    let out = &arguments.out;
    fs::create_dir_all(out).map_err(|error| Failure::new(out, error))?;
    let renderer = Renderer::new()?;
    let options = Options {
        poses: arguments.poses as usize,
        seed: arguments.seed,
        size_px: (640, 360).into(),
        methods: methods(arguments),
    };
    let models = models(arguments);
    let bar = progress_bar("{bar:40} {pos}/{len}  {elapsed}, {eta} left  {msg}");
    bar.set_length((models.len() * options.poses) as u64);
    let mut results = Vec::new();
    for model in &models {
        let name = model.name();
        bar.set_message(format!("{name}: baking"));
        let baked = model.bake(&BakeConfig::fine_grained())?;
        bar.set_message(name.clone());
        let step = || advance(&bar, &name);
        results.push(chart_model(&renderer, baked, &options, &step)?);
    }
    bar.finish_and_clear();
    let report = Report::new(&results, &options, renderer.adapter());
    draw_chart(&report, out)?;
    print(&report, arguments.json, |report| {
        text(report, &options.methods, out)
    })
}

fn methods(arguments: &Arguments) -> Vec<Method> {
    let of_paper = arguments.thresholds.then_some(Method::OF_PAPER);
    let of_paper = of_paper.into_iter().flatten();
    Method::ALL.into_iter().chain(of_paper).collect()
}

fn models(arguments: &Arguments) -> Vec<Model> {
    let files = arguments.models.iter().cloned().map(Model::File);
    let mut models: Vec<Model> = files.collect();
    if arguments.training {
        models.extend(Generated::TRAINING.map(Model::Generated));
    } else if models.is_empty() {
        models.extend(Generated::TEST.map(Model::Generated));
    }
    models
}

/// Advances the bar; prints a line if the bar is hidden.
fn advance(bar: &ProgressBar, name: &str) {
    bar.inc(1);
    if bar.is_hidden() {
        let (done, all) = (bar.position(), bar.length().unwrap_or_default());
        let seconds = bar.elapsed().as_secs();
        eprintln!("{name}: pose {done} of {all}, {seconds} s");
    }
}

/// Triangles relative to clusterlod's at equal error.
fn text(report: &Report, methods: &[Method], out: &Path) -> String {
    let mut text = String::from(
        "triangles relative to clusterlod with its own levels, at the image error of clusterlod at 0.4, 1 and\n\
         2.5 px (geometric mean over the compared poses; in brackets the worst pose, and the number of\n\
         compared poses if some are left out)\n\n",
    );
    let head = Measure::ALL.map(|measure| format!("  {:46}", measure.name()));
    let _ = writeln!(text, "{:22}{}", "", head.concat());
    for model in report.models.iter().chain([&report.all]) {
        let _ = writeln!(text, "\n{}, {} triangles", model.name, model.triangles);
        text.extend(methods.iter().map(|method| row(model, *method)));
    }
    text.push_str(&thresholds_text(report));
    let _ = write!(text, "\nchart and numbers: {}", out.display());
    text
}

/// One method's ratios, by all measures.
fn row(model: &ModelRatios, method: Method) -> String {
    let cells = Measure::ALL.map(|measure| {
        let at = COMPARED_AT_PX.map(|at_px| match model.ratio(method, measure, at_px) {
            Some(r) if r.poses < model.poses => {
                format!("{:.2} ({:.2}, {})", r.mean, r.greatest, r.poses)
            }
            Some(r) => format!("{:.2} ({:.2})", r.mean, r.greatest),
            None => "-".to_owned(),
        });
        format!("  {:46}", at.join(" "))
    });
    format!("{:22}{}\n", method.name(), cells.concat())
}

/// The thresholds of this project's quality method at the image errors at which methods are compared.
fn thresholds_text(report: &Report) -> String {
    let curves = report.curves.iter();
    let of_quality = curves.filter(|point| point.method == Method::Quality);
    let is_compared = |at_px: f64| COMPARED_AT_PX.iter().any(|px| (px - at_px).abs() < 1e-4);
    let at = of_quality.filter(|point| is_compared(point.at_px));
    let pairs = at.map(|point| format!("{:.1} px: {:.2} px", point.at_px, point.threshold_px));
    let pairs: Vec<String> = pairs.collect();
    format!(
        "\nclusterlod's threshold: our error_px at the same image error  {}\n",
        pairs.join("   ")
    )
}
