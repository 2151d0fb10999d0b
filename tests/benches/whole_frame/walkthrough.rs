//! The walkthrough, by each method.

use std::process::{Command, Stdio};

use serde_json::Value;

const METHODS: [(&str, &[&str]); 3] = [
    ("full detail", &["--plain"]),
    ("plugin, 1 px", &[]),
    ("plugin, 1 px, visible flux", &["--visible-flux"]),
];
/// Heads of the columns, and their names in the summary.
const COLUMNS: [(&str, &str); 6] = [
    ("triangles", "triangles_drawn"),
    ("ms", "frame_ms"),
    ("main", "main_ms"),
    ("render", "render_ms"),
    ("GPU wait", "wait_ms"),
    ("selection", "selection_ms"),
];

/// Prints a table of medians over the frames of the path.
pub(crate) fn compare() -> Result<(), String> {
    let heads = COLUMNS.map(|(head, _)| format!("{head:>12}")).concat();
    println!("\n{:<28}{heads}", "the walkthrough");
    for (name, options) in METHODS {
        let summary =
            summary_of(options).map_err(|error| format!("walkthrough, {name}: {error}"))?;
        let column = |name: &str| summary[name]["median"].as_f64().unwrap_or(f64::NAN);
        let columns = COLUMNS.map(|(_, name)| format!("{:>12.2}", column(name)));
        println!("{name:<28}{}", columns.concat());
    }
    Ok(())
}

fn summary_of(options: &[&str]) -> Result<Value, String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let output = Command::new(env!("CARGO"))
        .args([
            "run",
            "--release",
            "-p",
            "walkthrough",
            "--",
            "--full",
            "--offscreen",
        ])
        .arg(folder.path())
        .args(options)
        .stderr(Stdio::inherit())
        .output();
    let output = output.map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err(output.status.to_string());
    }
    serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())
}
