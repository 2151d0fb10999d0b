//! Why a command failed, in one line.

use std::fmt::{self, Display};
use std::path::{Path, PathBuf};

/// A file and what is wrong with it.
#[derive(Debug)]
pub(crate) struct Failure {
    path: PathBuf,
    fault: String,
}

impl Failure {
    pub(crate) fn new(path: &Path, fault: impl Display) -> Self {
        Self {
            path: path.to_owned(),
            fault: fault.to_string(),
        }
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = format!("error: {}: {}", self.path.display(), self.fault);
        // A name may hold a line end.
        f.write_str(&line.replace(char::is_control, " "))
    }
}
