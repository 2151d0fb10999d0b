//! `fieldlod inspect`: what is in a `.fieldlod` file.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use clap::Args;
use fieldlod_cli::output::{Failure, bytes_text, print, thousands, write_whole};
use fieldlod_hierarchy::{BakedFile, FORMAT_VERSION};
use serde::Serialize;

use crate::levels::draw_levels;
use crate::summary::{LevelSummary, PrimitiveSummary, Spread};

/// Check a .fieldlod file and show its levels.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .fieldlod file.
    file: PathBuf,
    /// Draw the levels of the primitive with the most triangles side by side into a PNG file.
    #[arg(long, value_name = "OUT")]
    png: Option<PathBuf>,
    /// Width of the texture in texels: shows how far it slides in texels instead of in widths.
    #[arg(long, value_name = "TEXELS")]
    texture_size: Option<u32>,
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
    // The file, with all its checks.
    let path = &arguments.file;
    let bytes =
        fs::read(path).map_err(|error| Failure::new(path, format!("cannot be read: {error}")))?;
    let file = BakedFile::from_bytes(&bytes).map_err(|error| Failure::new(path, error))?;
    // A picture of the largest primitive.
    if let Some(out) = &arguments.png {
        let hierarchies = file.primitives.iter().map(|primitive| &primitive.hierarchy);
        let largest = hierarchies
            .max_by_key(|hierarchy| hierarchy.source_triangle_count())
            .ok_or_else(|| Failure::new(path, "it has no primitives"))?;
        let picture = draw_levels(largest);
        write_whole(out, &picture.map_err(|error| Failure::new(out, error))?)?;
    }
    // Numbers of all of them.
    let report = Report {
        file: path.display().to_string(),
        format_version: FORMAT_VERSION,
        bytes: bytes.len() as u64,
        primitives: file.primitives.iter().map(PrimitiveSummary::of).collect(),
    };
    let text = |report: &Report| report.text(arguments.texture_size);
    print(&report, arguments.json, text)
}

impl Report {
    fn text(&self, texture_size: Option<u32>) -> String {
        let (size, count) = (bytes_text(self.bytes), self.primitives.len());
        let (version, plural) = (self.format_version, if count == 1 { "" } else { "s" });
        let mut text = format!(
            "{}: {count} primitive{plural}, {size}, format {version}\n",
            self.file
        );
        for primitive in &self.primitives {
            let _ = write!(text, "\n{}", primitive_text(primitive, texture_size));
        }
        text
    }
}

fn primitive_text(primitive: &PrimitiveSummary, texture_size: Option<u32>) -> String {
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
    // One row for each level.
    let slide = if texture_size.is_some() {
        "texels"
    } else {
        "uv"
    };
    let _ = writeln!(
        text,
        "level  groups   units    triangles    area  deviation min     median        max      \
         error     radius  normal  {slide:>9}"
    );
    for level in &primitive.levels {
        let _ = writeln!(text, "{}", level_text(level, texture_size));
    }
    let _ = writeln!(
        text,
        "lengths in units of the mesh; area as a share of the source's; error, radius, normal \
         (degrees off) and {slide} (slide of the texture): medians"
    );
    text
}

fn level_text(level: &LevelSummary, texture_size: Option<u32>) -> String {
    // Medians of all but the deviation, of which the ends are shown, too.
    let deviation = |part: fn(Spread) -> f32| length_text(level.deviation_in_local.map(part));
    let median = |spread: Option<Spread>| spread.map(|spread| spread.median);
    let slide = median(level.uv_error).map(|uv| uv * texture_size.unwrap_or(1) as f32);
    let normal = median(level.normal_error_in_degrees);
    format!(
        "{:>5}  {:>6}  {:>6}  {:>11}  {:>5.1}%     {}  {}  {}  {}  {}  {:>6}  {}",
        level.level,
        level.groups,
        level.units,
        thousands(level.triangles),
        level.area_share * 100.0,
        deviation(|spread| spread.min),
        deviation(|spread| spread.median),
        deviation(|spread| spread.max),
        length_text(median(level.error_in_local)),
        length_text(median(level.radius_in_local)),
        normal.map_or("-".to_owned(), |degrees| format!("{degrees:.1}\u{b0}")),
        length_text(slide),
    )
}

fn length_text(length: Option<f32>) -> String {
    match length {
        Some(length) => format!("{length:>9.3e}"),
        None => format!("{:>9}", "-"),
    }
}
