//! `fieldlod bake`: a glTF file to a `.fieldlod` or `.fieldpages` file.

use std::fmt::Write;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use fieldlod_bake::{BakeConfig, BakeOutcome, BakeProgress, Skipped, bake_file};
use fieldlod_cli::output::{Failure, bytes_text, print, progress_bar, thousands, write_whole};
use fieldlod_hierarchy::{BakedFile, FileOptions, PageOptions, PagedFile, Precision};
use serde::Serialize;

use crate::fallbacks::{PrimitiveBake, fallback_lines};
use crate::scene::Scene;
use crate::summary::PrimitiveSummary;

/// Bake the static meshes of a glTF file.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf or .glb file.
    input: PathBuf,
    /// The file to write [default: beside the input].
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Round vertex attributes to 16 bits: halves the file.
    #[arg(long)]
    quantize: bool,
    /// Leave out the vertices of the source: saves a third of the file. The file can then only be used
    /// together with the unchanged glTF file.
    #[arg(long)]
    beside_source: bool,
    /// Write a .fieldpages file, which is streamed in pages: for worlds that are larger than memory.
    #[arg(long, conflicts_with = "beside_source")]
    pages: bool,
    /// Write a folder: the scene with its nodes, materials and small meshes, a .fieldpages file with the large
    /// meshes, and a .fieldlod file with the levels of the small meshes.
    #[arg(long, conflicts_with_all = ["beside_source", "pages"], requires = "output")]
    scene: bool,
    /// With --scene: meshes with fewer triangles stay in the scene, and all their levels stay in memory.
    #[arg(long, default_value_t = 20_000, requires = "scene")]
    large_from: u64,
    /// Baking speed, all-round use, small units, or fewest triangles at equal quality.
    #[arg(long, value_enum, default_value = "default")]
    preset: Preset,
    /// Print a JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// The presets of [`BakeConfig`].
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Preset {
    Fast,
    Default,
    FineGrained,
    MaxQuality,
}

impl Preset {
    fn config(self) -> BakeConfig {
        match self {
            Self::Fast => BakeConfig::fast(),
            Self::Default => BakeConfig::default(),
            Self::FineGrained => BakeConfig::fine_grained(),
            Self::MaxQuality => BakeConfig::max_quality(),
        }
    }
}

#[derive(Debug, Serialize)]
struct Report {
    input: String,
    output: String,
    seconds: f64,
    bytes: u64,
    source_triangles: u64,
    coarsest_triangles: u64,
    primitives: Vec<PrimitiveSummary>,
    /// How the bake of each of `primitives` went.
    bakes: Vec<PrimitiveBake>,
    /// The same as lines of text.
    #[serde(skip)]
    fallbacks: String,
    skipped: Vec<SkippedReport>,
    /// A line for each image that could not be read.
    unread_images: Vec<String>,
}

#[derive(Debug, Serialize)]
struct SkippedReport {
    mesh: u32,
    primitive: u32,
    name: String,
    reason: String,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let input = &arguments.input;
    let extension = if arguments.pages {
        "fieldpages"
    } else {
        "fieldlod"
    };
    let default_output = || input.with_extension(extension);
    let output = arguments.output.clone().unwrap_or_else(default_output);
    let started = Instant::now();
    if arguments.scene {
        make_folder(&output)?;
    } else {
        check_writable(input, &output)?;
    }
    let mut outcome = bake_with_progress(input, &arguments.preset.config())?;
    let options = FileOptions {
        precision: if arguments.quantize {
            Precision::Quantized16
        } else {
            Precision::Lossless
        },
        beside_source: arguments.beside_source,
    };
    let mut bytes = outcome.file.to_bytes_with(options);
    if options != FileOptions::default() {
        // The report describes the file, which differs from the bake.
        let written = BakedFile::from_bytes_beside_source(&bytes);
        outcome.file = written.map_err(|error| Failure::new(&output, error))?;
    }
    let page_options = PageOptions {
        precision: options.precision,
        ..PageOptions::default()
    };
    // Rounding a second time changes nothing.
    if arguments.pages {
        bytes = PagedFile::to_bytes(&outcome.file, page_options);
    }
    let written = if arguments.scene {
        write_scene(arguments, &output, &outcome.file, page_options)?
    } else {
        write_whole(&output, &bytes)?;
        bytes.len() as u64
    };
    let seconds = started.elapsed().as_secs_f64();
    let report = Report::new(input, &output, &outcome, seconds, written);
    print(&report, arguments.json, Report::text)
}

/// Creates a folder unless it exists.
fn make_folder(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder)
        .map_err(|error| Failure::new(folder, format!("could not be created: {error}")))
}

