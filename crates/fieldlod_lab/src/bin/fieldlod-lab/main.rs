//! The `fieldlod-lab` command: measures what the level-of-detail crates claim.
//!
//! Results go to standard output, as text or with `--json` as one JSON object. Progress and errors
//! go to standard error; an error is one line that names the file and its fault. The exit code is
//! 1 for a failure and 2 for a wrong command line.

mod chart;
mod models;
mod paper;
mod props;
mod scenes;
mod stability;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use fieldlod_cli::output::{Failure, exit_code};

/// Measures of automatic, view-dependent level of detail: charts, scenes, hard cases, the paper's figures.
#[derive(Debug, Parser)]
#[command(version)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Chart(chart::Arguments),
    Paper(paper::Arguments),
    Props(props::Arguments),
    Scenes(scenes::Arguments),
    Stability(stability::Arguments),
}

impl Command {
    fn run(&self) -> Result<(), Failure> {
        match self {
            Self::Chart(arguments) => chart::run(arguments),
            Self::Paper(arguments) => paper::run(arguments),
            Self::Props(arguments) => props::run(arguments),
            Self::Scenes(arguments) => scenes::run(arguments),
            Self::Stability(arguments) => stability::run(arguments),
        }
    }
}

fn main() -> ExitCode {
    exit_code(CommandLine::parse().command.run())
}
