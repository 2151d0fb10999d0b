//! Half a second of the walkthrough, by each method.

use std::process::{Command, ExitCode, Stdio};

use serde_json::Value;

const METHODS: [(&str, &[&str]); 3] = [
    ("full detail", &["--plain"]),
    ("plugin, 1 px", &[]),
    ("plugin, visible flux", &["--visible-flux"]),
];
/// Frames of a sixtieth of a second, one after the other along the avenue.
const WALK: [&str; 5] = ["--time", "--frames", "30", "--stretch", "0.3-0.30833"];
/// Heads of the columns of times, and their names in the summary.
const TIMES: [(&str, &str); 4] = [
    ("ms", "frame_ms"),
    ("main", "main_ms"),
    ("render", "render_ms"),
    ("GPU", "wait_ms"),
];

/// Prints a table of medians. `program` is the walkthrough, built before; `None` builds it.
pub(crate) fn compare(program: Option<&str>) -> ExitCode {
    let heads = TIMES.map(|(head, _)| format!("{head:>9}")).concat();
    println!(
        "\nhalf a second of the walkthrough{:>12}{heads}{:>11}",
        "triangles", "selection"
    );
    for (name, options) in METHODS {
        match summary_of(program, options) {
            Ok(summary) => println!("{name:<32}{}", row(&summary)),
            Err(fault) => {
                eprintln!("the walkthrough by {name}: {fault}");
                return ExitCode::FAILURE;
            }
        }
    }
    println!("(GPU: from the end of the render world on. Selection: the mean.)");
    ExitCode::SUCCESS
}

fn summary_of(program: Option<&str>, options: &[&str]) -> Result<Value, String> {
    let mut command = match program {
        Some(program) => Command::new(program),
        None => {
            let mut command = Command::new(env!("CARGO"));
            command.args(["run", "--release", "-p", "walkthrough", "--"]);
            command
        }
    };
    let command = command.args(WALK).args(options).stderr(Stdio::inherit());
    let output = command.output().map_err(|fault| fault.to_string())?;
    if !output.status.success() {
        return Err(output.status.to_string());
    }
    serde_json::from_slice(&output.stdout).map_err(|fault| fault.to_string())
}

fn row(summary: &Value) -> String {
    let number = |name: &str, of: &str| summary[name][of].as_f64().unwrap_or(f64::NAN);
    let times = TIMES.map(|(_, name)| format!("{:>9.2}", number(name, "p50")));
    format!(
        "{:>12.0}{}{:>11.2}",
        number("triangles_drawn", "mean"),
        times.concat(),
        number("selection_ms", "mean")
    )
}
