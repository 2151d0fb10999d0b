//! `fieldlod bake`: a glTF file to a `.fieldlod` or `.fieldpages` file.

use std::fmt::Write;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use fieldlod_bake::{
    BakeConfig, BakeOutcome, BakeProgress, Import, ImportError, Skipped, UnpackedGltf, bake_import,
    import_gltf, import_gltf_bytes, unpack_gltf,
};
use fieldlod_cli::output::{Failure, bytes_text, print, progress_bar, thousands, write_whole};
use fieldlod_hierarchy::{BakedFile, CLUSTERS_FROM_TRIANGLES, PageOptions, PagedFile, Precision};
use percent_encoding::percent_decode_str;
use serde::Serialize;

use crate::fallbacks::{PrimitiveBake, fallback_lines};
use crate::quantized::{coarse_grids, median_edges};
use crate::scene::{Scene, image_files};
use crate::summary::PrimitiveSummary;

/// Bake the meshes of a glTF file.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf or .glb file.
    input: PathBuf,
    /// The file to write [default: beside the input].
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Round vertex attributes to 16 bits: nearly halves the file.
    #[arg(long)]
    quantize: bool,
    /// Write a .fieldpages file, which is streamed in pages: for worlds that are larger than memory. Pages cannot hold
    /// skinned or morphed meshes.
    #[arg(long)]
    pages: bool,
    /// Write a folder. Its .glb file holds the scene with nodes, materials and small meshes. Its .fieldpages file holds
    /// the large meshes, and its .fieldlod file the levels of the small meshes.
    #[arg(long, conflicts_with = "pages", requires = "output")]
    scene: bool,
    /// With --scene: meshes with fewer triangles stay in the scene, and all their levels stay in memory.
    #[arg(long, default_value_t = CLUSTERS_FROM_TRIANGLES.into(), requires = "scene")]
    large_from: u64,
    /// The bake's priority: speed, all-round use, small units, or fewest triangles at equal quality.
    #[arg(long, value_enum, default_value = "default")]
    preset: Preset,
    /// Keep the vertices of open borders at all levels. Separately baked meshes that share a border, such as terrain
    /// tiles or parts of a kit, then have no cracks at any level. Not needed for meshes of one file.
    #[arg(long)]
    lock_borders: bool,
    /// Other glTF files with animations of skinned meshes, for nodes with the same names. Names of animated nodes must be
    /// unique.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    clips: Vec<PathBuf>,
    /// Fail if a primitive is faulty, rather than skip it with a warning.
    #[arg(long)]
    strict: bool,
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
    fn config(&self) -> BakeConfig {
        BakeConfig {
            lock_borders: self.lock_borders,
            ..self.preset.config()
        }
    }

    fn precision(&self) -> Precision {
        if self.quantize {
            Precision::Quantized16
        } else {
            Precision::Lossless
        }
    }

    fn page_options(&self) -> PageOptions {
        PageOptions {
            precision: self.precision(),
            ..PageOptions::default()
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
    /// Results of the bake of each of `primitives`.
    bakes: Vec<PrimitiveBake>,
    /// The fallbacks of `bakes` as lines of text.
    #[serde(skip)]
    fallbacks: String,
    skipped: Vec<SkippedReport>,
    /// A line for each image that could not be read.
    unread_images: Vec<String>,
    /// Other lines about the result.
    warnings: Vec<String>,
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
    // A bake may take minutes, so errors of the paths are reported before it starts.
    if arguments.scene {
        check_scene_folder(input, &output)?;
    } else {
        check_writable(input, &output)?;
    }
    let (import, scene) = read(arguments)?;
    let mut outcome = bake_with_progress(input, import, &arguments.config())?;
    let mut warnings = Vec::new();
    // Before quantization: boxes around rounded vertices do not fit the exact vertices of the scene.
    let of_scene = match scene {
        Some(scene) => Some(scene.write(arguments, &output, &outcome.file, &mut warnings)?),
        None => None,
    };
    // Edges of the exact mesh: quantization changes them.
    let edges = arguments.quantize.then(|| median_edges(&outcome.file));
    let precision = arguments.precision();
    let mut bytes = outcome.file.to_bytes_with(precision);
    let pages = arguments
        .pages
        .then(|| PagedFile::to_bytes(&outcome.file, arguments.page_options()));
    if precision != Precision::default() {
        // The report describes the file, which differs from the bake.
        let written = BakedFile::from_bytes(&bytes);
        outcome.file = written.map_err(|error| Failure::new(&output, error))?;
    }
    bytes = pages.unwrap_or(bytes);
    if let Some(edges) = edges {
        warnings.extend(coarse_grids(&outcome.file, &edges));
    }
    let written = match of_scene {
        Some(written) => written,
        None => {
            write_whole(&output, &bytes)?;
            bytes.len() as u64
        }
    };
    let seconds = started.elapsed().as_secs_f64();
    let report = Report {
        warnings,
        ..Report::new(input, &output, &outcome, seconds, written)
    };
    print(&report, arguments.json, Report::text)
}

/// Reads the input, and the files of its scene with `--scene`.
fn read(arguments: &Arguments) -> Result<(Import, Option<SceneFiles>), Failure> {
    let input = &arguments.input;
    let fail = |error| Failure::new(input, error);
    let folder = input.parent().unwrap_or(Path::new(""));
    let beside = |name: &str| fs::read(folder.join(name));
    let mut bytes = fs::read(input).map_err(|error| fail(ImportError::Read(error)))?;
    let mut scene = None;
    if arguments.scene {
        let source = unpack_gltf(&bytes, &beside).map_err(fail)?;
        // The rewritten file is baked, because the levels must fit the vertices that the scene holds.
        bytes = source.to_glb().map_err(fail)?;
        let images = read_images(input, &source)?;
        scene = Some(SceneFiles { source, images });
    }
    let mut import = import_gltf_bytes(&bytes, &beside).map_err(fail)?;
    add_clips(&mut import, &arguments.clips)?;
    let fault = import.first_fault().filter(|_| arguments.strict);
    fault.map_or(Ok(()), |fault| Err(fail(fault)))?;
    if arguments.pages {
        check_fits_pages(input, &import)?;
    }
    Ok((import, scene))
}

/// The source of a scene, and its images: their paths relative to the scene, and their bytes.
struct SceneFiles {
    source: UnpackedGltf,
    images: Vec<(PathBuf, Vec<u8>)>,
}

/// The path of a file of the scene in `folder`.
fn scene_path(input: &Path, folder: &Path, extension: &str) -> PathBuf {
    let name = input.with_extension(extension);
    folder.join(name.file_name().unwrap_or_default())
}

/// Fails if a scene in this folder would overwrite its source, or if a file has the folder's name.
fn check_scene_folder(input: &Path, folder: &Path) -> Result<(), Failure> {
    if folder.is_dir() {
        return check_writable(input, &scene_path(input, folder, "glb"));
    }
    if folder.exists() {
        return Err(Failure::new(folder, "could not be created: it is a file"));
    }
    Ok(())
}

impl SceneFiles {
    /// Writes the scene and its files into a folder. Returns their size in bytes, without images.
    fn write(
        self,
        arguments: &Arguments,
        folder: &Path,
        baked: &BakedFile,
        warnings: &mut Vec<String>,
    ) -> Result<u64, Failure> {
        let input = &arguments.input;
        let path = |extension| scene_path(input, folder, extension);
        let pages = path("fieldpages");
        let pages_name = pages.file_name().unwrap_or_default().to_string_lossy();
        let scene = Scene::new(
            self.source,
            baked.clone(),
            &pages_name,
            arguments.large_from,
        );
        let scene = scene.map_err(|fault| Failure::new(input, fault))?;
        warnings.extend(scene.dropped_extensions.iter().map(|name| {
            format!("{name} is left out of meshes in pages: it refers to triangles that are not in the scene")
        }));
        let mut files = self.images;
        for (path, _) in &mut files {
            *path = folder.join(&*path);
        }
        let first_own = files.len();
        if !scene.large.primitives.is_empty() {
            let bytes = PagedFile::to_bytes(&scene.large, arguments.page_options());
            files.push((pages.clone(), bytes));
        }
        if !scene.small.primitives.is_empty() {
            let bytes = scene.small.to_bytes_with(arguments.precision());
            files.push((path("fieldlod"), bytes));
        }
        // The scene comes last, so that the files that it names exist.
        files.push((path("glb"), scene.glb));
        let is_new = !folder.exists();
        let written = files.iter().try_for_each(|(path, bytes)| {
            // Images may be in subfolders.
            make_folder(path.parent().unwrap_or(folder))?;
            write_whole(path, bytes)
        });
        if written.is_err() && is_new {
            // This only removes an empty folder. The error of the write is reported.
            let _ = fs::remove_dir(folder);
        }
        let own = files[first_own..].iter();
        written.map(|()| own.map(|(_, bytes)| bytes.len() as u64).sum())
    }
}

fn make_folder(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder)
        .map_err(|error| Failure::new(folder, format!("could not be created: {error}")))
}

