//! Speed of a whole bake, compared with clusterlod alone.
//!
//! `cargo bench -p fieldlod_bake --bench bake` measures generated meshes and one mesh with other presets.
//! `FIELDLOD_MODELS` names a folder of glTF files, whose largest primitives are added. `-- NAME` selects meshes by
//! name. The table shows millions of triangles per second: thread time for one thread, elapsed time for two.

mod common;

use std::time::Instant;

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, bare_clusterlod, fixtures};

use common::{models, seconds_on_core};

const RUNS: usize = 5;
/// Smaller meshes are too fast to be timed.
const FEWEST_TRIANGLES: usize = 10_000;

fn main() {
    println!(
        "{:<24} {:>9}  {:>7} {:>7} {:>6}  {:>7} {:>6}",
        "mesh", "triangles", "bare", "1 core", "ratio", "2 cores", "ratio"
    );
    // Cargo adds `--bench` to the arguments.
    let wanted = std::env::args()
        .skip(1)
        .find(|argument| !argument.starts_with("--"));
    let wanted = wanted.unwrap_or_default();
    for (name, mesh) in meshes()
        .into_iter()
        .filter(|(name, _)| name.contains(&wanted))
    {
        report(&name, &mesh, &BakeConfig::default());
    }
    let presets = [
        ("rock, fine", BakeConfig::fine_grained()),
        ("rock, max quality", BakeConfig::max_quality()),
    ];
    let rock = fixtures::rock(6, 1);
    for (name, config) in presets.iter().filter(|(name, _)| name.contains(&wanted)) {
        report(name, &rock, config);
    }
}

fn meshes() -> Vec<(String, SourceMesh)> {
    let mut meshes = vec![
        ("rock".into(), fixtures::rock(7, 1)),
        ("torus knot".into(), fixtures::torus_knot(2_000, 50)),
        ("height field".into(), fixtures::height_field(400)),
    ];
    let models = models().into_iter();
    meshes.extend(models.filter(|(_, mesh)| mesh.triangle_count() >= FEWEST_TRIANGLES));
    meshes
}

fn report(name: &str, mesh: &SourceMesh, config: &BakeConfig) {
    let hierarchy = bake_mesh(mesh, config).expect("the mesh is valid");
    assert_eq!(hierarchy.validate(), Ok(()));
    let triangles = mesh.triangle_count() as f64 * 1e-6;
    let bare_run = || assert!(bare_clusterlod(mesh, config) > 0);
    let whole_run = || assert!(bake_mesh(mesh, config).is_ok());
    let bare = triangles / shortest(1, bare_run);
    let one = triangles / shortest(1, whole_run);
    let two = triangles / shortest(2, whole_run);
    println!(
        "{name:<24} {:>9}  {bare:>7.3} {one:>7.3} {:>6.2}  {two:>7.3} {:>6.2}",
        mesh.triangle_count(),
        one / bare,
        two / bare,
    );
}

/// Seconds of the fastest run.
fn shortest(threads: usize, run: impl Fn() + Sync) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.expect("could not create the thread pool");
    let time = |_| {
        pool.install(|| {
            let started = (Instant::now(), seconds_on_core());
            run();
            match (threads, started.1, seconds_on_core()) {
                (1, Some(before), Some(after)) => after - before,
                _ => started.0.elapsed().as_secs_f64(),
            }
        })
    };
    (0..RUNS).map(time).fold(f64::INFINITY, f64::min)
}
