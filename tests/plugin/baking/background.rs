//! Bakes in the background do not disturb the game.

use std::sync::mpsc::channel;

use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy::tasks::AsyncComputeTaskPool;
use bevy_fieldlod::prelude::*;

use crate::headless::{
    add, app, app_without_cache, insert, level, logged, origins, progress, ready, rock, run_until,
    spawn_camera, spawn_object, spawn_rock, visible,
};

#[test]
fn bakes_do_not_block_async_compute_tasks() {
    let mut app = app_without_cache();
    for seed in 0..30 {
        spawn_object(&mut app, rock(5, seed));
    }
    app.update();
    app.update();
    assert!(progress(&app).baking > 0);
    let task = AsyncComputeTaskPool::get().spawn(async {});
    run_until(&mut app, "the task is complete", |_| task.is_finished());
    assert!(progress(&app).ready < 15, "{:?}", progress(&app));
}

#[test]
fn bakes_do_not_use_global_rayon_pool() {
    let (sender, receiver) = channel::<()>();
    let receiver = std::sync::Mutex::new(receiver);
    std::thread::scope(|scope| {
        // All threads of the global pool are blocked until the bake is done.
        scope.spawn(|| {
            rayon::broadcast(|_| {
                let _ = receiver.lock().unwrap().recv();
            });
        });
        let mut app = app_without_cache();
        spawn_rock(&mut app, 4);
        ready(&mut app, 1);
        drop(sender);
    });
}

#[test]
fn changing_mesh_draws_its_source() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 300.0);
    let source = add(&mut app, rock(4, 1));
    let bundle = (Mesh3d(source.clone()), AutoLod::default());
    let water = app.world_mut().spawn(bundle.clone()).id();
    app.world_mut().spawn(bundle);
    ready(&mut app, 2);
    assert!(level(&mut app, water, camera) > Some(0));
    let wave = |app: &mut App| {
        let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
        let water = meshes.get(&source).unwrap().clone();
        let lower = water.scaled_by(Vec3::new(1.0, 0.999, 1.0));
        meshes.insert(&source, lower).unwrap();
        app.update();
    };
    wave(&mut app);
    for _ in 0..100 {
        wave(&mut app);
        assert_eq!(level(&mut app, water, camera), None);
        assert_eq!(visible(&app, camera).len(), 2);
        let progress = progress(&app);
        let counts = (
            progress.plain,
            progress.waiting,
            progress.baking,
            progress.ready,
        );
        assert_eq!(counts, (2, 0, 0, 0));
    }
    let id = source.id().to_string();
    assert!(logged(Level::INFO, &[&id, "changes every few frames"]));
    assert_eq!(origins(&app).len(), 1);
    // After a while without changes, the mesh has levels again.
    ready(&mut app, 2);
    assert!(level(&mut app, water, camera) > Some(0));
    assert_eq!(origins(&app).len(), 2);
}

/// As where a game loads a scene and an animation of a file by their labels.
#[test]
fn equal_mesh_keeps_its_levels() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 300.0);
    let source = add(&mut app, rock(4, 1));
    let rock = app
        .world_mut()
        .spawn((Mesh3d(source.clone()), AutoLod::default()));
    let rock = rock.id();
    let load = |app: &mut App, change: fn(Mesh) -> Mesh| {
        let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
        let loaded = change(meshes.get(&source).unwrap().clone());
        meshes.insert(&source, loaded).unwrap();
        (0..3).for_each(|_| app.update());
    };
    app.update();
    // During the bake, and after it.
    load(&mut app, |mesh| mesh);
    ready(&mut app, 1);
    let drawn = level(&mut app, rock, camera);
    assert!(drawn > Some(0));
    load(&mut app, |mesh| mesh);
    assert_eq!(level(&mut app, rock, camera), drawn);
    assert_eq!(origins(&app).len(), 1);
    load(&mut app, |mesh| mesh.translated_by(Vec3::X));
    assert_eq!(level(&mut app, rock, camera), None);
}

/// The new request reads the changed mesh before Bevy reports the change.
#[test]
fn new_request_does_not_hide_a_change() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 300.0);
    let source = add(&mut app, rock(4, 1));
    let spawn = |app: &mut App, kind| {
        let bundle = (Mesh3d(source.clone()), AutoLod::of_kind(kind));
        app.world_mut().spawn(bundle).id()
    };
    let rock = spawn(&mut app, LodKind::WholeMesh);
    ready(&mut app, 1);
    assert!(level(&mut app, rock, camera) > Some(0));
    spawn(&mut app, LodKind::Clusters);
    app.update();
    let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
    let moved = meshes.get(&source).unwrap().clone();
    meshes
        .insert(&source, moved.translated_by(Vec3::X))
        .unwrap();
    (0..3).for_each(|_| app.update());
    assert_eq!(level(&mut app, rock, camera), None);
}

#[test]
fn largest_mesh_on_screen_is_prepared_first() {
    let mut app = app_without_cache();
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.advanced.bake_threads = Some(1);
    spawn_camera(&mut app, 3.0);
    // Different meshes: equal ones would share a bake.
    let rocks: Vec<Entity> = [(1, 40.0), (2, 20.0), (3, 0.0), (4, 10.0), (5, 30.0)]
        .map(|(seed, away)| {
            let rock = spawn_object(&mut app, rock(4, seed));
            insert(&mut app, rock, Transform::from_xyz(0.0, 0.0, -away));
            rock
        })
        .into();
    let is_ready = |app: &App, rock: Entity| {
        app.world()
            .entity(rock)
            .get::<LodState>()
            .is_some_and(|state| matches!(state, LodState::Ready(_)))
    };
    run_until(&mut app, "one is ready", |app| progress(app).ready > 0);
    assert!(is_ready(&app, rocks[2]));
}

/// The niceness of each thread with `name` in its name.
#[cfg(target_os = "linux")]
fn niceness_of_threads(name: &str) -> Vec<i32> {
    let tasks = std::fs::read_dir("/proc/self/task").unwrap();
    let stats =
        tasks.filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("stat")).ok());
    let niceness = |stat: String| {
        let (before, after) = stat.split_once(')')?;
        // The field `nice`, the seventeenth after the name (man 5 proc).
        let niceness = after.split_whitespace().nth(16)?.parse().ok()?;
        before.contains(name).then_some(niceness)
    };
    stats.filter_map(niceness).collect()
}

#[test]
#[cfg(target_os = "linux")]
fn bake_threads_have_low_priority() {
    let mut app = app_without_cache();
    spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    let bakes = niceness_of_threads("FieldLod");
    assert!(
        !bakes.is_empty() && bakes.iter().all(|&nice| nice == 10),
        "{bakes:?}"
    );
    assert!(niceness_of_threads("").iter().any(|&nice| nice < 10));
}
