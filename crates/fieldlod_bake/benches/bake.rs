//! Speed of bakes.
//!
//! `cargo bench -p fieldlod_bake --bench bake` measures generated meshes of each kind. `FIELDLOD_MODELS` names a folder
//! of glTF files, which are added. `-- NAME` selects by name. The table shows thousands of triangles per second on one
//! core: clusterlod alone, levels without measurements, with pictures, and with deviations. A game bakes with pictures; a
//! file has deviations. The last column is the speedup of two cores.

mod common;

use std::time::Instant;

use fieldlod_bake::{
    BakeConfig, Import, SourceMesh, bake_import, bake_mesh, bare_clusterlod, fixtures,
};

use common::{files, seconds_on_core};

const RUNS: usize = 3;
/// Smaller files are too fast to be timed.
const FEWEST_TRIANGLES: usize = 3_000;

enum Subject {
    Mesh(SourceMesh),
    File(Import),
}

impl Subject {
    fn triangles(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.triangle_count(),
            Self::File(file) => file
                .primitives
                .iter()
                .map(|p| p.mesh.triangle_count())
                .sum(),
        }
    }

    fn bake(&self, config: &BakeConfig) {
        match self {
            Self::Mesh(mesh) => assert!(bake_mesh(mesh, config).is_ok()),
            Self::File(file) => assert!(bake_import(file.clone(), config, &|_| ()).is_ok()),
        }
    }

    /// Thousands of triangles per second of clusterlod alone; `None` for a file.
    fn bare(&self, config: &BakeConfig) -> Option<f64> {
        match self {
            Self::Mesh(mesh) => Some(self.rate(1, || assert!(bare_clusterlod(mesh, config) > 0))),
            Self::File(_) => None,
        }
    }

    /// Thousands of triangles per second of the fastest run.
    fn rate(&self, threads: usize, run: impl Fn() + Sync) -> f64 {
        self.triangles() as f64 * 1e-3 / shortest(threads, run)
    }
}

fn main() {
    println!(
        "{:<28} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "mesh", "triangles", "bare", "levels", "pictures", "all", "2 cores"
    );
    // Cargo adds `--bench` to the arguments.
    let mut arguments = std::env::args().skip(1);
    let wanted = arguments.find(|argument| !argument.starts_with("--"));
    let wanted = wanted.unwrap_or_default();
    let files = files().into_iter();
    let files = files.map(|(name, file)| (name, Subject::File(file)));
    let is_timed = |(_, file): &(String, Subject)| file.triangles() >= FEWEST_TRIANGLES;
    let subjects = meshes().into_iter().chain(files.filter(is_timed));
    for (name, subject) in subjects.filter(|(name, _)| name.contains(&wanted)) {
        report(&name, &subject);
    }
}

fn meshes() -> Vec<(String, Subject)> {
    let meshes = [
        ("scan: rock", fixtures::rock(7, 1)),
        ("scan: height field", fixtures::height_field(400)),
        ("prop: torus knot", fixtures::torus_knot(300, 25)),
        ("prop: machine", fixtures::machine(8)),
        ("plant: crown", fixtures::crown(4_000, 1)),
    ];
    let meshes = meshes.into_iter();
    meshes
        .map(|(name, mesh)| (name.into(), Subject::Mesh(mesh)))
        .collect()
}

fn report(name: &str, subject: &Subject) {
    let all = BakeConfig::default();
    let pictures = BakeConfig {
        measure_deviation: false,
        ..all.clone()
    };
    let configs = [&BakeConfig::fast(), &pictures, &all];
    let [levels, pictures, with_all] =
        configs.map(|config| subject.rate(1, || subject.bake(config)));
    let two = subject.rate(2, || subject.bake(&all));
    let bare = subject.bare(&all);
    let bare = bare.map_or_else(|| "–".into(), |rate| format!("{rate:.1}"));
    println!(
        "{name:<28} {:>9} {bare:>8} {levels:>8.1} {pictures:>8.1} {with_all:>8.1} {:>8.2}",
        subject.triangles(),
        two / with_all,
    );
}

/// Seconds of the fastest run: thread time for one thread, elapsed time for more.
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
