//! glTF scenes and their `.fieldlod` files.

use std::path::Path;
use std::sync::LazyLock;

use bevy::gltf::{GltfLoaderSettings, convert_coordinates::GltfConvertCoordinates};
use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::LodOrigin;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{BakeConfig, SourceMesh, bake_file};
use fieldlod_tests::apps::bevy_mesh;
use serde_json::json;

use crate::gltf_file::GltfFile;
use crate::headless::{
    Events, app_in, level, logged, move_camera, origins, progress, ready, run_until, spawn_camera,
};

/// A file with one scene of two rocks: one with colours and texture coordinates in few bits, and a mirrored one with
/// flat normals.
fn two_rocks() -> GltfFile {
    let rock = fieldlod_tests::rock(4, 1);
    let mut file = GltfFile::of(&rock);
    let bytes: Vec<u8> = (0..rock.positions.len() * 4).map(|i| i as u8).collect();
    for (name, component, kind) in [("COLOR_0", 5121, "VEC4"), ("TEXCOORD_0", 5123, "VEC2")] {
        let accessor = file.add_accessor(&bytes, component, kind, rock.positions.len());
        file.list("accessors")[accessor]["normalized"] = json!(true);
        file.primitive()["attributes"][name] = json!(accessor);
    }
    file.add_mesh(&fieldlod_tests::rock(3, 2).without_shared_vertices());
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1, "scale": [1.0, -2.0, 1.0] }]);
    file.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    file
}

/// A file with one scene of one rock.
fn one_rock(subdivisions: u32, seed: u32) -> GltfFile {
    let mut file = GltfFile::of(&fieldlod_tests::rock(subdivisions, seed));
    file.json["nodes"] = json!([{ "mesh": 0 }]);
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    file
}

/// Bark and leaves of a small plant.
fn bark_and_leaves(count: u32) -> [SourceMesh; 2] {
    let mut leaves = fieldlod_tests::cards(count, 2);
    leaves.uvs.clear();
    let bark = fieldlod_tests::rock(3, 1).without_shared_vertices();
    [bark, leaves]
}

/// A file with one scene of one tree: bark and leaves are primitives of one mesh.
fn one_tree() -> GltfFile {
    let [bark, leaves] = bark_and_leaves(600);
    let mut file = GltfFile::of(&bark);
    file.add_mesh(&leaves);
    file.join_meshes();
    file.json["nodes"] = json!([{ "mesh": 0 }]);
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    file
}

/// The `.fieldlod` file of [`one_tree`].
static ONE_TREE: LazyLock<Vec<u8>> = LazyLock::new(|| bake(&one_tree().glb()));

/// Two trees with the same bark and different leaves. The scene has the second tree.
fn second_of_two_trees() -> GltfFile {
    let [bark, leaves] = bark_and_leaves(600);
    let [_, fewer_leaves] = bark_and_leaves(400);
    let mut file = GltfFile::of(&bark);
    file.add_mesh(&leaves);
    file.add_mesh(&fewer_leaves);
    let primitive = |mesh: usize| file.json["meshes"][mesh]["primitives"][0].clone();
    let [bark, leaves, fewer_leaves] = [0, 1, 2].map(primitive);
    file.json["meshes"] = json!([
        { "primitives": [bark, leaves] },
        { "primitives": [bark, fewer_leaves] },
    ]);
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1 }]);
    file.json["scenes"] = json!([{ "nodes": [1] }]);
    file
}

fn bake(glb: &Path) -> Vec<u8> {
    let outcome = bake_file(glb, &BakeConfig::default(), &|_| ()).unwrap();
    assert!(outcome.skipped.is_empty());
    outcome.file.to_bytes()
}

/// Spawns the scene of `mesh.glb`, with the hierarchies of `lods` if there are any.
pub(crate) fn spawn_scene(app: &mut App, lods: Option<&'static str>) {
    let assets = app.world().resource::<AssetServer>();
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("mesh.glb"));
    let auto_lod = match lods {
        Some(path) => AutoLod::from_file(assets.load(path)),
        None => AutoLod::default(),
    };
    app.world_mut().spawn((WorldAssetRoot(scene), auto_lod));
}

#[test]
fn file_matches_meshes_loaded_by_bevy() {
    let mut file = two_rocks();
    let glb = file.glb();
    let bytes = bake(&glb);
    for (name, lods, origin) in [
        ("named.fieldlod", Some("named.fieldlod"), LodOrigin::File),
        ("mesh.fieldlod", None, LodOrigin::BesideAsset),
    ] {
        file.write(name, &bytes);
        let mut app = app_in(file.folder());
        spawn_scene(&mut app, lods);
        ready(&mut app, 2);
        assert_eq!(origins(&app), [origin; 2]);
    }
}

