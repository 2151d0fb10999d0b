//! `fieldlod-lab stability`: all methods in difficult cases.

use clap::Args;
use fieldlod_cli::output::{Failure, print, progress_bar};
use fieldlod_lab::promise::{self, Effort};
use fieldlod_lab::stability::{self, CaseResult, Fixture};
use indicatif::ProgressBar;

/// Run all methods in difficult cases, each on a generated object. Users of other systems reported failures in some of
/// them.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// Measure the guarantee of 1 px instead, from random cameras under random placements. Also measures clusterlod's
    /// metric on the same hierarchy and on its own.
    #[arg(long)]
    promise: bool,
    /// Print all figures as a JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let bar = progress_bar("{msg} {bar:40} {pos}/{len}  {elapsed}");
    if arguments.promise {
        return run_promise(arguments, &bar);
    }
    bar.set_message("cases");
    let cases = stability::run(&|done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    print(&cases, arguments.json, |cases| text(cases))
}

fn run_promise(arguments: &Arguments, bar: &ProgressBar) -> Result<(), Failure> {
    let effort = Effort::default();
    bar.set_length(effort.cameras as u64);
    let runs = Fixture::ALL.map(|fixture| {
        let name = format!("{fixture:?}").to_lowercase();
        bar.set_message(name.clone());
        let levels = [&fixture.bake(), &fixture.bake_by_clusterlod()];
        let progress = |done| bar.set_position(done as u64);
        promise::measure(&name, levels, stability::THRESHOLD_PX, effort, &progress)
    });
    bar.finish_and_clear();
    print(&runs.to_vec(), arguments.json, |runs| promise::table(runs))
}

fn text(cases: &[CaseResult]) -> String {
    stability::table(cases)
        + "\npx: largest displacement at a threshold of 1 px (fails above 1.5);\n\
         fl: groups per frame that change and change back within 5 frames; he: open edges;\n\
         x: triangles chosen, relative to fieldlod guaranteed; xc: relative to the coarsest cut, for objects\n\
         out of view (both fail above 1.25)."
}
