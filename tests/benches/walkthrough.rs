//! Runs the walkthrough.

use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

/// Runs the walkthrough with these options, and returns its summary. Pictures go to `folder`.
pub(crate) fn draw(folder: &Path, options: &[&str]) -> Result<Value, String> {
    let output = Command::new(env!("CARGO"))
        .args(["run", "--release", "-p", "walkthrough", "--", "--offscreen"])
        .arg(folder)
        .args(options)
        .stderr(Stdio::inherit())
        .output();
    let output = output.map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err(output.status.to_string());
    }
    serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())
}

/// The same; the pictures are thrown away.
#[expect(clippy::allow_attributes, reason = "not all benches use it")]
#[allow(dead_code)]
pub(crate) fn summary_of(options: &[&str]) -> Result<Value, String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    draw(folder.path(), options)
}

/// Removes the baked meshes of earlier runs.
#[expect(clippy::allow_attributes, reason = "not all benches use it")]
#[allow(dead_code)]
pub(crate) fn remove_cache() -> Result<(), String> {
    let cache = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/release/walkthrough-cache");
    match std::fs::remove_dir_all(&cache) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(format!("could not remove {}: {error}", cache.display()))
        }
        _ => Ok(()),
    }
}