#[test]
fn progress_counts_scenes_that_are_loaded() {
    let mut file = one_rock(4, 1);
    file.glb();
    let mut app = app_in(file.folder());
    for file in ["mesh.glb", "missing.glb"] {
        let assets = app.world().resource::<AssetServer>();
        let scene = assets.load(GltfAssetLabel::Scene(0).from_asset(file));
        let root = (WorldAssetRoot(scene), AutoLod::default());
        app.world_mut().spawn(root);
    }
    app.update();
    assert_eq!(progress(&app).loading, 2);
    let mut last = 0.0;
    run_until(&mut app, "all is done", |app| {
        let progress = progress(app);
        let share = progress.share_done();
        assert!(share >= last, "{share} after {last}");
        last = share;
        // A scene that cannot be loaded counts no longer.
        let is_done = progress.ready == 1 && progress.loading == 0;
        assert_eq!(share == 1.0, is_done, "{progress:?}");
        is_done
    });
}

/// A faulty file that [`AutoLod`] names is an error. A faulty file beside the asset is a warning, and the mesh is
/// baked.
#[test]
fn faulty_files_are_logged() {
    let mut file = two_rocks();
    let stale = bake(&one_rock(4, 10).glb());
    let mut corrupt = bake(&file.glb());
    corrupt[1000] ^= 1;
    for (bytes, fault) in [
        (Some(&stale), "stale"),
        (Some(&corrupt), "checksum"),
        (None, "not found"),
    ] {
        let name: &'static str = match fault {
            "stale" => "stale.fieldlod",
            "checksum" => "corrupt.fieldlod",
            _ => "missing.fieldlod",
        };
        if let Some(bytes) = bytes {
            file.write(name, bytes);
            file.write("mesh.fieldlod", bytes);
        }
        let mut app = app_in(file.folder());
        spawn_scene(&mut app, Some(name));
        run_until(&mut app, "both have failed", |app| progress(app).plain == 2);
        // The asset server logs from another thread.
        run_until(&mut app, "the log has file and fault", |_| {
            logged(Level::ERROR, &[name, fault])
        });
        if bytes.is_some() {
            let mut app = app_in(file.folder());
            spawn_scene(&mut app, None);
            ready(&mut app, 2);
            assert_eq!(origins(&app), [LodOrigin::Baked; 2]);
            assert!(logged(Level::WARN, &["mesh.fieldlod", fault]));
        }
    }
    assert!(logged(Level::WARN, &["mesh.glb#Mesh0/Primitive0", "stale"]));
}

#[test]
fn file_does_not_match_converted_coordinates() {
    let mut file = one_rock(4, 1);
    let glb = file.glb();
    file.write("mesh.fieldlod", &bake(&glb));
    let mut app = app_in(file.folder());
    let assets = app.world().resource::<AssetServer>();
    let path = GltfAssetLabel::Scene(0).from_asset("mesh.glb");
    let turn = |settings: &mut GltfLoaderSettings| {
        settings.convert_coordinates = Some(GltfConvertCoordinates {
            rotate_meshes: true,
            ..default()
        });
    };
    let scene = assets.load_builder().with_settings(turn).load(path);
    app.world_mut()
        .spawn((WorldAssetRoot(scene), AutoLod::default()));
    ready(&mut app, 1);
    assert_eq!(origins(&app), [LodOrigin::Baked]);
}

#[test]
fn reloaded_file_is_applied() {
    let mut file = two_rocks();
    let good = bake(&file.glb());
    let stale = bake(&one_rock(4, 10).glb());
    // The file is truncated, then stale, then good, then good again.
    file.write("lods.fieldlod", &good[..100]);
    let mut app = app_in(file.folder());
    spawn_scene(&mut app, Some("lods.fieldlod"));
    run_until(&mut app, "both have failed", |app| progress(app).plain == 2);
    let reload = |app: &mut App, bytes: &[u8]| {
        file.write("lods.fieldlod", bytes);
        app.world()
            .resource::<AssetServer>()
            .reload("lods.fieldlod");
    };
    let failures = |app: &App| {
        let events = app.world().resource::<Events>().0.iter();
        events
            .filter(|event| matches!(event, FieldLodEvent::Failed { .. }))
            .count()
    };
    let before = failures(&app);
    reload(&mut app, &stale);
    run_until(&mut app, "both have failed again", |app| {
        failures(app) == before + 2 && progress(app).plain == 2
    });
    assert_eq!(origins(&app), []);
    reload(&mut app, &good);
    ready(&mut app, 2);
    assert_eq!(origins(&app), [LodOrigin::File; 2]);
    reload(&mut app, &good);
    run_until(&mut app, "both are read again", |app| {
        origins(app).len() == 4
    });
    ready(&mut app, 2);
}

#[test]
fn repeated_scenes_leak_nothing() {
    let mut file = two_rocks();
    file.glb();
    let mut app = app_in(file.folder());
    spawn_camera(&mut app, 3.0);
    let counts = |app: &mut App| {
        let entities = app.world_mut().query::<Entity>().iter(app.world()).count();
        (entities, app.world().resource::<Assets<Mesh>>().len())
    };
    app.update();
    let empty = app.world().resource::<Assets<Mesh>>().len();
    let assets = app.world().resource::<AssetServer>();
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("mesh.glb"));
    let mut first = None;
    for round in 0..30 {
        let root = (
            WorldAssetRoot(scene.clone()),
            AutoLod::of_kind(LodKind::Clusters),
        );
        let root = app.world_mut().spawn(root).id();
        ready(&mut app, 2);
        app.world_mut().entity_mut(root).despawn();
        app.update();
        app.update();
        assert_eq!(progress(&app), FieldLodProgress::default());
        let now = counts(&mut app);
        assert_eq!(*first.get_or_insert(now), now, "round {round}");
    }
    drop(scene);
    run_until(&mut app, "the meshes are freed with the scene", |app| {
        app.world().resource::<Assets<Mesh>>().len() == empty
    });
}

