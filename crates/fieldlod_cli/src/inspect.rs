//! `fieldlod inspect`: checks a `.fieldlod` or `.fieldpages` file and prints its contents.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use clap::Args;
use fieldlod_cli::output::{Failure, bytes_text, print, thousands};
use fieldlod_hierarchy::{BakedFile, FORMAT_VERSION, PagedFile};
use serde::Serialize;

use crate::pages::PagesReport;
use crate::summary::{LevelSummary, PrimitiveSummary, Spread};

/// Check a .fieldlod file and show its levels, or a .fieldpages file and show its pages.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .fieldlod or .fieldpages file.
    file: PathBuf,
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
    let bytes = fs::read(path)
        .map_err(|error| Failure::new(path, format!("could not be read: {error}")))?;
    if PagedFile::is_paged(&bytes) {
        return inspect_pages(arguments, &bytes);
    }
    let file = BakedFile::from_bytes(&bytes).map_err(|error| Failure::new(path, error))?;
    let report = Report {
        file: path.display().to_string(),
        format_version: FORMAT_VERSION,
        bytes: bytes.len() as u64,
        primitives: file.primitives.iter().map(PrimitiveSummary::of).collect(),
    };
    print(&report, arguments.json, Report::text)
}

fn inspect_pages(arguments: &Arguments, bytes: &[u8]) -> Result<(), Failure> {
    let path = &arguments.file;
    let report = PagesReport::of(path.display().to_string(), bytes);
    let report = report.map_err(|error| Failure::new(path, error))?;
    print(&report, arguments.json, PagesReport::text)
}

impl Report {
    fn text(&self) -> String {
        let (size, count) = (bytes_text(self.bytes), self.primitives.len());
        let (version, plural) = (self.format_version, if count == 1 { "" } else { "s" });
        let mut text = format!(
            "{}: {count} primitive{plural}, {size}, format {version}\n",
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
        "{}: {} triangles, {} vertices of the source, {} moved\n",
        primitive.title(),
        thousands(primitive.source_triangles),
        thousands(u64::from(primitive.source_vertices)),
        thousands(u64::from(primitive.moved_vertices)),
    );
    if primitive.position_error_in_local > 0.0 {
        let error = primitive.position_error_in_local;
        let _ = writeln!(text, "quantized: positions differ by up to {error:.3e}");
    }
    if let Some(joint) = primitive.carrier_joint {
        let _ = writeln!(
            text,
            "skinned: joint {joint} places it; lengths hold in the poses of the bake"
        );
    }
    // One row for each level.
    let _ = writeln!(
        text,
        "level  groups   units    triangles    area  deviation min     median        max      \
         error     radius"
    );
    for level in &primitive.levels {
        let _ = writeln!(text, "{}", level_text(level));
    }
    let _ = writeln!(
        text,
        "lengths in units of the mesh; area relative to the source; error and radius: medians"
    );
    text
}

fn level_text(level: &LevelSummary) -> String {
    let deviation = |part: fn(Spread) -> f32| length_text(level.deviation_in_local.map(part));
    let median = |spread: Option<Spread>| spread.map(|spread| spread.median);
    format!(
        "{:>5}  {:>6}  {:>6}  {:>11}  {:>6}     {}  {}  {}  {}  {}",
        level.level,
        level.groups,
        level.units,
        thousands(level.triangles),
        format!("{:.1}%", level.area_share * 100.0),
        deviation(|spread| spread.min),
        deviation(|spread| spread.median),
        deviation(|spread| spread.max),
        length_text(median(level.error_in_local)),
        length_text(median(level.radius_in_local)),
    )
}

fn length_text(length: Option<f32>) -> String {
    match length {
        Some(length) => format!("{length:>9.3e}"),
        None => format!("{:>9}", "-"),
    }
}
