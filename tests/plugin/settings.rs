//! Settings of cameras, of `AutoLod` and of bakes.

use bevy::asset::RenderAssetUsages;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{BakeConfig, LodUnit};

use crate::headless::{
    add, app, before_a_camera, insert, levels, ready, rock, spawn_camera, spawn_rock, stats, units,
    visible,
};

fn settings(app: &mut App, camera: Entity, settings: FieldLodCamera) {
    insert(app, camera, settings);
    app.update();
}

fn spawn_sun(app: &mut App) {
    let sun = DirectionalLight {
        shadow_maps_enabled: true,
        ..default()
    };
    let low = Transform::default().looking_to(Vec3::new(-1.0, -1.0, 0.0), Vec3::Y);
    app.world_mut().spawn((sun, low));
}

#[test]
fn view_draws_forced_level() {
    for subdivisions in [4, 6] {
        let (mut app, near, rock) = before_a_camera(subdivisions, 3.0);
        let far = spawn_camera(&mut app, 300.0);
        for camera in [near, far] {
            let forced = FieldLodCamera::at_level(1);
            settings(&mut app, camera, forced);
        }
        app.update();
        assert_eq!(levels(&mut app, rock, far), Some(1..=1));
        // Level 0 of a view is the source.
        let full = FieldLodCamera::at_level(0);
        settings(&mut app, far, full);
        app.update();
        assert_eq!(visible(&app, far), [rock]);
        assert_eq!(levels(&mut app, rock, far), Some(0..=0));
        let drawn = stats(&app, far);
        assert_eq!(drawn.triangles_drawn, drawn.triangles_full);
    }
}

#[test]
fn lod_levels_reports_drawn_levels() {
    let (mut app, near, rock) = before_a_camera(6, 3.0);
    let far = spawn_camera(&mut app, 300.0);
    let plain = spawn_rock(&mut app, 1);
    app.update();
    app.update();
    let [fine, coarse] = [near, far].map(|camera| levels(&mut app, rock, camera).unwrap());
    assert_eq!(*fine.start(), 0);
    assert!(fine.end() < coarse.start(), "{fine:?} {coarse:?}");
    assert_eq!(levels(&mut app, plain, near), None);
    insert(&mut app, rock, Visibility::Hidden);
    app.update();
    assert_eq!(levels(&mut app, rock, near), None);
}

#[test]
fn auto_lod_overrides_bake_settings() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 3.0);
    let source = add(&mut app, rock(6, 1));
    let mut spawn = |bake: Option<BakeConfig>| {
        let auto_lod = AutoLod { bake, ..default() };
        let bundle = (Mesh3d(source.clone()), auto_lod);
        app.world_mut().spawn(bundle).id()
    };
    let [default, fine] = [None, Some(BakeConfig::fine_grained())].map(&mut spawn);
    ready(&mut app, 2);
    app.update();
    let count = |app: &mut App, object: Entity| {
        let units = units(app).into_iter();
        let of = |unit: &Entity| app.world().get::<LodUnit>(*unit).unwrap().object == object;
        units.filter(of).count()
    };
    let [large, small] = [default, fine].map(|object| count(&mut app, object));
    assert!(large > 0 && small > 2 * large, "{large} {small}");
    // Another setting has it baked anew.
    let auto_lod = AutoLod {
        bake: Some(BakeConfig::fine_grained()),
        ..Default::default()
    };
    insert(&mut app, default, auto_lod);
    app.update();
    ready(&mut app, 2);
    app.update();
    assert_eq!(count(&mut app, default), small);
    assert!(!visible(&app, camera).is_empty());
}

#[test]
fn shadow_bias_controls_offscreen_casters() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 10.0);
    spawn_sun(&mut app);
    let rock = spawn_rock(&mut app, 6);
    // Out of the image to the right, towards the sun.
    insert(&mut app, rock, Transform::from_xyz(22.0, 12.0, 0.0));
    ready(&mut app, 1);
    let finest_at = |app: &mut App, shadow_bias: f32| {
        let biased = FieldLodCamera {
            shadow_bias,
            ..default()
        };
        settings(app, camera, biased);
        *levels(app, rock, camera).unwrap().start()
    };
    let levels = [1.0, 0.3, 0.0].map(|bias| finest_at(&mut app, bias));
    assert!(
        levels.is_sorted() && levels[0] < levels[1] && levels[1] < levels[2],
        "{levels:?}"
    );
    // What is seen is drawn as before.
    insert(&mut app, rock, Transform::default());
    assert_eq!(finest_at(&mut app, 0.3), finest_at(&mut app, 1.0));
}

#[test]
fn main_world_source_is_drawn_by_levels() {
    for subdivisions in [4, 6] {
        let mut app = app();
        let camera = spawn_camera(&mut app, 3.0);
        let mut mesh = rock(subdivisions, 1);
        mesh.asset_usage = RenderAssetUsages::MAIN_WORLD;
        let source = add(&mut app, mesh);
        let bundle = (Mesh3d(source.clone()), AutoLod::default());
        let object = app.world_mut().spawn(bundle).id();
        ready(&mut app, 1);
        app.update();
        let world = app.world();
        assert_eq!(world.get::<Mesh3d>(object).unwrap().0, source);
        let drawn = visible(&app, camera);
        assert!(!drawn.is_empty());
        let of_units = |drawn: &Entity| world.entity(*drawn).contains::<LodUnit>();
        for drawn in drawn.into_iter().filter(of_units) {
            let mesh = world.get::<Mesh3d>(drawn).unwrap();
            let usage = world
                .resource::<Assets<Mesh>>()
                .get(mesh)
                .unwrap()
                .asset_usage;
            assert!(usage.contains(RenderAssetUsages::RENDER_WORLD));
        }
    }
}

/// Threads of a name, each with its niceness.
#[cfg(target_os = "linux")]
fn niceness_of_threads(name: &str) -> Vec<i32> {
    let tasks = std::fs::read_dir("/proc/self/task").unwrap();
    let stats =
        tasks.filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("stat")).ok());
    let niceness = |stat: String| {
        let (before, after) = stat.split_once(')')?;
        // The seventeenth after the name.
        let niceness = after.split_whitespace().nth(16)?.parse().ok()?;
        before.contains(name).then_some(niceness)
    };
    stats.filter_map(niceness).collect()
}

#[test]
#[cfg(target_os = "linux")]
fn bake_threads_have_low_priority() {
    let mut app = app();
    spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    let bakes = niceness_of_threads("FieldLod");
    assert!(
        !bakes.is_empty() && bakes.iter().all(|&nice| nice == 10),
        "{bakes:?}"
    );
    assert!(niceness_of_threads("").iter().any(|&nice| nice < 10));
}