/// The levels of bark and leaves of a tree while a camera approaches.
fn levels_while_approaching(app: &mut App) -> Vec<[Option<u32>; 2]> {
    let camera = spawn_camera(app, 400.0);
    let parts = parts_of_tree(app).map(|(entity, _)| entity);
    let mut drawn = Vec::new();
    let mut distance = 400.0f32;
    while distance > 4.0 {
        move_camera(app, camera, distance);
        app.update();
        app.update();
        drawn.push(parts.map(|part| level(app, part, camera)));
        distance *= 0.95;
    }
    drawn
}

/// The bark and the leaves of a tree. The bark has more triangles.
fn parts_of_tree(app: &mut App) -> [(Entity, AssetId<Mesh>); 2] {
    let mut parts = app.world_mut().query::<(Entity, &Mesh3d)>();
    let parts = parts.iter(app.world());
    let mut parts: Vec<_> = parts.map(|(entity, mesh)| (entity, mesh.id())).collect();
    let meshes = app.world().resource::<Assets<Mesh>>();
    let triangles = |mesh: AssetId<Mesh>| meshes.get(mesh).unwrap().indices().unwrap().len();
    parts.sort_by_key(|(_, mesh)| std::cmp::Reverse(triangles(*mesh)));
    parts.try_into().unwrap()
}

#[test]
fn bark_and_leaves_change_levels_together() {
    let mut file = one_tree();
    file.glb();
    let cache = tempfile::tempdir().unwrap();
    let approach = |origin: LodOrigin| {
        let mut app = app_in(file.folder());
        let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
        config.cache_folder = Some(cache.path().into());
        spawn_scene(&mut app, None);
        ready(&mut app, 2);
        assert_eq!(origins(&app), [origin; 2]);
        levels_while_approaching(&mut app)
    };
    let baked = approach(LodOrigin::Baked);
    assert_eq!(approach(LodOrigin::Cache), baked);
    // These levels may differ: the file has no material, but a bake at run time reads the default material of
    // Bevy's loader.
    file.write("mesh.fieldlod", &ONE_TREE);
    assert_changes_together(&baked);
    assert_changes_together(&approach(LodOrigin::BesideAsset));
}

/// Checks that bark and leaves change levels in the same steps. Up to four steps may differ, when few leaves remain.
fn assert_changes_together(drawn: &[[Option<u32>; 2]]) {
    let steps = drawn
        .windows(2)
        .map(|pair| [0, 1].map(|part| pair[0][part] != pair[1][part]));
    let changes: Vec<[bool; 2]> = steps.filter(|[bark, leaves]| *bark || *leaves).collect();
    let together = changes
        .iter()
        .filter(|[bark, leaves]| *bark && *leaves)
        .count();
    assert!(together >= 4 && together + 4 >= changes.len(), "{drawn:?}");
}

/// The levels are baked at run time, or come from a file.
#[test]
fn changed_leaves_are_baked_with_bark_again() {
    let mut file = one_tree();
    file.glb();
    let cache = tempfile::tempdir().unwrap();
    for (origin, then) in [
        (LodOrigin::Baked, LodOrigin::Baked),
        (LodOrigin::BesideAsset, LodOrigin::Cache),
    ] {
        if origin == LodOrigin::BesideAsset {
            file.write("mesh.fieldlod", &ONE_TREE);
        }
        let mut app = app_in(file.folder());
        let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
        config.cache_folder = Some(cache.path().into());
        spawn_scene(&mut app, None);
        ready(&mut app, 2);
        assert_eq!(origins(&app), [origin; 2]);
        let [_, (_, leaves)] = parts_of_tree(&mut app);
        let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
        let [_, fewer] = bark_and_leaves(400);
        *meshes.get_mut(leaves).unwrap() = bevy_mesh(&fewer);
        run_until(&mut app, "leaves are baked", |app| origins(app).len() > 2);
        ready(&mut app, 2);
        assert_changes_together(&levels_while_approaching(&mut app));
        assert_eq!(origins(&app)[2..], [then; 2]);
    }
}

#[test]
fn shared_bark_changes_with_leaves_of_each_tree() {
    let mut file = second_of_two_trees();
    let bytes = bake(&file.glb());
    file.write("mesh.fieldlod", &bytes);
    let mut app = app_in(file.folder());
    spawn_scene(&mut app, None);
    ready(&mut app, 2);
    assert_eq!(origins(&app), [LodOrigin::BesideAsset; 2]);
    assert_changes_together(&levels_while_approaching(&mut app));
}