/// Reads the images that a scene names.
fn read_images(input: &Path, source: &UnpackedGltf) -> Result<Vec<(PathBuf, Vec<u8>)>, Failure> {
    let read = |uri: &str| {
        let decoded = percent_decode_str(uri).decode_utf8_lossy();
        let path = Path::new(&*decoded);
        // A scene must not write outside its folder.
        let is_inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        let from = input.with_file_name(path);
        if uri.contains(':') || !path.components().all(is_inside) {
            let fault = "could not be copied: it is outside the folder of the scene";
            return Err(Failure::new(&from, fault));
        }
        let bytes = fs::read(&from).map_err(|error| Failure::new(&from, error))?;
        Ok((path.components().collect(), bytes))
    };
    image_files(source).map(read).collect()
}

/// Fails for skinned and morphed meshes: pages have neither joints nor morph targets.
fn check_fits_pages(input: &Path, import: &Import) -> Result<(), Failure> {
    let mut primitives = import.primitives.iter();
    match primitives.find(|primitive| primitive.rig.is_some()) {
        Some(rigged) => {
            let place = &rigged.place;
            let fault = format!(
                "{place}: pages cannot hold skinned or morphed meshes; use --scene, which keeps them out of the pages"
            );
            Err(Failure::new(input, fault))
        }
        None => Ok(()),
    }
}

