//! `fieldlod verify`: checks a `.fieldlod` or `.fieldpages` file against the glTF file that it was baked from.

use std::collections::BTreeMap;
use std::fmt::{Display, Write};
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use fieldlod_bake::{
    Import, ImportError, ImportedPrimitive, PrimitivePlace, SourceMesh, VerifySettings,
    import_gltf, unpack_gltf, verify, verify_layers, verify_rigged,
};
use fieldlod_cli::output::{Failure, print, thousands};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, FileError, Hierarchy, PagedFile};
use serde::Serialize;

use crate::bake::add_clips;

/// Check a .fieldlod or .fieldpages file against its source: invariants, deviations at denser samples, and pictures of
/// each level from six sides. 200 random cuts are checked for holes, overlaps and flipped triangles. Thin layers, such as
/// labels, must stay in front of static meshes. Skinned and morphed meshes are checked in the poses of their animations.
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
    /// Primitives that the source lacks, because it is a scene and they are in its pages. They were not checked.
    in_pages: usize,
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
    let mut import = import_gltf(source).map_err(|error| Failure::new(source, error))?;
    add_clips(&mut import, &arguments.clips)?;
    let mut file = BakedFile::default();
    add_file(&mut file, path, &mut import)?;
    let mut in_pages = 0;
    if lacks_any(&file, &import) {
        in_pages = remove_primitives_in_pages(&mut import, source)?;
    }
    // A scene has its levels in two files.
    let others = ["fieldlod", "fieldpages"].map(|extension| path.with_extension(extension));
    for other in others
        .iter()
        .filter(|other| *other != path && other.is_file())
    {
        if lacks_any(&file, &import) {
            add_file(&mut file, other, &mut import)?;
        }
    }
    let report = Report {
        in_pages,
        ..Report::of(arguments, &import, &file)
    };
    print(&report, arguments.json, Report::text)?;
    if report.passed {
        return Ok(());
    }
    let (failed, all) = (report.failed().count(), report.primitives.len());
    let fault = format!("{failed} of {all} primitives failed");
    Err(Failure::new(path, fault))
}

fn lacks_any(file: &BakedFile, import: &Import) -> bool {
    let mut places = import.primitives.iter().map(|primitive| &primitive.place);
    places.any(|place| file.find(place.mesh_index, place.primitive_index).is_none())
}

/// Adds the primitives of a `.fieldlod` or `.fieldpages` file that `file` lacks.
fn add_file(file: &mut BakedFile, path: &Path, import: &mut Import) -> Result<(), Failure> {
    let bytes = fs::read(path)
        .map_err(|error| Failure::new(path, format!("could not be read: {error}")))?;
    let read = if PagedFile::is_paged(&bytes) {
        read_pages(&bytes, file, import)
    } else {
        BakedFile::from_bytes(&bytes)
    };
    for primitive in read.map_err(|error| Failure::new(path, error))?.primitives {
        if file
            .find(primitive.mesh_index, primitive.primitive_index)
            .is_none()
        {
            file.primitives.push(primitive);
        }
    }
    Ok(())
}

/// The meshes of a `.fieldpages` file that `file` lacks. Pages do not tell equal vertices apart, so the triangles of
/// their sources use the first ones.
fn read_pages(bytes: &[u8], file: &BakedFile, import: &mut Import) -> Result<BakedFile, FileError> {
    let mut primitives = Vec::new();
    for mesh in PagedFile::from_contents(bytes)?.meshes {
        let (index, number) = (mesh.mesh_index, mesh.primitive_index);
        // A hierarchy without a source fails.
        let mut hierarchy = Hierarchy::default();
        let mut imported = import.primitives.iter_mut();
        let imported = imported.find(|own| {
            (own.place.mesh_index, own.place.primitive_index) == (index, number)
                && file.find(index, number).is_none()
                && own.mesh.source_hash() == mesh.graph.source
        });
        if let Some(ImportedPrimitive { mesh: source, .. }) = imported {
            let (read, firsts) = mesh.read_all(bytes, &source.finite_vertices())?;
            source
                .indices
                .iter_mut()
                .for_each(|vertex| *vertex = firsts[*vertex as usize]);
            hierarchy = read;
            hierarchy.source = source.source_hash();
        }
        primitives.push(BakedPrimitive::new(index, number, mesh.name, hierarchy));
    }
    Ok(BakedFile { primitives })
}

