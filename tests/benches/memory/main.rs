//! What levels of detail cost in memory: bytes for each source triangle, on the GPU and beside it, and
//! entities.
//!
//! Run with `cargo bench -p fieldlod_tests --bench memory`; figures are in `benches/RECORD.md`. Each
//! case is a process of its own, which finds its hierarchies in a cache, so that what baking needed
//! for a while is not counted; resident memory is that of the system.

use std::path::Path;
use std::process::Command;

use bevy::asset::RenderAssetUsages;
use bevy::prelude::*;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::SourceMesh;
use fieldlod_tests::apps::{bevy_mesh, rendererless_app, run_until_ready, spawn_camera};

/// Names of what is measured.
const CASES: [(&str, LodKind); 3] = [
    ("rock", LodKind::Clusters),
    ("hills", LodKind::Clusters),
    ("16 props", LodKind::WholeMesh),
];

fn meshes_of(case: &str) -> Vec<SourceMesh> {
    match case {
        "rock" => vec![fieldlod_tests::rock(8, 1)],
        "hills" => vec![fieldlod_tests::height_field(512)],
        _ => (0..16).map(|seed| fieldlod_tests::rock(5, seed)).collect(),
    }
}

/// Environment variables that tell a process what to measure.
const CASE: &str = "FIELDLOD_MEMORY_CASE";
const FOLDER: &str = "FIELDLOD_MEMORY_CACHE";
const IS_PLAIN: &str = "FIELDLOD_MEMORY_PLAIN";

fn main() {
    if let (Ok(case), Ok(folder)) = (std::env::var(CASE), std::env::var(FOLDER)) {
        let is_plain = std::env::var_os(IS_PLAIN).is_some();
        return println!("{}", measure(&case, Path::new(&folder), is_plain).to_line());
    }
    let folder = std::env::temp_dir().join(format!("fieldlod-memory-{}", std::process::id()));
    for (case, kind) in CASES {
        // The first run bakes.
        run(case, &folder, false);
        let (plain, lod) = (run(case, &folder, true), run(case, &folder, false));
        report(case, kind, &plain, &lod);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// What a process counts.
#[derive(Debug, PartialEq)]
struct Count {
    resident: usize,
    triangles: usize,
    source_bytes: usize,
    /// Of meshes that a renderer takes over and of those that stay in main memory too.
    gpu_only_bytes: usize,
    kept_bytes: usize,
    meshes: usize,
    units: usize,
}

impl Count {
    fn to_line(&self) -> String {
        let numbers = [
            self.resident,
            self.triangles,
            self.source_bytes,
            self.gpu_only_bytes,
            self.kept_bytes,
            self.meshes,
            self.units,
        ];
        numbers.map(|number| number.to_string()).join(" ")
    }

    fn of_line(line: &str) -> Self {
        let mut numbers = line.split_whitespace().map(|n| n.parse().unwrap());
        let mut next = || numbers.next().unwrap();
        Self {
            resident: next(),
            triangles: next(),
            source_bytes: next(),
            gpu_only_bytes: next(),
            kept_bytes: next(),
            meshes: next(),
            units: next(),
        }
    }
}

fn run(case: &str, folder: &Path, is_plain: bool) -> Count {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.env(CASE, case).env(FOLDER, folder);
    // What is freed goes back to the system at once.
    for (name, value) in [("ARENA_MAX", "1"), ("MMAP_THRESHOLD_", "16384")] {
        command.env(format!("MALLOC_{name}"), value);
    }
    if is_plain {
        command.env(IS_PLAIN, "1");
    }
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{output:?}");
    Count::of_line(text.lines().last().unwrap())
}

fn measure(case: &str, folder: &Path, is_plain: bool) -> Count {
    let kind = CASES.iter().find(|(name, _)| *name == case).unwrap().1;
    let mut app = rendererless_app();
    app.insert_resource(FieldLodConfig {
        cache_folder: Some(folder.into()),
        ..default()
    });
    let sources: Vec<Mesh> = meshes_of(case).iter().map(bevy_mesh).collect();
    let triangles = sources.iter().map(|mesh| mesh.indices().unwrap().len() / 3);
    let triangles = triangles.sum();
    let source_bytes = sources.iter().map(bytes_of).sum();
    let count = sources.len() as u32;
    spawn(app.world_mut(), sources, (!is_plain).then_some(kind));
    run_until_ready(&mut app, if is_plain { 0 } else { count });
    let units = app.world_mut().query::<&LodUnit>().iter(app.world()).len();
    let meshes = app.world().resource::<Assets<Mesh>>();
    let of_usage = |usage| {
        let meshes = meshes.iter().map(|(_, mesh)| mesh);
        meshes.filter(move |mesh| mesh.asset_usage == usage)
    };
    Count {
        resident: resident_bytes(),
        triangles,
        source_bytes,
        gpu_only_bytes: of_usage(RenderAssetUsages::RENDER_WORLD)
            .map(bytes_of)
            .sum(),
        kept_bytes: of_usage(RenderAssetUsages::default())
            .map(bytes_of)
            .sum::<usize>(),
        meshes: meshes.len(),
        units,
    }
}

/// Meshes in a row before a camera, with levels of detail of `kind` if there is one.
fn spawn(world: &mut World, meshes: Vec<Mesh>, kind: Option<LodKind>) {
    for (index, mesh) in meshes.into_iter().enumerate() {
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        let place = Transform::from_xyz(index as f32 * 3.0, 0.0, 0.0);
        let mut entity = world.spawn((Mesh3d(mesh), place));
        if let Some(kind) = kind {
            entity.insert(AutoLod::of_kind(kind));
        }
    }
    spawn_camera(
        world,
        UVec2::new(1920, 1080),
        Transform::from_xyz(0.0, 0.0, 4.0),
    );
}

fn bytes_of(mesh: &Mesh) -> usize {
    mesh.get_vertex_buffer_size() + mesh.get_index_buffer_bytes().map_or(0, <[u8]>::len)
}

/// Pages of 4 KiB that are in memory and not a file's.
fn resident_bytes() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("RssAnon:"));
    let kib = line.and_then(|line| line.split_whitespace().nth(1));
    kib.unwrap().parse::<usize>().unwrap() * 1024
}

fn report(case: &str, kind: LodKind, plain: &Count, lod: &Count) {
    assert_eq!(plain.triangles, lod.triangles);
    assert_eq!(plain.units, 0);
    let pieces = lod.meshes - plain.meshes;
    assert!(pieces > 0, "there are no levels: {lod:?}");
    let each = |bytes: usize| bytes as f64 / lod.triangles as f64;
    let million = |count: usize| count as f64 * 1e6 / lod.triangles as f64;
    let level_bytes = lod.gpu_only_bytes + lod.kept_bytes - plain.kept_bytes;
    // Without a renderer nothing leaves main memory.
    let beside = lod
        .resident
        .saturating_sub(plain.resident + lod.gpu_only_bytes);
    println!(
        "{case} ({kind:?}): {} triangles; GPU: source {:.1}, levels {:.1} bytes a triangle; main memory: \
         {:.1} beyond the source; {:.0} units and {:.0} entities seen by a near camera per million",
        lod.triangles,
        each(lod.source_bytes),
        each(level_bytes),
        each(beside),
        million(pieces),
        million(lod.units),
    );
}
