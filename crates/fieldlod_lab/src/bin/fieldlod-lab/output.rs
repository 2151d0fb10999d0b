//! What all commands share: results on standard output, progress and failures on standard error.

use std::error::Error;
use std::fmt::Display;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

/// Why a command failed, in one line that names the file.
pub(crate) type Failure = Box<dyn Error>;

/// The failure of a file or folder.
pub(crate) fn failure_of(path: &Path, fault: impl Display) -> Failure {
    format!("{}: {fault}", path.display()).into()
}

/// Prints a result as one JSON object or as text. A reader that has gone away, such as `head`, is no
/// failure.
pub(crate) fn print<T: Serialize>(
    result: &T,
    as_json: bool,
    text: impl FnOnce(&T) -> String,
) -> Result<(), Failure> {
    let output = if as_json {
        serde_json::to_string_pretty(result)?
    } else {
        text(result)
    };
    match writeln!(io::stdout(), "{}", output.trim_end()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// A bar on standard error, hidden where that is not a terminal.
pub(crate) fn progress_bar(steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64);
    let template = "{bar:40} {pos}/{len}  {elapsed}, {eta} left  {msg}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}
