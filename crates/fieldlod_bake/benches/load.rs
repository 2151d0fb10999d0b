//! Speed of reading a baked file on one core, in megabytes of decoded arrays per second, with checksums and validation.
//! It also prints bytes per source triangle of files with all vertices, and of files that use the vertices of their
//! source. Meshes have positions, normals and first texture coordinates.
//!
//! `cargo bench -p fieldlod_bake --bench load` measures generated meshes. If `FIELDLOD_MODELS` names a folder of glTF
//! files, it measures their largest primitives instead. Times are thread times of the fastest batch. Results are
//! asserted before they are timed.

mod common;

use std::hint::black_box;
use std::time::{Duration, Instant};

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, fixtures};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Group, Hierarchy, Precision, Unit};
use glam::{Vec2, Vec3};

use common::{models, seconds_on_core};

const BATCHES: usize = 5;
/// The clock has a resolution of milliseconds, so many runs are timed together.
const BATCH: Duration = Duration::from_millis(250);

fn main() {
    println!(
        "{:<18} {:>9} {:>10} {:>9} {:>9} {:>9} {:>9}",
        "mesh", "triangles", "attributes", "lossless", "quantized", "lossless", "quantized"
    );
    for (name, mut mesh) in meshes() {
        // Without these attributes, file sizes of different models are comparable.
        mesh.tangents.clear();
        mesh.uvs_1.clear();
        mesh.colors.clear();
        report(&name, &mesh);
    }
}

fn report(name: &str, mesh: &SourceMesh) {
    let hierarchy = bake_mesh(mesh, &BakeConfig::default()).expect("the mesh is valid");
    let triangles = mesh.triangle_count();
    let attributes = match (mesh.normals.is_empty(), mesh.uvs.is_empty()) {
        (false, false) => "P N UV",
        (false, true) => "P N",
        (true, false) => "P UV",
        (true, true) => "P",
    };
    let megabytes = decoded_bytes(&hierarchy) as f64 * 1e-6;
    let primitives = vec![BakedPrimitive::new(0, 0, "mesh", hierarchy)];
    let file = BakedFile { primitives };
    let [lossless, quantized] = [Precision::Lossless, Precision::Quantized16].map(|precision| {
        let bytes = file.to_bytes_with(precision);
        let read = BakedFile::from_bytes(&bytes).expect("the file was just written");
        assert!(precision == Precision::Quantized16 || read == file);
        let seconds = shortest(|| assert!(BakedFile::from_bytes(black_box(&bytes)).is_ok()));
        (bytes.len() as f64 / triangles as f64, megabytes / seconds)
    });
    println!(
        "{name:<18} {triangles:>9} {attributes:>10} {:>9.2} {:>9.2} {:>9.0} {:>9.0}",
        lossless.0, quantized.0, lossless.1, quantized.1
    );
}

/// Seconds per run of the fastest batch.
fn shortest(run: impl Fn()) -> f64 {
    let batch = |_| {
        let (started, core_started) = (Instant::now(), seconds_on_core());
        let mut runs = 0;
        while started.elapsed() < BATCH {
            run();
            runs += 1;
        }
        let seconds = match (core_started, seconds_on_core()) {
            (Some(before), Some(after)) => after - before,
            _ => started.elapsed().as_secs_f64(),
        };
        seconds / f64::from(runs)
    };
    (0..BATCHES).map(batch).fold(f64::INFINITY, f64::min)
}

fn meshes() -> Vec<(String, SourceMesh)> {
    match std::env::var_os("FIELDLOD_MODELS") {
        Some(_) => models(),
        None => vec![
            ("rock".into(), fixtures::rock(7, 1)),
            ("torus knot".into(), fixtures::torus_knot(2_000, 50)),
            ("height field".into(), fixtures::height_field(400)),
            (
                "flat-shaded rock".into(),
                fixtures::rock(6, 1).without_shared_vertices(),
            ),
            ("islands".into(), fixtures::islands(50_000)),
        ],
    }
}

fn decoded_bytes(hierarchy: &Hierarchy) -> usize {
    let vertices = &hierarchy.vertices;
    size_of_val::<[Vec3]>(&vertices.positions)
        + size_of_val::<[Vec3]>(&vertices.normals)
        + size_of_val::<[Vec2]>(&vertices.uvs)
        + size_of_val::<[Group]>(&hierarchy.groups)
        + size_of_val::<[Unit]>(&hierarchy.units)
        + size_of_val::<[u32]>(&hierarchy.finer)
        + size_of_val::<[u32]>(&hierarchy.unit_vertices)
        + size_of_val::<[u16]>(&hierarchy.indices)
}
