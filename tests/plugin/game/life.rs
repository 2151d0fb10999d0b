//! Objects are spawned, changed and removed.

use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::BakeConfig;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::soak::open_edges;

use crate::headless::{
    IDLE_FRAMES, add, app, before_a_camera, entity_count, insert, logged, move_camera, progress,
    ready, rock, run_until, spawn_camera, spawn_rock, stats, units, visible,
};

#[test]
fn source_is_drawn_until_levels_are_ready() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 30.0);
    let object = spawn_rock(&mut app, 6);
    app.update();
    let mut frames_in_full = 0;
    run_until(&mut app, "the cut is drawn", |app| {
        let in_full = visible(app, camera) == [object];
        frames_in_full += usize::from(in_full);
        // Either the source or the cut is in the list, never both.
        assert_eq!(in_full, progress(app).ready == 0);
        !in_full
    });
    assert!(frames_in_full > 0);
    let stats = stats(&app, camera);
    assert_eq!(stats.triangles_full, 81_920);
    assert!(
        stats.triangles_drawn * 4 < stats.triangles_full,
        "{stats:?}"
    );
    assert_eq!(visible(&app, camera).len(), stats.units_drawn as usize);
}

#[test]
fn removed_object_leaves_no_units() {
    let removals: [fn(EntityWorldMut); 3] = [
        |entity| entity.despawn(),
        |mut entity| {
            entity.remove::<Mesh3d>();
        },
        |mut entity| {
            entity.remove::<AutoLod>().remove::<Mesh3d>();
        },
    ];
    for subdivisions in [4, 6] {
        let mut app = app();
        let camera = spawn_camera(&mut app, 2.5);
        let before = entity_count(&mut app);
        for removal in removals {
            let object = spawn_rock(&mut app, subdivisions);
            ready(&mut app, 1);
            assert!(!visible(&app, camera).is_empty());
            removal(app.world_mut().entity_mut(object));
            (0..3).for_each(|_| app.update());
            assert_eq!(entity_count(&mut app), before);
            let stats = stats(&app, camera);
            assert_eq!((stats.triangles_full, stats.triangles_drawn), (0, 0));
            assert_eq!(progress(&app), FieldLodProgress::default());
            let left = app.world().get::<LodState>(object);
            assert_eq!(left, None);
        }
    }
}

#[test]
fn instances_share_levels() {
    let mut app = app();
    let first = spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    let meshes = app.world().resource::<Assets<Mesh>>().len();
    let (mesh, material) = {
        let entity = app.world().entity(first);
        let material = entity.get::<MeshMaterial3d<StandardMaterial>>().unwrap();
        (entity.get::<Mesh3d>().unwrap().clone(), material.clone())
    };
    for _ in 0..10 {
        app.world_mut()
            .spawn((mesh.clone(), material.clone(), AutoLod::default()));
    }
    ready(&mut app, 11);
    assert_eq!(app.world().resource::<Assets<Mesh>>().len(), meshes);
}

#[test]
fn replaced_mesh_gets_its_own_levels() {
    let (mut app, camera, object) = before_a_camera(5, 30.0);
    let other = add(&mut app, rock(4, 2));
    insert(&mut app, object, Mesh3d(other));
    app.update();
    ready(&mut app, 1);
    assert_eq!(stats(&app, camera).triangles_full, 20 * 4u64.pow(4));
}

#[test]
fn edited_source_leaves_no_hole() {
    for subdivisions in [4, 6] {
        let (mut app, camera, object) = before_a_camera(5, 300.0);
        let id = app.world().get::<Mesh3d>(object).unwrap().id();
        let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
        meshes.insert(id, rock(subdivisions, 1)).unwrap();
        // In the frame of the edit, the camera needs units that are not spawned yet.
        move_camera(&mut app, camera, 3.0);
        for frame in 0..4 {
            assert_eq!(visible(&app, camera), [object], "{frame}");
            app.update();
        }
        ready(&mut app, 1);
        let full = stats(&app, camera).triangles_full;
        assert_eq!(full, 20 * 4u64.pow(subdivisions));
        assert_eq!(open_edges(app.world(), &visible(&app, camera)), 0);
    }
}

