//! The `fieldlod` command: bakes, inspects and verifies level-of-detail hierarchies.
//!
//! Results go to standard output, as text or with `--json` as one JSON object. Progress and errors go to standard error.
//! An error is one line with the file and the cause. The exit code is 1 for a failure and 2 for a wrong command line. A
//! bake that skips faulty primitives succeeds without `--strict`.

mod bake;
mod fallbacks;
mod inspect;
mod pages;
mod quantized;
mod scene;
mod summary;
mod verify;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use fieldlod_cli::output::{Failure, exit_code};

/// Automatic, view-dependent level of detail: bake, inspect and verify hierarchies.
#[derive(Debug, Parser)]
#[command(version)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Bake(bake::Arguments),
    Inspect(inspect::Arguments),
    Verify(verify::Arguments),
}

impl Command {
    fn run(&self) -> Result<(), Failure> {
        match self {
            Self::Bake(arguments) => bake::run(arguments),
            Self::Inspect(arguments) => inspect::run(arguments),
            Self::Verify(arguments) => verify::run(arguments),
        }
    }
}

fn main() -> ExitCode {
    exit_code(CommandLine::parse().command.run())
}