/// Adds the clips of other files.
pub(crate) fn add_clips(import: &mut Import, files: &[PathBuf]) -> Result<(), Failure> {
    for path in files {
        let file = import_gltf(path).map_err(|error| Failure::new(path, error))?;
        let added = import.add_clips(file);
        added.map_err(|fault| Failure::new(path, fault))?;
    }
    Ok(())
}

fn bake_with_progress(
    input: &Path,
    import: Import,
    config: &BakeConfig,
) -> Result<BakeOutcome, Failure> {
    let bar = progress_bar("{bar:40} {percent:>3} %  {per_sec:>11} triangles  {eta} left");
    let show = |progress: BakeProgress| {
        bar.set_length(progress.triangles_total);
        bar.set_position(progress.triangles_done);
    };
    let outcome = bake_import(import, config, &show);
    bar.finish_and_clear();
    outcome.map_err(|error| Failure::new(input, error))
}

/// Fails if `output` cannot be written, or if it is the input.
fn check_writable(input: &Path, output: &Path) -> Result<(), Failure> {
    let folder = output.parent().filter(|folder| *folder != Path::new(""));
    // Two different paths may refer to one file.
    let is_input = match (fs::canonicalize(input), fs::canonicalize(output)) {
        (Ok(input), Ok(output)) => input == output,
        _ => false,
    };
    let fault = if output.is_dir() {
        "could not be written: it is a folder"
    } else if folder.is_some_and(|folder| !folder.is_dir()) {
        "could not be written: no such folder"
    } else if is_input {
        "would overwrite the file it is baked from"
    } else {
        return Ok(());
    };
    Err(Failure::new(output, fault))
}

impl Report {
    fn new(input: &Path, output: &Path, outcome: &BakeOutcome, seconds: f64, bytes: u64) -> Self {
        let baked = outcome.file.primitives.iter();
        let primitives: Vec<PrimitiveSummary> = baked.map(PrimitiveSummary::of).collect();
        let unread = outcome.unread_images.iter();
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
            unread_images: unread.map(ToString::to_string).collect(),
            warnings: Vec::new(),
            primitives,
        }
    }

    fn text(&self) -> String {
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
        for unread in self.unread_images.iter().chain(&self.warnings) {
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
