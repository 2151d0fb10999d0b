//! `fieldlod verify`: checks a `.fieldlod` or `.fieldpages` file against the glTF file that it was baked from.

use std::collections::BTreeSet;
use std::fmt::{Display, Write};
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use fieldlod_bake::{
    Import, ImportError, ImportedPrimitive, PrimitivePlace, SourceMesh, Verified, VerifyError,
    VerifySettings, import_gltf, unpack_gltf, verify, verify_rigged,
};
use fieldlod_cli::output::{Failure, print, thousands};
use fieldlod_hierarchy::{BakedFile, Hierarchy, PagedFile};
use serde::Serialize;

use crate::bake::add_clips;

/// Check a .fieldlod or .fieldpages file against its source: invariants, deviations at denser samples, and pictures of each level from
/// six sides. 200 random cuts are checked for holes, overlaps and flipped triangles. Skinned and morphed meshes are
/// checked in the poses of their animations.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf or .glb file that was baked, or the scene that `bake --scene` wrote beside its files.
    source: PathBuf,
    /// The .fieldlod or .fieldpages file. Primitives that it lacks are checked in the other of both files of a scene.
    file: PathBuf,
    /// Other glTF files with animations of skinned meshes, for nodes with the same names. Pass those of the bake: in other
    /// poses, levels may deviate more than the file states.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    clips: Vec<PathBuf>,
    /// Print a JSON object instead of text.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    source: String,
    file: String,
    passed: bool,
    primitives: Vec<PrimitiveReport>,
}

#[derive(Debug, Default, Serialize)]
struct PrimitiveReport {
    mesh: u32,
    primitive: u32,
    name: String,
    /// The check that failed, if any.
    fault: Option<String>,
    samples: u64,
    /// Largest distances relative to the stated deviations.
    source_to_simplified: f32,
    simplified_to_source: f32,
    cuts: u32,
    flipped_area: f32,
    wrong_pixels: f32,
    /// Results of a skinned or morphed mesh.
    posed: Option<PosedReport>,
    /// Whether the source is a scene that lacks the mesh, because it is in pages. It was not checked.
    in_pages: bool,
}

#[derive(Debug, Serialize)]
struct PosedReport {
    poses: usize,
    /// The largest distance in these poses relative to the stated deviation.
    share: f32,
    /// Bounds of the same ratio while joints bend by up to 15°, 45° and 90°.
    bounds: [f32; 3],
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (source, path) = (&arguments.source, &arguments.file);
    let files = Files::read(source, path)?;
    let mut import = import_gltf(source).map_err(|error| Failure::new(source, error))?;
    add_clips(&mut import, &arguments.clips)?;
    let report = Report::of(arguments, &import, &files);
    print(&report, arguments.json, Report::text)?;
    if report.passed {
        return Ok(());
    }
    let (failed, all) = (report.failed().count(), report.primitives.len());
    let fault = format!("{failed} of {all} primitives failed");
    Err(Failure::new(path, fault))
}

/// The levels of a scene: the file to check, and the other file of a scene.
struct Files {
    levels: BakedFile,
    pages: Option<(PagedFile, Vec<u8>)>,
    /// Primitives of a scene that only show their coarsest level: their levels are in pages.
    in_pages: BTreeSet<(u32, u32)>,
}

impl Files {
    fn read(source: &Path, path: &Path) -> Result<Self, Failure> {
        let bytes = |path: &Path| {
            fs::read(path)
                .map_err(|error| Failure::new(path, format!("could not be read: {error}")))
        };
        let own = bytes(path)?;
        let is_paged = PagedFile::is_paged(&own);
        let other_path = path.with_extension(if is_paged { "fieldlod" } else { "fieldpages" });
        let other = other_path
            .is_file()
            .then(|| bytes(&other_path))
            .transpose()?;
        let (levels, pages) = if is_paged {
            (
                other.map(|bytes| (other_path.as_path(), bytes)),
                Some((path, own)),
            )
        } else {
            (
                Some((path, own)),
                other.map(|bytes| (other_path.as_path(), bytes)),
            )
        };
        let levels = levels.map(|(path, bytes)| {
            BakedFile::from_bytes_beside_source(&bytes).map_err(|error| Failure::new(path, error))
        });
        let pages = pages.map(|(path, bytes)| {
            let paged = PagedFile::from_contents(&bytes);
            Ok::<_, Failure>((paged.map_err(|error| Failure::new(path, error))?, bytes))
        });
        let in_pages = if is_paged || pages.is_none() {
            BTreeSet::new()
        } else {
            primitives_in_pages(source)?
        };
        Ok(Self {
            levels: levels.transpose()?.unwrap_or_default(),
            pages: pages.transpose()?,
            in_pages,
        })
    }

