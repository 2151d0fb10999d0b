//! `fieldlod verify`: checks a `.fieldlod` file against the glTF file that it was baked from.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use clap::Args;
use fieldlod_bake::{
    ImportedPrimitive, SourceMesh, Verified, VerifyError, VerifySettings, import_gltf, verify,
};
use fieldlod_cli::output::{Failure, print, thousands};
use fieldlod_hierarchy::{BakedFile, Hierarchy};
use serde::Serialize;

/// Check a .fieldlod file against its source: invariants, deviations at denser samples, holes,
/// overlaps and flipped triangles in 200 random cuts, and pictures of each level from six sides.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// The .gltf or .glb file that was baked.
    source: PathBuf,
    /// The .fieldlod file.
    file: PathBuf,
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

#[derive(Debug, Serialize)]
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
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (source, path) = (&arguments.source, &arguments.file);
    let bytes = fs::read(path)
        .map_err(|error| Failure::new(path, format!("could not be read: {error}")))?;
    let file =
        BakedFile::from_bytes_beside_source(&bytes).map_err(|error| Failure::new(path, error))?;
    let import = import_gltf(source).map_err(|error| Failure::new(source, error))?;
    let imported = import.primitives.iter();
    let mut primitives: Vec<PrimitiveReport> = imported
        .map(|primitive| PrimitiveReport::of(primitive, &file))
        .collect();
    let extra = file.primitives.iter().filter(|baked| {
        let place = (baked.mesh_index, baked.primitive_index);
        let mut imported = import.primitives.iter();
        !imported.any(|p| (p.place.mesh_index, p.place.primitive_index) == place)
    });
    primitives.extend(extra.map(|baked| {
        let (mesh, primitive) = (baked.mesh_index, baked.primitive_index);
        PrimitiveReport::failed(mesh, primitive, &baked.name, "it is not in the source")
    }));
    let report = Report {
        source: source.display().to_string(),
        file: path.display().to_string(),
        passed: primitives.iter().all(|primitive| primitive.fault.is_none()),
        primitives,
    };
    print(&report, arguments.json, Report::text)?;
    let failed = report
        .primitives
        .iter()
        .filter(|p| p.fault.is_some())
        .count();
    if failed == 0 {
        return Ok(());
    }
    let all = report.primitives.len();
    let fault = format!("{failed} of {all} primitives failed");
    Err(Failure::new(path, fault))
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
    let whole = baked
        .clone()
        .with_source_vertices(&source.finite_vertices())?;
    verify(source, &whole, &settings)
}

impl PrimitiveReport {
    fn of(imported: &ImportedPrimitive, file: &BakedFile) -> Self {
        let name = &imported.place.name;
        let (mesh, primitive) = (imported.place.mesh_index, imported.place.primitive_index);
        let Some(baked) = file.find(mesh, primitive) else {
            return Self::failed(mesh, primitive, name, "it is not in the file");
        };
        match verify_against(&imported.mesh, &baked.hierarchy) {
            Ok(verified) => Self::passed(mesh, primitive, name, &verified),
            Err(fault) => Self::failed(mesh, primitive, name, &fault.to_string()),
        }
    }

    fn passed(mesh: u32, primitive: u32, name: &str, verified: &Verified) -> Self {
        Self {
            mesh,
            primitive,
            name: name.to_owned(),
            fault: None,
            samples: verified.samples,
            source_to_simplified: verified.source_to_simplified,
            simplified_to_source: verified.simplified_to_source,
            cuts: verified.cuts,
            flipped_area: verified.flipped_area,
            wrong_pixels: verified.wrong_pixels,
        }
    }

    fn failed(mesh: u32, primitive: u32, name: &str, fault: &str) -> Self {
        let nothing = Self::passed(mesh, primitive, name, &Verified::default());
        Self {
            fault: Some(fault.to_owned()),
            ..nothing
        }
    }

    fn text(&self) -> String {
        let Self {
            mesh, primitive, ..
        } = self;
        let place = format!("mesh {mesh} ({:?}), primitive {primitive}", self.name);
        match &self.fault {
            Some(fault) => format!("{place}: FAILED: {fault}"),
            None => format!(
                "{place}: pass; of the deviation stated, {} samples reach {:.3} (source to \
                 simplified) and {:.3} (back); {} cuts without holes, {:.2} % of area flipped, \
                 {:.2} % of pixels wrong",
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
    fn text(&self) -> String {
        let verdict = if self.passed { "pass" } else { "FAILED" };
        let mut text = format!("{}: {verdict}\n", self.file);
        for primitive in &self.primitives {
            let _ = writeln!(text, "{}", primitive.text());
        }
        text
    }
}
