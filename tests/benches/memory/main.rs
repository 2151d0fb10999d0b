//! Memory of levels of detail: bytes per source triangle on the GPU and in main memory, and entities.
//!
//! `cargo bench -p fieldlod_tests --bench memory`. Each case is a process of its own that reads its hierarchies from a
//! cache, so that the memory of the bake is not counted. Resident memory is that of Linux.

#[path = "../process.rs"]
mod process;

use std::path::Path;
use std::process::Command;

use bevy::asset::RenderAssetUsages;
use bevy::prelude::*;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::SourceMesh;
use fieldlod_tests::apps::{bevy_mesh, rendererless_app, run_until_ready, spawn_camera};

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

/// Environment variables of a measuring process: the case, the cache, and whether to measure the source alone.
const CASE: &str = "FIELDLOD_MEMORY_CASE";
const FOLDER: &str = "FIELDLOD_MEMORY_CACHE";
const IS_PLAIN: &str = "FIELDLOD_MEMORY_PLAIN";

fn main() {
    if let (Ok(case), Ok(folder)) = (std::env::var(CASE), std::env::var(FOLDER)) {
        let is_plain = std::env::var_os(IS_PLAIN).is_some();
        let counts = measure(&case, Path::new(&folder), is_plain);
        return println!("{}", serde_json::to_string(&counts).unwrap());
    }
    let folder = tempfile::tempdir().unwrap();
    println!(
        "{:<10}{:>11} | bytes a triangle: {:>8}{:>8}{:>8} | per million: {:>7}{:>10}",
        "", "triangles", "source", "levels", "main", "units", "entities"
    );
    for (case, kind) in CASES {
        // The first run bakes.
        run(case, folder.path(), false);
        let plain = run(case, folder.path(), true);
        let lod = run(case, folder.path(), false);
        print(&format!("{case}, {kind:?}"), plain, lod);
    }
}

/// The numbers of a process: resident bytes, source triangles, source bytes, mesh bytes of the render world alone, mesh
/// bytes of both worlds, meshes, and units.
type Counts = [usize; 7];

fn run(case: &str, folder: &Path, is_plain: bool) -> Counts {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.env(CASE, case).env(FOLDER, folder);
    // The allocator returns freed memory to the system at once.
    command.env("MALLOC_ARENA_MAX", "1");
    command.env("MALLOC_MMAP_THRESHOLD_", "16384");
    if is_plain {
        command.env(IS_PLAIN, "1");
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    serde_json::from_str(text.lines().last().unwrap()).unwrap()
}

fn measure(case: &str, folder: &Path, is_plain: bool) -> Counts {
    let kind = CASES.iter().find(|(name, _)| *name == case).unwrap().1;
    let mut app = rendererless_app();
    app.insert_resource(FieldLodAppConfig {
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
    let bytes_of_usage = |usage| {
        let meshes = meshes.iter().map(|(_, mesh)| mesh);
        let meshes = meshes.filter(|mesh| mesh.asset_usage == usage);
        meshes.map(bytes_of).sum()
    };
    [
        process::number("status", "RssAnon:") as usize * 1024,
        triangles,
        source_bytes,
        bytes_of_usage(RenderAssetUsages::RENDER_WORLD),
        bytes_of_usage(RenderAssetUsages::default()),
        meshes.len(),
        units,
    ]
}

/// Spawns meshes in a row in front of a camera, with levels of detail of `kind` if there is one.
fn spawn(world: &mut World, meshes: Vec<Mesh>, kind: Option<LodKind>) {
    for (index, mesh) in meshes.into_iter().enumerate() {
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        let place = Transform::from_xyz(index as f32 * 3.0, 0.0, 0.0);
        let mut entity = world.spawn((Mesh3d(mesh), place));
        if let Some(kind) = kind {
            entity.insert(AutoLod::of_kind(kind));
        }
    }
    let pose = Transform::from_xyz(0.0, 0.0, 4.0);
    spawn_camera(world, UVec2::new(1920, 1080), pose);
}

fn bytes_of(mesh: &Mesh) -> usize {
    mesh.get_vertex_buffer_size() + mesh.get_index_buffer_bytes().map_or(0, <[u8]>::len)
}

fn print(name: &str, plain: Counts, lod: Counts) {
    let [
        plain_resident,
        plain_triangles,
        _,
        _,
        plain_kept,
        plain_meshes,
        _,
    ] = plain;
    let [resident, triangles, source, gpu_only, kept, meshes, units] = lod;
    assert_eq!(plain_triangles, triangles);
    let pieces = meshes - plain_meshes;
    assert!(pieces > 0, "there are no levels: {lod:?}");
    let each = |bytes: usize| bytes as f64 / triangles as f64;
    let million = |count: usize| count as f64 * 1e6 / triangles as f64;
    // Without a renderer, meshes for the render world alone stay in main memory.
    let beside = resident.saturating_sub(plain_resident + gpu_only);
    println!(
        "{name:<20}{triangles:>10} | {:>27.1}{:>8.1}{:>8.1} | {:>20.0}{:>10.0}",
        each(source),
        each(gpu_only + kept - plain_kept),
        each(beside),
        million(pieces),
        million(units),
    );
}
