//! How a whole bake, measuring included, compares with clusterlod alone on the same mesh.
//!
//! `cargo bench -p fieldlod_bake` for generated meshes; with the folder of some glTF files in
//! `FIELDLOD_MODELS`, for the largest primitive of each as well; `-- NAME` for those with that in
//! their name only. Triangles per second of the process's own time on one thread, and of elapsed
//! time on two.

use std::path::Path;
use std::time::Instant;

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, bare_clusterlod, fixtures, import_gltf};

const RUNS: usize = 5;
/// What takes no time cannot be timed.
const FEWEST_TRIANGLES: usize = 10_000;

fn main() {
    let config = BakeConfig::default();
    println!(
        "{:<24} {:>9}  {:>7} {:>7} {:>6}  {:>7} {:>6}",
        "mesh", "triangles", "bare", "1 core", "ratio", "2 cores", "ratio"
    );
    // Cargo adds `--bench` of its own.
    let wanted = std::env::args()
        .skip(1)
        .find(|argument| !argument.starts_with("--"));
    let wanted = wanted.unwrap_or_default();
    for (name, mesh) in meshes()
        .into_iter()
        .filter(|(name, _)| name.contains(&wanted))
    {
        report(&name, &mesh, &config);
    }
}

fn meshes() -> Vec<(String, SourceMesh)> {
    let mut meshes = vec![
        ("rock".into(), fixtures::rock(7, 1)),
        ("torus knot".into(), fixtures::torus_knot(2_000, 50)),
        ("height field".into(), fixtures::height_field(400)),
    ];
    if let Some(folder) = std::env::var_os("FIELDLOD_MODELS") {
        meshes.extend(models(Path::new(&folder)));
    }
    meshes
}

/// The largest primitive of each glTF file in `folder`.
fn models(folder: &Path) -> Vec<(String, SourceMesh)> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let largest = |path: &Path| {
        let primitives = import_gltf(path).ok()?.primitives;
        let largest = primitives
            .into_iter()
            .max_by_key(|p| p.mesh.triangle_count())?;
        let name = path.file_stem()?.to_string_lossy().into_owned();
        Some((name, largest.mesh))
    };
    let all = paths.iter().filter_map(|path| largest(path));
    all.filter(|(_, mesh)| mesh.triangle_count() >= FEWEST_TRIANGLES)
        .collect()
}

fn report(name: &str, mesh: &SourceMesh, config: &BakeConfig) {
    let hierarchy = bake_mesh(mesh, config).expect("the mesh is sound");
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

/// Seconds of the quickest of some runs.
fn shortest(threads: usize, run: impl Fn() + Sync) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.expect("threads can be started");
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

/// How long this thread has run on a core, as Linux counts it: the time of others is left out.
fn seconds_on_core() -> Option<f64> {
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(times.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
}