    /// The result of a primitive. `None` if no file has it.
    fn verify(&self, imported: &ImportedPrimitive) -> Option<Result<Verified, Box<dyn Display>>> {
        let boxed = |fault: VerifyError| -> Box<dyn Display> { Box::new(fault) };
        let place = (imported.place.mesh_index, imported.place.primitive_index);
        if let Some(baked) = self.levels.find(place.0, place.1) {
            return Some(verify_against(&imported.mesh, &baked.hierarchy).map_err(boxed));
        }
        let (paged, bytes) = self.pages.as_ref()?;
        let mut meshes = paged.meshes.iter();
        let mesh = meshes.find(|mesh| (mesh.mesh_index, mesh.primitive_index) == place)?;
        if mesh.graph.source != imported.mesh.source_hash() {
            return Some(Err(boxed(VerifyError::OtherSource)));
        }
        let (mut whole, firsts) = match mesh.read_all(bytes, &imported.mesh.finite_vertices()) {
            Ok(read) => read,
            Err(fault) => return Some(Err(Box::new(fault))),
        };
        // Pages do not tell equal vertices apart.
        let mut source = imported.mesh.clone();
        source
            .indices
            .iter_mut()
            .for_each(|vertex| *vertex = firsts[*vertex as usize]);
        whole.source = source.source_hash();
        Some(verify(&source, &whole, &VerifySettings::default()).map_err(boxed))
    }

    /// The places and names of all primitives in the files.
    fn places(&self) -> impl Iterator<Item = (u32, u32, &str)> {
        let levels = self.levels.primitives.iter();
        let levels = levels.map(|p| (p.mesh_index, p.primitive_index, &*p.name));
        let pages = self.pages.iter().flat_map(|(paged, _)| &paged.meshes);
        levels.chain(pages.map(|p| (p.mesh_index, p.primitive_index, &*p.name)))
    }
}

/// The primitives of a scene whose `extras` name a file of pages.
fn primitives_in_pages(source: &Path) -> Result<BTreeSet<(u32, u32)>, Failure> {
    let fail = |error| Failure::new(source, error);
    let bytes = fs::read(source).map_err(|error| fail(ImportError::Read(error)))?;
    let beside = |name: &str| fs::read(source.with_file_name(name));
    let json = unpack_gltf(&bytes, &beside).map_err(fail)?.json;
    let meshes = (0..).zip(json["meshes"].as_array().into_iter().flatten());
    let places = meshes.flat_map(|(mesh, object)| {
        let primitives = (0..).zip(object["primitives"].as_array().into_iter().flatten());
        let paged = primitives.filter(|(_, own)| own["extras"]["fieldlod"]["pages"].is_string());
        paged.map(move |(primitive, _)| (mesh, primitive))
    });
    Ok(places.collect())
}

/// Verifies a hierarchy, which may lack the vertices of its source.
fn verify_against(source: &SourceMesh, baked: &Hierarchy) -> Result<Verified, VerifyError> {
    let settings = VerifySettings::default();
    if !baked.lacks_source_vertices() {
        return verify(source, baked, &settings);
    }
    // The vertices of another mesh would not fit.
    if baked.source != source.source_hash() {
        return Err(VerifyError::OtherSource);
    }
    let vertices = source.finite_vertices();
    let whole = baked.clone().with_source_vertices(&vertices)?;
    verify(source, &whole, &settings)
}

/// Verifies the skinned and morphed primitives of a file, each with its index.
fn verify_rigged_of(import: &Import, file: &BakedFile) -> Vec<(usize, PrimitiveReport)> {
    let baked = import.primitives.iter().map(|primitive| {
        let place = &primitive.place;
        let baked = file.find(place.mesh_index, place.primitive_index)?;
        let vertices = primitive.mesh.finite_vertices();
        // A hierarchy of another mesh becomes an empty hierarchy. Its hash also differs, so the check fails.
        let whole = baked.hierarchy.clone().with_source_vertices(&vertices);
        Some(whole.unwrap_or_default())
    });
    let baked: Vec<Option<Hierarchy>> = baked.collect();
    let verified = verify_rigged(import, &baked, &VerifySettings::default()).into_iter();
    let reports = verified.map(|(index, verified)| {
        let report = PrimitiveReport::at(&import.primitives[index].place);
        let report = match verified {
            Ok(verified) => PrimitiveReport {
                posed: Some(PosedReport {
                    poses: verified.poses,
                    share: verified.share,
                    bounds: verified.bounds,
                }),
                ..report
            },
            Err(fault) => report.failed(&fault),
        };
        (index, report)
    });
    reports.collect()
}