#[test]
fn removed_source_removes_units() {
    let (mut app, camera, object) = before_a_camera(5, 3.0);
    let id = app.world().get::<Mesh3d>(object).unwrap().id();
    let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
    let source = meshes.remove(id).unwrap();
    (0..2).for_each(|_| app.update());
    assert_eq!(visible(&app, camera), [object]);
    assert!(units(&mut app).is_empty());
    let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
    meshes.insert(id, source).unwrap();
    ready(&mut app, 1);
    assert!(!units(&mut app).is_empty());
}

#[test]
fn smaller_displacement_needs_more_triangles() {
    let mut app = app();
    let cameras = [1.0, 0.5].map(|displacement_px| {
        let camera = spawn_camera(&mut app, 8.0);
        let settings = FieldLodCamera::guaranteed(displacement_px);
        insert(&mut app, camera, settings);
        camera
    });
    spawn_rock(&mut app, 6);
    ready(&mut app, 1);
    let [coarse, fine] = cameras.map(|camera| stats(&app, camera));
    assert_eq!(coarse.triangles_full, fine.triangles_full);
    assert!(coarse.triangles_drawn < fine.triangles_drawn);
    assert!(fine.triangles_drawn < fine.triangles_full);
}

#[test]
fn guarantee_draws_unmeasured_mesh_in_full() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 8.0);
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.bake = BakeConfig::fast();
    let object = spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    let id = app.world().get::<Mesh3d>(object).unwrap().id();
    let words = [id.to_string(), "displacement_px".into()];
    let is_logged = || logged(Level::WARN, &words.each_ref().map(String::as_str));
    // Screen-space errors need no deviations.
    let quality = stats(&app, camera);
    assert!(quality.triangles_drawn < quality.triangles_full);
    assert!(!is_logged());
    let guaranteed = FieldLodCamera::guaranteed(1.0);
    insert(&mut app, camera, guaranteed);
    app.update();
    let stats = stats(&app, camera);
    assert_eq!(stats.triangles_drawn, stats.triangles_full);
    assert!(is_logged());
}

#[test]
fn guarantee_measures_levels_that_are_ready() {
    let (mut app, camera, _) = before_a_camera(5, 8.0);
    let other = spawn_camera(&mut app, 20.0);
    (0..3).for_each(|_| app.update());
    let drawn_by = |app: &App, camera| {
        let stats = stats(app, camera);
        (stats.triangles_drawn, stats.units_drawn)
    };
    let of_other = drawn_by(&app, other);
    insert(&mut app, camera, FieldLodCamera::guaranteed(8.0));
    app.update();
    let drawn = stats(&app, camera);
    assert_eq!(drawn.triangles_drawn, drawn.triangles_full);
    run_until(&mut app, "deviations are measured", |app| {
        assert_eq!(drawn_by(app, other), of_other);
        progress(app).baking == 0
    });
    app.update();
    let measured = stats(&app, camera);
    assert!(measured.triangles_drawn < measured.triangles_full);
    assert_eq!(drawn_by(&app, other), of_other);
    // Meshes that are spawned later are measured at once.
    spawn_rock(&mut app, 4);
    ready(&mut app, 2);
    let both = stats(&app, camera);
    assert!(
        both.triangles_drawn - measured.triangles_drawn
            < both.triangles_full - measured.triangles_full
    );
    assert_eq!(progress(&app).baking, 0);
}

#[test]
fn meshes_of_units_exist_while_units_are_drawn() {
    let (mut app, camera, _) = before_a_camera(6, 3.0);
    let counts = |app: &mut App| {
        let units = units(app).len();
        let meshes = app.world().resource::<Assets<Mesh>>().len();
        (meshes, units)
    };
    let near = counts(&mut app);
    // The other meshes are the source, and meshes of Bevy.
    let others = near.0 - near.1;
    assert!(others < 3 && near.1 > 20, "{near:?}");
    for (distance, fewer) in [(300.0, true), (3.0, false)] {
        move_camera(&mut app, camera, distance);
        (0..IDLE_FRAMES + 3).for_each(|_| app.update());
        let (meshes, units) = counts(&mut app);
        assert_eq!(meshes, units + others);
        assert_eq!(units * 4 < near.1, fewer);
    }
}
