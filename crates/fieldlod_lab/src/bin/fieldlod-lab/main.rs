//! The `fieldlod-lab` command: measurements of level of detail.
//!
//! Results go to standard output, as text or with `--json` as one JSON object. Progress and errors go to standard
//! error; an error is one line that names the file and the cause. The exit code is 1 for a failure and 2 for a
//! wrong command line.

mod characters;
mod chart;
mod models;
mod props;
mod stability;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use fieldlod_cli::output::{Failure, exit_code};

/// Measurements of automatic, view-dependent level of detail.
#[derive(Debug, Parser)]
#[command(version)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Characters(characters::Arguments),
    Chart(chart::Arguments),
    Props(props::Arguments),
    Stability(stability::Arguments),
}

impl Command {
    fn run(&self) -> Result<(), Failure> {
        match self {
            Self::Characters(arguments) => characters::run(arguments),
            Self::Chart(arguments) => chart::run(arguments),
            Self::Props(arguments) => props::run(arguments),
            Self::Stability(arguments) => stability::run(arguments),
        }
    }
}

fn main() -> ExitCode {
    exit_code(CommandLine::parse().command.run())
}
