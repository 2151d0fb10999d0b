//! `fieldlod inspect`: what is in a `.fieldlod` file.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use clap::Args;
use fieldlod_hierarchy::{BakedFile, FORMAT_VERSION};
use serde::Serialize;

use crate::failure::Failure;
use crate::levels::draw_levels;
use crate::output::{bytes_text, print, print_json, thousands, write_whole};
use crate::summary::{LevelSummary, PrimitiveSummary, Spread};

/// Check a .fieldlod file and show its levels.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .fieldlod file.
    file: PathBuf,
    /// Draw the levels of the primitive with the most triangles side by side into a PNG file.
    #[arg(long, value_name = "OUT")]
    png: Option<PathBuf>,
    /// Print a JSON object instead of text.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    file: String,
    format_version: u32,
    bytes: u64,
    primitives: Vec<PrimitiveSummary>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let bytes = fs::read(path);
    let bytes = bytes.map_err(|e| Failure::new(path, format!("cannot be read: {e}")))?;
    let file = BakedFile::from_bytes(&bytes).map_err(|error| Failure::new(path, error))?;
    if let Some(out) = &arguments.png {
        let largest = file.primitives.iter().map(|primitive| &primitive.hierarchy);
        let largest = largest.max_by_key(|hierarchy| hierarchy.source_triangle_count());
        let picture =
            draw_levels(largest.ok_or_else(|| Failure::new(path, "it has no primitives"))?);
        write_whole(out, &picture.map_err(|error| Failure::new(out, error))?)?;
    }
    let report = Report {
        file: path.display().to_string(),
        format_version: FORMAT_VERSION,
        bytes: bytes.len() as u64,
        primitives: file.primitives.iter().map(PrimitiveSummary::of).collect(),
    };
    if arguments.json {
        print_json(&report)
    } else {
        print(&report.text())
    }
}

impl Report {
    fn text(&self) -> String {
        let (size, count) = (bytes_text(self.bytes), self.primitives.len());
        let version = self.format_version;
        let mut text = format!(
            "{}: {count} primitives, {size}, format {version}\n",
            self.file
        );
        for primitive in &self.primitives {
            let _ = write!(text, "\n{}", primitive_text(primitive));
        }
        text
    }
}

fn primitive_text(primitive: &PrimitiveSummary) -> String {
    let mut text = format!(
        "{}: {} triangles, {} vertices, {} clusters\n",
        primitive.title(),
        thousands(primitive.source_triangles),
        thousands(primitive.vertices as u64),
        thousands(primitive.clusters as u64),
    );
    if primitive.position_error_in_local > 0.0 {
        let error = primitive.position_error_in_local;
        let _ = writeln!(text, "quantized: positions off by up to {error:.3e}");
    }
    let _ = writeln!(
        text,
        "level  groups  terminal   units    triangles  error min    median       max  \
         deviation min median     max  radius min    median       max"
    );
    for level in &primitive.levels {
        let _ = writeln!(text, "{}", level_text(level));
    }
    text
}

fn level_text(level: &LevelSummary) -> String {
    format!(
        "{:>5}  {:>6}  {:>8}  {:>6}  {:>11}  {}  {}  {}",
        level.level,
        level.groups,
        level.terminal_groups,
        level.units,
        thousands(level.triangles),
        spread_text(level.error_in_local),
        spread_text(level.deviation_in_local),
        spread_text(level.radius_in_local),
    )
}

fn spread_text(spread: Option<Spread>) -> String {
    match spread {
        Some(Spread { min, median, max }) => format!("{min:>9.3e} {median:>9.3e} {max:>9.3e}"),
        None => format!("{:>9} {:>9} {:>9}", "-", "-", "-"),
    }
}