/// Writes a scene and its files into a folder. Returns their size in bytes.
fn write_scene(
    arguments: &Arguments,
    folder: &Path,
    baked: &BakedFile,
    options: PageOptions,
) -> Result<u64, Failure> {
    let input = &arguments.input;
    let bytes = fs::read(input).map_err(|error| Failure::new(input, error))?;
    let name = input.file_name().unwrap_or_default();
    let scene_path = folder.join(name);
    // The folder must not be that of the source.
    check_writable(input, &scene_path)?;
    let pages_path = scene_path.with_extension("fieldpages");
    let pages_name = pages_path.file_name().unwrap_or_default();
    let pages_name = pages_name.to_string_lossy();
    let scene = Scene::new(&bytes, baked.clone(), &pages_name, arguments.large_from);
    let scene = scene.map_err(|fault| Failure::new(input, fault))?;
    let beside_scene = FileOptions {
        precision: options.precision,
        beside_source: true,
    };
    for image in scene.images {
        copy_image(input, folder, &image)?;
    }
    let mut files = Vec::new();
    if !scene.large.primitives.is_empty() {
        files.push((pages_path, PagedFile::to_bytes(&scene.large, options)));
    }
    if !scene.small.primitives.is_empty() {
        let small_path = scene_path.with_extension("fieldlod");
        files.push((small_path, scene.small.to_bytes_with(beside_scene)));
    }
    // The scene comes last: the files that it names exist by then.
    files.push((scene_path, scene.glb));
    for (path, bytes) in &files {
        write_whole(path, bytes)?;
    }
    Ok(files.iter().map(|(_, bytes)| bytes.len() as u64).sum())
}

/// Copies an image from the folder of the source, or from a folder below it.
fn copy_image(input: &Path, folder: &Path, image: &str) -> Result<(), Failure> {
    let is_plain = |part| matches!(part, Component::Normal(_));
    let path = Path::new(image);
    let from = input.with_file_name(image);
    if image.contains(['%', ':']) || !path.components().all(is_plain) {
        return Err(Failure::new(
            &from,
            "could not be copied: it is outside the folder of the scene",
        ));
    }
    let to = folder.join(path);
    make_folder(to.parent().unwrap_or(folder))?;
    let bytes = fs::read(&from).map_err(|error| Failure::new(&from, error))?;
    write_whole(&to, &bytes)
}

fn bake_with_progress(input: &Path, config: &BakeConfig) -> Result<BakeOutcome, Failure> {
    let bar = progress_bar("{bar:40} {percent:>3} %  {per_sec:>11} triangles  {eta} left");
    let show = |progress: BakeProgress| {
        bar.set_length(progress.triangles_total);
        bar.set_position(progress.triangles_done);
    };
    let outcome = bake_file(input, config, &show);
    bar.finish_and_clear();
    outcome.map_err(|error| Failure::new(input, error))
}

/// Fails before the bake instead of after it.
fn check_writable(input: &Path, output: &Path) -> Result<(), Failure> {
    if output.is_dir() {
        return Err(Failure::new(output, "could not be written: it is a folder"));
    }
    // The folder of the output must exist.
    let folder = output.parent().filter(|folder| *folder != Path::new(""));
    if folder.is_some_and(|folder| !folder.is_dir()) {
        return Err(Failure::new(output, "could not be written: no such folder"));
    }
    // The output must not be the input under another name.
    let same = match (fs::canonicalize(input), fs::canonicalize(output)) {
        (Ok(input), Ok(output)) => input == output,
        _ => false,
    };
    if same {
        return Err(Failure::new(
            output,
            "would overwrite the file it is baked from",
        ));
    }
    Ok(())
}

impl Report {
    fn new(input: &Path, output: &Path, outcome: &BakeOutcome, seconds: f64, bytes: u64) -> Self {
        let baked = outcome.file.primitives.iter();
        let primitives: Vec<PrimitiveSummary> = baked.map(PrimitiveSummary::of).collect();
        let pairs = || primitives.iter().zip(&outcome.reports);
        let fallbacks = pairs().map(|(p, report)| fallback_lines(&p.title(), report));
        let bakes = pairs().map(|(p, report)| PrimitiveBake::of(p.mesh, p.primitive, report));
        Self {
            input: input.display().to_string(),
            output: output.display().to_string(),
            seconds,
            bytes,
            source_triangles: primitives.iter().map(|p| p.source_triangles).sum(),
            coarsest_triangles: primitives.iter().map(|p| p.coarsest_triangles).sum(),
            bakes: bakes.collect(),
            fallbacks: fallbacks.collect(),
            skipped: outcome.skipped.iter().map(SkippedReport::of).collect(),
            unread_images: outcome
                .unread_images
                .iter()
                .map(ToString::to_string)
                .collect(),
            primitives,
        }
    }

    fn text(&self) -> String {
        // One line for the file, then one line per fallback, skipped primitive and warning.
        let units: usize = self.primitives.iter().map(|p| p.units).sum();
        let levels = self.primitives.iter().map(|p| p.levels.len()).max();
        let mut text = format!(
            "{}: {} triangles to {} in {} levels, {} units, {}, {:.2} s",
            self.output,
            thousands(self.source_triangles),
            thousands(self.coarsest_triangles),
            levels.unwrap_or(0),
            thousands(units as u64),
            bytes_text(self.bytes),
            self.seconds,
        );
        text.push_str(&self.fallbacks);
        for skipped in &self.skipped {
            let SkippedReport {
                mesh,
                primitive,
                name,
                reason,
            } = skipped;
            let _ = write!(
                text,
                "\nskipped: mesh {mesh} ({name:?}), primitive {primitive}: {reason}"
            );
        }
        for unread in &self.unread_images {
            let _ = write!(text, "\nwarning: {}: {unread}", self.input);
        }
        text
    }
}

impl SkippedReport {
    fn of(skipped: &Skipped) -> Self {
        Self {
            mesh: skipped.place.mesh_index,
            primitive: skipped.place.primitive_index,
            name: skipped.place.name.clone(),
            reason: skipped.reason.to_string(),
        }
    }
}