impl PrimitiveReport {
    fn at(place: &PrimitivePlace) -> Self {
        Self {
            mesh: place.mesh_index,
            primitive: place.primitive_index,
            name: place.name.clone(),
            ..Self::default()
        }
    }

    fn of(imported: &ImportedPrimitive, files: &Files) -> Self {
        let report = Self::at(&imported.place);
        if files.in_pages.contains(&(report.mesh, report.primitive)) {
            let in_pages = true;
            return Self { in_pages, ..report };
        }
        match files.verify(imported) {
            None => report.failed(&"it is not in the file"),
            Some(Ok(verified)) => Self {
                samples: verified.samples,
                source_to_simplified: verified.source_to_simplified,
                simplified_to_source: verified.simplified_to_source,
                cuts: verified.cuts,
                flipped_area: verified.flipped_area,
                wrong_pixels: verified.wrong_pixels,
                ..report
            },
            Some(Err(fault)) => report.failed(&fault),
        }
    }

    fn failed(self, fault: &dyn Display) -> Self {
        let fault = Some(fault.to_string());
        Self { fault, ..self }
    }

    fn text(&self) -> String {
        let (mesh, primitive) = (self.mesh, self.primitive);
        let place = format!("mesh {mesh} ({:?}), primitive {primitive}", self.name);
        if self.in_pages {
            return format!(
                "{place}: in pages; verify them against the file that the scene was baked from"
            );
        }
        if let Some(posed) = &self.posed {
            let [a, b, c] = posed.bounds;
            return format!(
                "{place}: pass; levels reach {:.3} of their stated deviation in {} poses, and at most {a:.1}, {b:.1} \
                 and {c:.1} if joints bend by 15°, 45° and 90°",
                posed.share, posed.poses
            );
        }
        match &self.fault {
            Some(fault) => format!("{place}: FAILED: {fault}"),
            None => format!(
                "{place}: pass; {} samples reach {:.3} (source to simplified) and {:.3} (simplified to source) \
                 of the stated deviation; {} cuts without holes, {:.2} % of area flipped, {:.2} % of pixels wrong",
                thousands(self.samples),
                self.source_to_simplified,
                self.simplified_to_source,
                self.cuts,
                self.flipped_area * 100.0,
                self.wrong_pixels * 100.0,
            ),
        }
    }
}

impl Report {
    /// Verifies all primitives of the source, in its order. Other primitives of the file fail.
    fn of(arguments: &Arguments, import: &Import, files: &Files) -> Self {
        let mut primitives = verify_rigged_of(import, &files.levels);
        let imported = import.primitives.iter().enumerate();
        let of_mesh = imported.filter(|(_, primitive)| primitive.rig.is_none());
        primitives.extend(of_mesh.map(|(i, primitive)| (i, PrimitiveReport::of(primitive, files))));
        primitives.sort_by_key(|(index, _)| *index);
        let primitives = primitives.into_iter().map(|(_, report)| report);
        let mut primitives: Vec<PrimitiveReport> = primitives.collect();
        for (mesh, primitive, name) in files.places() {
            let mut found = primitives.iter().map(|p| (p.mesh, p.primitive));
            if !found.any(|place| place == (mesh, primitive)) {
                let report = PrimitiveReport {
                    mesh,
                    primitive,
                    name: name.to_owned(),
                    ..PrimitiveReport::default()
                };
                primitives.push(report.failed(&"it is not in the source"));
            }
        }
        Self {
            source: arguments.source.display().to_string(),
            file: arguments.file.display().to_string(),
            passed: primitives.iter().all(|primitive| primitive.fault.is_none()),
            primitives,
        }
    }

    fn failed(&self) -> impl Iterator<Item = &PrimitiveReport> {
        self.primitives.iter().filter(|p| p.fault.is_some())
    }

    fn text(&self) -> String {
        let verdict = if self.passed { "pass" } else { "FAILED" };
        let mut text = format!("{}: {verdict}\n", self.file);
        for primitive in &self.primitives {
            let _ = writeln!(text, "{}", primitive.text());
        }
        text
    }
}
