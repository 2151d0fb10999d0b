//! Results on standard output, progress and failures on standard error, and whole files.

use std::error::Error;
use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

/// The cause of a failed command, in one line.
#[derive(Debug)]
pub struct Failure(String);

impl Failure {
    /// The failure of a file or folder.
    pub fn new(path: &Path, fault: impl Display) -> Self {
        Self(format!("{}: {fault}", path.display()))
    }
}

/// Errors that name their file themselves, or concern no file.
impl<E: Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(error.to_string())
    }
}

/// The exit code of a command: 1 for a failure. Prints the failure as one line on standard error.
#[must_use]
pub fn exit_code(result: Result<(), Failure>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure(line)) => {
            // File names may contain line ends.
            eprintln!("error: {}", line.replace(char::is_control, " "));
            ExitCode::FAILURE
        }
    }
}

/// Prints a result as JSON or as text. A pipe that is closed early, for example by `head`, is ignored.
///
/// # Errors
/// A [`Failure`] if the result could not be serialized or written.
pub fn print<T: Serialize>(
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
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::new(Path::new("standard output"), error))
        }
        _ => Ok(()),
    }
}

/// A progress bar on standard error; hidden if standard error is not a terminal.
#[must_use]
pub fn progress_bar(template: &str) -> ProgressBar {
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}

/// Writes a file. A regular file is replaced atomically: written under a temporary name first, then renamed. Devices and
/// pipes are written to, and symbolic links stay.
///
/// # Errors
/// A [`Failure`] with the file's name and the system's error.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let is_regular = match fs::metadata(path) {
        Ok(found) => found.is_file(),
        // The name is free, or a link leads to a name that is free.
        Err(_) => !path.is_symlink(),
    };
    let written = if is_regular {
        replace(&fs::canonicalize(path).unwrap_or(path.to_owned()), bytes)
    } else {
        File::create(path).and_then(|mut file| file.write_all(bytes))
    };
    written.map_err(|error| Failure::new(path, format!("could not be written: {error}")))
}

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let temporary = temporary_name(path);
    // Another process with the same id, for example in a container, must not write the same file.
    File::create_new(&temporary).and_then(|file| {
        let written = write_synced(file, bytes).and_then(|()| fs::rename(&temporary, path));
        // Ignore an error of the removal. The error of the write is reported.
        written.inspect_err(|_| drop(fs::remove_file(&temporary)))
    })
}

fn temporary_name(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}

fn write_synced(mut file: File, bytes: &[u8]) -> io::Result<()> {
    file.write_all(bytes)?;
    // Otherwise the new name may be written to disk before the contents.
    file.sync_all()
}

/// A count with thousands separated: `1,234,567`.
#[must_use]
pub fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number of bytes in the unit that fits it: `3.9 MB`.
#[must_use]
pub fn bytes_text(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        1_000_000.. => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}
