//! `fieldlod-lab paper`: the figures of the camera-sampling field's paper, with their numbers.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use fieldlod_cli::output::{Failure, print};
use fieldlod_lab::paper::{Comparison, DifferenceAtAngle, Figure18, PaperNumbers, draw_figures};

/// Draw the figures of the camera-sampling field's paper anew, and print their numbers.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The folder for the pictures and numbers.json; made if it is missing.
    #[arg(long)]
    out: PathBuf,
    /// Print all numbers as a JSON object instead of a summary.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let numbers = draw_figures(&arguments.out)?;
    print(&numbers, arguments.json, summary)
}

fn summary(numbers: &PaperNumbers) -> String {
    let mut text = String::new();
    // Kernels, splats and merged samples; the other figures have nothing to compare.
    let kernels = &numbers.figure_14;
    text.push_str("figure 14: symmetric difference to the exact kernel, 60 degrees off axis\n");
    for (name, angles) in [
        ("across the sight ray", &kernels.across_sight_ray),
        ("turned outwards", &kernels.turned_outwards),
        ("turned inwards", &kernels.turned_inwards),
    ] {
        if let Some(at) = angles.iter().find(|at| at.off_axis_deg == 60.0) {
            let _ = writeln!(text, "  {name}: {}", difference_text(at));
        }
    }
    let splats = &numbers.figure_15;
    let _ = writeln!(
        text,
        "figure 15: difference to exact splats {:.2} of 255 (paper's), {:.2} (ours)",
        splats.paper.rmse_to_exact_splats_of_255, splats.sheared.rmse_to_exact_splats_of_255,
    );
    text.push_str(
        "figure 18: samples merged at the convergent point against the average position\n",
    );
    text.push_str(&merges_text(&numbers.figure_18));
    text
}

fn difference_text(at: &DifferenceAtAngle) -> String {
    let [paper, curl, sheared] = [at.paper, at.curl_only, at.sheared].map(|share| share * 100.0);
    format!("{paper:.1} % the paper's, {curl:.1} % curl only, {sheared:.1} % ours")
}

fn merges_text(figure: &Figure18) -> String {
    let mut text = String::new();
    for (kind, results) in [
        ("parallel", &figure.parallel),
        ("not parallel", &figure.not_parallel),
    ] {
        for result in results {
            let focal = comparison_text(&result.all.same_focal);
            let density = comparison_text(&result.all.same_density);
            let _ = writeln!(
                text,
                "  {kind}, {}, same focal length: {focal}",
                result.scene
            );
            let _ = writeln!(text, "  {kind}, {}, same density: {density}", result.scene);
        }
    }
    text
}

fn comparison_text(comparison: &Comparison) -> String {
    let Comparison {
        sets,
        fewer_in,
        mean_fewer_percent,
        ..
    } = comparison;
    format!("fewer in {fewer_in} of {sets}, mean {mean_fewer_percent:.1} % fewer")
}
