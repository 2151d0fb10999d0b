//! The cache of bakes.

use std::fs;
use std::path::{Path, PathBuf};

use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::LodOrigin;
use bevy_fieldlod::prelude::*;
use fieldlod_hierarchy::BakedFile;

use crate::headless::{
    add, app, logged, logged_times, minimal_app, origins, progress, ready, rock, run_until,
    spawn_object,
};

/// The origin of the levels of a rock in an app with this cache.
fn run(folder: &Path, seed: u32) -> LodOrigin {
    run_mesh(folder, rock(4, seed))
}

fn run_mesh(folder: &Path, mesh: Mesh) -> LodOrigin {
    let mut app = app();
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.cache_folder = Some(folder.into());
    spawn_object(&mut app, mesh);
    ready(&mut app, 1);
    let origins = origins(&app);
    assert_eq!(origins.len(), 1);
    origins[0]
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn second_run_reads_cache() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("not/there/yet");
    assert_eq!(run(&cache, 1), LodOrigin::Baked);
    assert_eq!(run(&cache, 1), LodOrigin::Cache);
    let entries = entries(&cache);
    assert_eq!(entries.len(), 1, "a partial file is left");
    assert!(BakedFile::from_bytes(&fs::read(&entries[0]).unwrap()).is_ok());
}

#[test]
fn another_attribute_is_another_entry() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = rock(4, 1);
    let count = mesh.count_vertices();
    let colored = mesh
        .clone()
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, vec![[1.0f32; 4]; count]);
    let windy = mesh
        .clone()
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[1.0f32; 4]; count]);
    for mesh in [mesh, colored, windy] {
        assert_eq!(run_mesh(folder.path(), mesh.clone()), LodOrigin::Baked);
        assert_eq!(run_mesh(folder.path(), mesh), LodOrigin::Cache);
    }
    assert_eq!(entries(folder.path()).len(), 3);
}

#[test]
fn broken_entry_is_logged_and_baked_again() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(run(folder.path(), 1), LodOrigin::Baked);
    let entry = entries(folder.path()).remove(0);
    let mut bytes = fs::read(&entry).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&entry, bytes).unwrap();
    assert_eq!(run(folder.path(), 1), LodOrigin::Baked);
    let name = entry.file_name().unwrap().to_str().unwrap();
    assert!(logged(Level::WARN, &[name, "could not read"]));
    assert_eq!(run(folder.path(), 1), LodOrigin::Cache);
}

#[test]
fn unwritable_cache_is_logged() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a-file");
    fs::write(&file, "").unwrap();
    assert_eq!(run(&file, 1), LodOrigin::Baked);
    assert!(logged(Level::WARN, &["a-file", "could not write"]));
}

/// A limit of 16 kB per file stands for a full disk.
#[cfg(unix)]
#[test]
fn full_disk_is_logged() {
    const FOLDER: &str = "FIELDLOD_TEST_FULL_DISK";
    if let Some(folder) = std::env::var_os(FOLDER) {
        let folder = Path::new(&folder);
        assert_eq!(run(folder, 1), LodOrigin::Baked);
        assert!(logged(Level::WARN, &["fieldlod", "could not write"]));
        assert!(entries(folder).is_empty(), "{:?}", entries(folder));
        return;
    }
    // The limit applies to a process, so the test runs again in another one.
    let folder = tempfile::tempdir().unwrap();
    let limited = "trap '' XFSZ; ulimit -f 32; exec \"$@\"";
    let test = "baking::cache::full_disk_is_logged";
    let ran = std::process::Command::new("sh")
        .args(["-c", limited, "sh"])
        .arg(std::env::current_exe().unwrap())
        .args([test, "--exact", "--nocapture"])
        .env(FOLDER, folder.path())
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success() && text.contains("1 passed"), "{ran:?}");
}

#[test]
fn disabled_bake_reads_cache_only() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(run(folder.path(), 1), LodOrigin::Baked);
    let mut app = app();
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.cache_folder = Some(folder.path().into());
    config.bake_at_run_time = false;
    spawn_object(&mut app, rock(4, 1));
    spawn_object(&mut app, rock(4, 2));
    run_until(&mut app, "one is ready and one has failed", |app| {
        (progress(app).ready, progress(app).plain) == (1, 1)
    });
    assert_eq!(origins(&app), [LodOrigin::Cache]);
    assert!(logged(Level::ERROR, &["not baked at run time"]));
}

/// After a menu was closed, the game keeps the handle. Levels are dropped if the cache has them.
#[test]
fn unused_levels_are_dropped_if_cached() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("no-folder");
    fs::write(&file, "").unwrap();
    let caches = [Some(folder.path().join("bakes")), None, Some(file)];
    for (cache, is_cached) in caches.into_iter().zip([true, false, false]) {
        let mut app = minimal_app();
        let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
        config.cache_folder = cache;
        app.update();
        let bare = app.world().resource::<Assets<Mesh>>().len();
        let mesh = add(&mut app, rock(4, 1));
        let shown = (Mesh3d(mesh.clone()), AutoLod::default());
        let entity = app.world_mut().spawn(shown.clone()).id();
        ready(&mut app, 1);
        // Levels that are unused at two checks are dropped. A check runs every 600 frames.
        let meshes_later = |app: &mut App| {
            (0..1_250).for_each(|_| app.update());
            app.world().resource::<Assets<Mesh>>().len()
        };
        let all = meshes_later(&mut app);
        assert!(all > bare + 3, "{all}");
        app.world_mut().despawn(entity);
        let expected = if is_cached { bare + 1 } else { all };
        assert_eq!(meshes_later(&mut app), expected);
        app.world_mut().spawn(shown);
        ready(&mut app, 1);
        assert_eq!(app.world().resource::<Assets<Mesh>>().len(), all);
        assert_eq!(origins(&app).len(), 1 + usize::from(is_cached));
    }
    assert_eq!(logged_times(Level::WARN, &["no-folder"]), 1);
}