/// Removes the primitives of a scene whose `extras` name a file of pages: the scene has only their coarsest level.
fn remove_primitives_in_pages(import: &mut Import, source: &Path) -> Result<usize, Failure> {
    let fail = |error| Failure::new(source, error);
    let bytes = fs::read(source).map_err(|error| fail(ImportError::Read(error)))?;
    let beside = |name: &str| fs::read(source.with_file_name(name));
    let json = unpack_gltf(&bytes, &beside).map_err(fail)?.json;
    let before = import.primitives.len();
    import.primitives.retain(|primitive| {
        let place = &primitive.place;
        let primitives = &json["meshes"][place.mesh_index as usize]["primitives"];
        let extras = &primitives[place.primitive_index as usize]["extras"];
        !extras["fieldlod"]["pages"].is_string()
    });
    Ok(before - import.primitives.len())
}

/// Checks thin layers between static primitives that passed and have the same global transform. All of these fail if a
/// layer is lost.
fn verify_layers_between(import: &Import, file: &BakedFile, reports: &mut [PrimitiveReport]) {
    let mut of_spaces: BTreeMap<u32, (Vec<usize>, Vec<(&SourceMesh, &Hierarchy)>)> =
        BTreeMap::new();
    for (index, primitive) in import.primitives.iter().enumerate() {
        let place = &primitive.place;
        let baked = file.find(place.mesh_index, place.primitive_index);
        let is_static = primitive.rig.is_none() && reports[index].fault.is_none();
        if let Some(baked) = baked.filter(|_| is_static) {
            let of_space = of_spaces.entry(import.space_of_mesh(place.mesh_index));
            let (indices, parts) = of_space.or_default();
            indices.push(index);
            parts.push((&primitive.mesh, &baked.hierarchy));
        }
    }
    for (indices, parts) in of_spaces.into_values().filter(|(own, _)| own.len() > 1) {
        if let Err(fault) = verify_layers(&parts) {
            for index in indices {
                reports[index].fault = Some(fault.to_string());
            }
        }
    }
}

/// Verifies the skinned and morphed primitives of a file, each with its index.
fn verify_rigged_of(import: &Import, file: &BakedFile) -> Vec<(usize, PrimitiveReport)> {
    let baked = import.primitives.iter().map(|primitive| {
        let place = &primitive.place;
        let baked = file.find(place.mesh_index, place.primitive_index)?;
        Some(baked.hierarchy.clone())
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

    fn of(imported: &ImportedPrimitive, file: &BakedFile) -> Self {
        let report = Self::at(&imported.place);
        let Some(baked) = file.find(report.mesh, report.primitive) else {
            return report.failed(&"it is not in the file");
        };
        match verify(&imported.mesh, &baked.hierarchy, &VerifySettings::default()) {
            Ok(verified) => Self {
                samples: verified.samples,
                source_to_simplified: verified.source_to_simplified,
                simplified_to_source: verified.simplified_to_source,
                cuts: verified.cuts,
                flipped_area: verified.flipped_area,
                wrong_pixels: verified.wrong_pixels,
                ..report
            },
            Err(fault) => report.failed(&fault),
        }
    }

    fn failed(self, fault: &dyn Display) -> Self {
        let fault = Some(fault.to_string());
        Self { fault, ..self }
    }

    fn text(&self) -> String {
        let (mesh, primitive) = (self.mesh, self.primitive);
        let place = format!("mesh {mesh} ({:?}), primitive {primitive}", self.name);
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
    fn of(arguments: &Arguments, import: &Import, file: &BakedFile) -> Self {
        let mut primitives = verify_rigged_of(import, file);
        let imported = import.primitives.iter().enumerate();
        let of_mesh = imported.filter(|(_, primitive)| primitive.rig.is_none());
        primitives.extend(of_mesh.map(|(i, primitive)| (i, PrimitiveReport::of(primitive, file))));
        primitives.sort_by_key(|(index, _)| *index);
        let primitives = primitives.into_iter().map(|(_, report)| report);
        let mut primitives: Vec<PrimitiveReport> = primitives.collect();
        verify_layers_between(import, file, &mut primitives);
        for baked in &file.primitives {
            let (mesh, primitive) = (baked.mesh_index, baked.primitive_index);
            let mut found = primitives.iter().map(|p| (p.mesh, p.primitive));
            if !found.any(|place| place == (mesh, primitive)) {
                let name = baked.name.clone();
                let report = PrimitiveReport {
                    mesh,
                    primitive,
                    name,
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
            in_pages: 0,
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
        if self.in_pages > 0 {
            let hint = "in pages; verify them against the file that the scene was baked from";
            let _ = writeln!(text, "not checked: {} {hint}", self.in_pages);
        }
        text
    }
}
