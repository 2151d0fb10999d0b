//! Peak memory of a bake without its source mesh.
//!
//! `cargo bench -p fieldlod_bake --bench memory` measures generated meshes on Linux. If `FIELDLOD_MODELS` names a
//! folder of glTF files, their largest primitives are added. The resulting hierarchy is counted. Each mesh is baked in
//! its own process, after a small bake that loads the program's code.

use std::path::Path;
use std::process::Command;

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, fixtures, import_gltf};

/// Environment variable that names the mesh of a process.
const ONLY: &str = "FIELDLOD_MEMORY_OF";

fn main() {
    if let Some(name) = std::env::var_os(ONLY) {
        return report(&name.to_string_lossy());
    }
    println!(
        "{:<24} {:>9}  {:>18}",
        "mesh", "triangles", "bytes per triangle"
    );
    let mut names: Vec<String> = ["rock", "torus knot", "height field"]
        .map(String::from)
        .into();
    if let Some(folder) = std::env::var_os("FIELDLOD_MODELS") {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let paths = entries.map(|entry| entry.path().to_string_lossy().into_owned());
        names.extend(paths);
    }
    names[3..].sort();
    let program = std::env::current_exe().expect("the path of this program is known");
    for name in names {
        let status = Command::new(&program).env(ONLY, &name).status();
        assert!(status.is_ok_and(|status| status.success()), "{name}");
    }
}

fn mesh_of(name: &str) -> Option<SourceMesh> {
    Some(match name {
        "rock" => fixtures::rock(7, 1),
        "torus knot" => fixtures::torus_knot(2_000, 50),
        "height field" => fixtures::height_field(400),
        path => {
            let primitives = import_gltf(Path::new(path)).ok()?.primitives;
            let meshes = primitives.into_iter().map(|primitive| primitive.mesh);
            meshes.max_by_key(SourceMesh::triangle_count)?
        }
    })
}

fn report(name: &str) {
    let small = bake_mesh(&fixtures::rock(3, 1), &BakeConfig::default());
    assert!(small.is_ok());
    let at_start = bytes("VmRSS:");
    let Some(mesh) = mesh_of(name) else {
        return;
    };
    // Resets the peak, which includes the creation of the mesh.
    let is_reset = std::fs::write("/proc/self/clear_refs", "5").is_ok();
    let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).expect("the mesh is valid");
    assert_eq!(hierarchy.validate(), Ok(()));
    let stem = Path::new(name).file_stem().unwrap_or_default();
    let (stem, triangles) = (stem.to_string_lossy(), mesh.triangle_count());
    match (at_start, bytes("VmHWM:"), is_reset) {
        (Some(at_start), Some(peak), true) => {
            let own = peak.saturating_sub(at_start + size_of_mesh(&mesh));
            println!("{stem:<24} {triangles:>9}  {:>18}", own / triangles.max(1));
        }
        _ => println!("{stem:<24} not measured: /proc is not available"),
    }
}

fn size_of_mesh(mesh: &SourceMesh) -> usize {
    size_of_val(&mesh.positions[..])
        + size_of_val(&mesh.normals[..])
        + size_of_val(&mesh.uvs[..])
        + size_of_val(&mesh.indices[..])
}

fn bytes(field: &str) -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with(field))?;
    let kilobytes: usize = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1024)
}
