//! `fieldlod-lab chart`: speed against accuracy, for ours and other systems' criteria.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use fieldlod_bake::BakeConfig;
use fieldlod_cli::output::{Failure, print, progress_bar};
use fieldlod_lab::chart::{
    CHART_METHODS, COMPARED_AT_PX, Generated, Measure, Options, Ratios, Report, Store, chart_model,
    write_charts,
};
use fieldlod_lab::method::Method;
use fieldlod_lab::render::Renderer;
use indicatif::ProgressBar;

use crate::models::Model;

/// Draw models at many levels of detail, chosen by this and other systems' criteria, and chart
/// their triangles, times and promises against the error of their pictures. The baseline is
/// clusterlod as a whole: its metric on the levels that it builds itself.
///
/// Needs a graphics adapter; one in software will do. A run that was stopped goes on where it was
/// when started again with the same folder. Meshes are baked in small units, so that a small picture
/// of a mesh stands for a large one of a finer mesh; .fieldlod files are taken as they are, and only
/// clusterlod's levels are built anew.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf, .glb or .fieldlod files [default: models that the program makes]. Of each, the
    /// primitive with most triangles is taken.
    models: Vec<PathBuf>,
    /// The folder for charts and numbers.
    #[arg(short, long)]
    out: PathBuf,
    /// Poses of the camera for each model.
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=1000))]
    poses: u32,
    /// Another number gives other poses.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Size of the pictures in pixels.
    #[arg(long, default_value = "640x360", value_parser = parse_size)]
    size: (u32, u32),
    /// Only the comparison of triangles, without promises and the path.
    #[arg(long)]
    brief: bool,
    /// Add the generated models on which constants are chosen, or take only those.
    #[arg(long)]
    training: bool,
    /// Print all figures as a JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parse = |side: &str| side.parse().ok().filter(|side| (16..=4096).contains(side));
    let sides = text.split_once('x');
    sides
        .and_then(|(width, height)| Some((parse(width)?, parse(height)?)))
        .ok_or_else(|| "expected two sizes from 16 to 4096, such as 480x270".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    // Fail before the work where nothing can be written or drawn.
    let out = &arguments.out;
    let store = Store::new(&out.join("results"))?;
    let renderer = Renderer::new()?;
    let options = Options {
        poses: arguments.poses as usize,
        seed: arguments.seed,
        size_px: arguments.size.into(),
        methods: CHART_METHODS.to_vec(),
        with_extras: !arguments.brief,
    };
    // Measure model by model.
    let models = models(arguments);
    let bar = progress_bar("{bar:40} {pos}/{len}  {elapsed}, {eta} left  {msg}");
    bar.set_length((models.len() * options.steps()) as u64);
    let mut results = Vec::new();
    for model in &models {
        let name = model.name();
        bar.set_message(format!("{name}: baking"));
        let baked = model.bake(&BakeConfig::fine_grained())?;
        bar.set_message(name.clone());
        let step = || advance(&bar, &name);
        let result = chart_model(&renderer, baked, &options, &store, &step)?;
        results.push(result);
    }
    bar.finish_and_clear();
    // Sum up, draw, and tell.
    let report = Report::new(&results, &options, renderer.adapter());
    write_charts(&report, out)?;
    print(&report, arguments.json, |report| text(report, out))
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

/// One step more; where no bar is drawn, a line for each.
fn advance(bar: &ProgressBar, name: &str) {
    bar.inc(1);
    if bar.is_hidden() {
        let (done, all) = (bar.position(), bar.length().unwrap_or_default());
        let seconds = bar.elapsed().as_secs();
        eprintln!("{name}: step {done} of {all}, {seconds} s");
    }
}

/// What the printed tables hold equal; `report.json` has more.
const TABLE: [Measure; 3] = [Measure::Rmse, Measure::Silhouette, Measure::Flip];

/// What is told apart by model: both gains, of levels with the criterion and of levels alone, and the limit.
const BY_MODEL: [Method; 4] = [
    Method::Quality,
    Method::VisibleFlux,
    Method::ClusterlodOnOurLevels,
    Method::Oracle,
];

/// What the columns of the last table are.
const ABLATION: &str = "\
the criterion's terms, each left out: triangles relative to clusterlod's at the image error of its 1 px
(mean, worst pose), at its silhouette's error, and at a threshold of 1 px towards the picture's corner;
displaced pixels there, of 1 promised; nanoseconds for a group by plain code and as in a frame";

/// Triangles relative to clusterlod at equal error.
fn text(report: &Report, out: &Path) -> String {
    let mut text = String::from(
        "triangles relative to those of clusterlod, its metric on its own levels, at equal error: at the error\n\
         of its 0.4, 1 and 2.5 px (geometric mean over all poses; in brackets the worst pose)\n\n",
    );
    // A row for each method, a column for each measure.
    text.push_str(&head());
    for method in CHART_METHODS {
        let find = |measure, at_px| report.ratio(method, measure, at_px);
        text.push_str(&row(&method.label(), find));
    }
    // How models differ.
    for model in &report.models {
        let _ = writeln!(text, "\n{}, {} triangles", model.name, model.triangles);
        for method in BY_MODEL {
            let find = |measure, at_px| model.ratio(method, measure, at_px);
            text.push_str(&row(&method.label(), find));
        }
    }
    // What our threshold means, and what each term is worth.
    text.push_str(&thresholds_text(report));
    if !report.ablation.is_empty() {
        let _ = write!(text, "\n{ABLATION}\n\n{}", report.ablation_table());
    }
    let _ = write!(text, "\ncharts and numbers: {}", out.display());
    text
}

fn head() -> String {
    let measures = TABLE.map(|measure| format!("  {:34}", measure.name()));
    format!("{:22}{}\n", "", measures.concat())
}

/// One method's ratios, by all measures.
fn row<'a>(label: &str, find: impl Fn(Measure, f64) -> Option<&'a Ratios>) -> String {
    let cells = TABLE.map(|measure| {
        let at = COMPARED_AT_PX.map(|at_px| match find(measure, at_px) {
            Some(r) => format!("{:.2} ({:.2})", r.mean, r.greatest),
            None => "-".to_owned(),
        });
        format!("  {:34}", at.join(" "))
    });
    format!("{label:22}{}\n", cells.concat())
}

/// What our threshold means beside that of others.
fn thresholds_text(report: &Report) -> String {
    // Our thresholds with the errors that methods are compared at.
    let of_quality = report
        .costs
        .iter()
        .filter(|cost| cost.method == Method::Quality);
    let at = of_quality.filter(|cost| {
        COMPARED_AT_PX
            .iter()
            .any(|px| (px - cost.at_px).abs() < 1e-4)
    });
    let pairs = at.map(|cost| format!("{:.1} px: {:.2} px", cost.at_px, cost.threshold_px));
    let pairs: Vec<String> = pairs.collect();
    format!(
        "\nour error_px with the image error of clusterlod's  {}\n",
        pairs.join("   ")
    )
}
