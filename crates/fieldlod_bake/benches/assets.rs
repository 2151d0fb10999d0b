//! Bakes and verifies every primitive of every glTF file in a folder and its folders, with every preset:
//! what users have, not what is clean.
//!
//! `FIELDLOD_MODELS=… cargo bench -p fieldlod_bake --bench assets`, with `-- NAME` for the files with that
//! in their name only. A line for each primitive that fails, and a summary for each file and preset.

use std::path::{Path, PathBuf};
use std::time::Instant;

use fieldlod_bake::{
    BakeConfig, Import, VerifySettings, bake_mesh_with_report, import_gltf, verify,
};
use rayon::prelude::*;

fn main() {
    let Some(folder) = std::env::var_os("FIELDLOD_MODELS") else {
        println!("FIELDLOD_MODELS names no folder: nothing to bake");
        return;
    };
    let mut arguments = std::env::args().skip(1);
    let wanted = arguments.find(|argument| !argument.starts_with("--"));
    let wanted = wanted.unwrap_or_default();
    let mut files = Vec::new();
    collect(Path::new(&folder), &mut files);
    files.sort();
    let presets = [
        ("default", BakeConfig::default()),
        ("fine_grained", BakeConfig::fine_grained()),
        ("max_quality", BakeConfig::max_quality()),
        ("fast", BakeConfig::fast()),
    ];
    let (mut failed, mut all) = (0, 0);
    for file in &files {
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        if !name.contains(&wanted) {
            continue;
        }
        let import = match import_gltf(file) {
            Ok(import) => import,
            Err(error) => {
                println!("{name}: {error}");
                continue;
            }
        };
        for (preset, config) in &presets {
            let failures = report(&format!("{name}, {preset}"), &import, config);
            failed += failures;
            all += import.primitives.len();
        }
    }
    println!("{failed} of {all} fail");
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        let extension = path.extension().unwrap_or_default();
        if path.is_dir() {
            collect(&path, files);
        } else if extension == "glb" || extension == "gltf" {
            files.push(path);
        }
    }
}

/// How many primitives fail.
fn report(title: &str, import: &Import, config: &BakeConfig) -> usize {
    let started = Instant::now();
    let primitives = import.primitives.par_iter();
    let lines = primitives.map(|primitive| {
        let triangles = primitive.mesh.triangle_count();
        let place = format!(
            "{}/{}",
            primitive.place.mesh_index, primitive.place.primitive_index
        );
        let (hierarchy, report) = match bake_mesh_with_report(&primitive.mesh, config) {
            Ok(baked) => baked,
            Err(error) => return Err(format!("  {place}, {triangles} triangles: {error}")),
        };
        match verify(&primitive.mesh, &hierarchy, &VerifySettings::default()) {
            Ok(verified) => Ok((triangles, report.coarsest_triangles, verified)),
            Err(error) => Err(format!("  {place}, {triangles} triangles: {error}")),
        }
    });
    let lines: Vec<Result<_, String>> = lines.collect();
    let (mut triangles, mut coarsest, mut worst, mut flipped) = (0, 0, 0.0f32, 0.0f32);
    for line in &lines {
        match line {
            Ok((of_source, left, verified)) => {
                triangles += of_source;
                coarsest += left;
                worst = worst.max(verified.source_to_simplified);
                worst = worst.max(verified.simplified_to_source);
                flipped = flipped.max(verified.flipped_area);
            }
            Err(line) => println!("{line}"),
        }
    }
    let failures = lines.iter().filter(|line| line.is_err()).count();
    println!(
        "{title}: {failures} of {} fail; {triangles} triangles to {coarsest}, {worst:.3} of what is \
         stated, {flipped:.4} flipped, {:.1} s",
        lines.len(),
        started.elapsed().as_secs_f32()
    );
    failures
}
