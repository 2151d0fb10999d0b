//! Primitives of one glTF mesh that meet are baked at run time as in a file.

use std::collections::BTreeSet;
use std::iter;

use bevy::prelude::*;
use bevy_fieldlod::LodOrigin;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{BakeConfig, SourceMesh, bake_file, bake_together, fixtures};
use serde_json::json;

use crate::content::scenes::spawn_scene;
use crate::content::surfaces::{baked_entries, entries, entry_of, run_time_config, set_cache};
use crate::gltf_file::GltfFile;
use crate::headless::{app_in, failures, origins, progress, ready};

/// Some triangles of a mesh, with the vertices that they use.
fn part(mesh: &SourceMesh, triangles: impl Iterator<Item = usize>) -> SourceMesh {
    let (all, _) = mesh.indices.as_chunks::<3>();
    let corners: Vec<u32> = triangles.flat_map(|triangle| all[triangle]).collect();
    let used: Vec<u32> = corners
        .iter()
        .copied()
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    let place = |v: &u32| used.binary_search(v).unwrap() as u32;
    SourceMesh {
        vertices: mesh.vertices.at(&used),
        indices: corners.iter().map(place).collect(),
        ..SourceMesh::default()
    }
}

/// A file with one scene: a glTF mesh with these primitives.
fn file_of(parts: &[SourceMesh]) -> GltfFile {
    let mut file = GltfFile::empty();
    parts.iter().for_each(|part| file.add_mesh(part));
    file.join_meshes();
    file.json["nodes"] = json!([{ "mesh": 0 }]);
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    file
}

/// Stripes of a field; the first has `first` triangles.
fn stripes(cells: u32, first: usize, count: usize) -> Vec<SourceMesh> {
    let field = fixtures::height_field(cells);
    let rest = field.triangle_count() - first;
    let start = |index: usize| first + rest * index / count;
    let ranges = (0..count).map(|index| start(index)..start(index + 1));
    let ranges = iter::once(0..first).chain(ranges);
    ranges.map(|range| part(&field, range)).collect()
}

/// Two primitives that meet at too many vertices to keep all of them at all levels.
fn spots() -> Vec<SourceMesh> {
    let field = fixtures::height_field(128);
    let is_second = |triangle: usize| {
        let at = field.positions[field.indices[3 * triangle] as usize];
        (at.x * 30.0).sin() * (at.z * 30.0).sin() > 0.3
    };
    let all = 0..field.triangle_count();
    [false, true]
        .map(|second| part(&field, all.clone().filter(|t| is_second(*t) == second)))
        .to_vec()
}

#[test]
fn run_time_bake_equals_bake_of_file() {
    let whole = LodKind::WholeMesh;
    for (parts, kinds) in [
        // One is too small to have levels of its own.
        (stripes(64, 60, 5), [whole].as_slice()),
        // Small and large.
        (stripes(150, 5000, 2), &[whole, LodKind::Clusters]),
        // Small and large, which change levels together.
        (spots(), &[whole]),
    ] {
        let mut file = file_of(&parts);
        let baked = baked_entries(&file.glb());
        let mut app = app_in(file.folder());
        let cache = set_cache(&mut app, file.folder());
        spawn_scene(&mut app, None);
        ready(&mut app, parts.len() as u32);
        let mut found = entries(&cache);
        found.sort();
        assert!(found == baked);
        let mut states = app.world_mut().query::<&LodState>();
        let states: Vec<LodState> = states.iter(app.world()).copied().collect();
        for kind in [whole, LodKind::Clusters] {
            let has_kind = states.contains(&LodState::Ready(kind));
            assert_eq!(has_kind, kinds.contains(&kind), "{states:?}");
        }
    }
}

#[test]
fn other_primitives_use_file_if_one_is_faulty() {
    let mut parts = stripes(32, 500, 2);
    parts[1].positions.fill(Vec3::NAN);
    let mut file = file_of(&parts);
    let outcome = bake_file(&file.glb(), &BakeConfig::default(), &|_| ()).unwrap();
    assert_eq!(outcome.skipped.len(), 1);
    file.write("mesh.fieldlod", &outcome.file.to_bytes());
    let mut app = app_in(file.folder());
    spawn_scene(&mut app, None);
    ready(&mut app, 2);
    assert_eq!(origins(&app), [LodOrigin::BesideAsset; 2]);
    assert_eq!(failures(&app).len(), 1);
}

/// Drawn in units, the primitives keep the vertices where they meet; as whole meshes, they change levels together.
#[test]
fn cache_distinguishes_kinds_of_primitives() {
    let parts = stripes(150, 5000, 2);
    let mut file = file_of(&parts);
    file.glb();
    let mut app = app_in(file.folder());
    let cache = set_cache(&mut app, file.folder());
    spawn_scene(&mut app, None);
    ready(&mut app, 3);
    assert_eq!(entries(&cache).len(), 3);
    let mut roots = app.world_mut().query::<&mut AutoLod>();
    roots.single_mut(app.world_mut()).unwrap().kind = LodKind::WholeMesh;
    app.update();
    ready(&mut app, 3);
    let meshes: Vec<&SourceMesh> = parts.iter().collect();
    let joined = bake_together(&meshes, &run_time_config());
    let joined = joined.into_iter().map(|baked| entry_of(baked.unwrap().0));
    let found = entries(&cache);
    assert!(found.len() == 6 && joined.into_iter().all(|entry| found.contains(&entry)));
}

/// Primitives of a glTF mesh above `together_below_triangles` are baked alone, and small ones have no levels.
#[test]
fn small_primitive_of_large_gltf_mesh_stays_plain() {
    let mut file = file_of(&stripes(64, 60, 5));
    file.glb();
    let mut app = app_in(file.folder());
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.bake.together_below_triangles = 8000;
    spawn_scene(&mut app, None);
    ready(&mut app, 5);
    assert_eq!(progress(&app).plain, 1);
}
