//! `fieldlod bake`: a glTF file to a `.fieldlod` or `.fieldpages` file.

use std::fmt::Write;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use fieldlod_bake::{BakeConfig, BakeOutcome, BakeProgress, Skipped, bake_file};
use fieldlod_cli::output::{Failure, bytes_text, print, progress_bar, thousands, write_whole};
use fieldlod_hierarchy::{BakedFile, FileOptions, Hierarchy, PageOptions, PagedFile, Precision};
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
    /// Keep vertex attributes to 16 bits only: a file of half the size.
    #[arg(long)]
    quantize: bool,
    /// Leave out the source's vertices: a file of two thirds of the size. It can then only be used
    /// where its source is at hand, and unchanged.
    #[arg(long)]
    beside_source: bool,
    /// Write a .fieldpages file, which is read in parts: for worlds that are larger than memory.
    #[arg(long, conflicts_with = "beside_source")]
    pages: bool,
    /// Write a folder: the scene with its nodes, materials and small meshes, a .fieldpages file of its large meshes, which
    /// the scene names, and a .fieldlod file of the small ones.
    #[arg(long, conflicts_with_all = ["beside_source", "pages"], requires = "output")]
    scene: bool,
    /// With --scene: meshes with fewer triangles stay in the scene, with all their levels in memory.
    #[arg(long, default_value_t = 20_000, requires = "scene")]
    large_from: u64,
    /// What to look after: speed, all-round use, small units, or fewest triangles for a picture.
    #[arg(long, value_enum, default_value = "default")]
    preset: Preset,
    /// Add levels of cards for plants: rectangles with pictures of them, for views from far away. Only where
    /// they halve the triangles, for loose pieces such as leaves and fronds of known materials, and not for what
    /// --scene writes in pages.
    #[arg(long, conflicts_with = "pages")]
    cards: bool,
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

impl Arguments {
    /// Why these cannot be asked for together.
    pub(crate) fn conflict(&self) -> Option<&'static str> {
        let is_unmeasured = self.cards && !self.config().measure_appearance;
        is_unmeasured.then_some(
            "--cards cannot be used with --preset fast: cards need pictures, which it does not draw",
        )
    }

    fn config(&self) -> BakeConfig {
        BakeConfig {
            cards: self.cards,
            ..self.preset.config()
        }
    }
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
    /// Whether cards were asked for.
    with_cards: bool,
    /// Course of the bake of each of `primitives`.
    bakes: Vec<PrimitiveBake>,
    /// The same, as lines of text.
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
    let beside = || {
        input.with_extension(match arguments.pages {
            true => "fieldpages",
            false => "fieldlod",
        })
    };
    let output = arguments.output.clone().unwrap_or_else(beside);
    let started = Instant::now();
    if arguments.scene {
        make_folder(&output)?;
    } else {
        check_writable(input, &output)?;
    }
    let mut outcome = bake_with_progress(input, &arguments.config())?;
    if arguments.scene {
        // Pages have none.
        let hierarchies = outcome.file.primitives.iter_mut().map(|p| &mut p.hierarchy);
        let is_large =
            |baked: &&mut Hierarchy| baked.source_triangle_count() >= arguments.large_from;
        hierarchies
            .filter(is_large)
            .for_each(|baked| baked.cards = None);
    }
    // In the form asked for.
    let options = FileOptions {
        precision: match arguments.quantize {
            true => Precision::Quantized16,
            false => Precision::Lossless,
        },
        beside_source: arguments.beside_source,
    };
    let mut bytes = outcome.file.to_bytes_with(options);
    if options != FileOptions::default() {
        // The report is about what is in the file.
        let written = BakedFile::from_bytes_beside_source(&bytes);
        outcome.file = written.map_err(|error| Failure::new(&output, error))?;
    }
    let page_options = PageOptions {
        precision: options.precision,
        ..PageOptions::default()
    };
    // What was rounded before is on the grid already.
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
    let report = Report {
        with_cards: arguments.cards,
        ..Report::new(input, &output, &outcome, seconds, written)
    };
    print(&report, arguments.json, Report::text)
}

/// Makes a folder, unless it is there.
fn make_folder(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder)
        .map_err(|error| Failure::new(folder, format!("cannot be made: {error}")))
}

/// Writes a scene and its files into a folder. Returns how many bytes they have.
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
    // Last, so that what it names is there.
    files.push((scene_path, scene.glb));
    for (path, bytes) in &files {
        write_whole(path, bytes)?;
    }
    Ok(files.iter().map(|(_, bytes)| bytes.len() as u64).sum())
}

/// Copies an image that lies beside the source, or below.
fn copy_image(input: &Path, folder: &Path, image: &str) -> Result<(), Failure> {
    let is_plain = |part| matches!(part, Component::Normal(_));
    let path = Path::new(image);
    let from = input.with_file_name(image);
    if image.contains(['%', ':']) || !path.components().all(is_plain) {
        return Err(Failure::new(
            &from,
            "cannot be taken along: it is elsewhere",
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

/// Finds out before the work, not after it.
fn check_writable(input: &Path, output: &Path) -> Result<(), Failure> {
    if output.is_dir() {
        return Err(Failure::new(output, "cannot be written: it is a folder"));
    }
    // Its folder must be there already.
    let folder = output.parent().filter(|folder| *folder != Path::new(""));
    if folder.is_some_and(|folder| !folder.is_dir()) {
        return Err(Failure::new(output, "cannot be written: no such folder"));
    }
    // And it must not be the input, under whatever name.
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
            with_cards: false,
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
        // One line for the file, then what went otherwise than it should.
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
        if self.with_cards {
            let primitives = self.primitives.iter();
            let with_cards = primitives.filter(|p| !p.card_levels.is_empty()).count();
            let count = self.primitives.len();
            let _ = write!(text, "\ncards: of {with_cards} of {count} primitives");
        }
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
