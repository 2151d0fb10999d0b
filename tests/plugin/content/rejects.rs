//! Meshes that cannot have levels of detail: the source is drawn, and the log has the reason.

use bevy::asset::RenderAssetUsages;
use bevy::log::tracing::Level;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;

use crate::headless::{
    Events, app, insert, logged, logged_times, progress, run_until, spawn_camera, spawn_object,
    spawn_rock, visible,
};

/// Checks that `mesh` stays plain and visible, and that an event reports the failure. A log line at `level` must have
/// the name of the object and all of `words`.
fn rejects(mesh: Mesh, level: Level, words: &[&str]) {
    let mut app = app();
    let camera = spawn_camera(&mut app, 10.0);
    let object = spawn_object(&mut app, mesh);
    let name = format!("the rock with {}", words[0]);
    let named = Name::new(name.clone());
    app.world_mut()
        .spawn((Transform::default(), named))
        .add_child(object);
    run_until(&mut app, "the mesh is plain", |app| {
        progress(app).plain == 1
    });
    app.update();
    assert_eq!(visible(&app, camera), [object]);
    let rejected = app.world().get::<Mesh3d>(object).unwrap().id();
    let words = [words, &[&name, "drawing the source mesh"]].concat();
    assert_eq!(logged_times(level, &words), 1, "{words:?}");
    let failed = |event: &FieldLodEvent| matches!(event, FieldLodEvent::Failed { mesh, .. } if *mesh == rejected);
    assert!(app.world().resource::<Events>().0.iter().any(failed));
}

#[test]
fn rejects_positions_of_nan() {
    let mut rock = fieldlod_tests::rock(3, 1);
    rock.positions[7].y = f32::NAN;
    rejects(bevy_mesh(&rock), Level::ERROR, &["vertex 7"]);
}

#[test]
fn rejects_indices_out_of_range() {
    let mut rock = fieldlod_tests::rock(3, 1);
    rock.indices[5] = 1_000_000;
    rejects(bevy_mesh(&rock), Level::ERROR, &["1000000"]);
}

#[test]
fn rejects_lines() {
    let mesh = Mesh::new(PrimitiveTopology::LineList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0f32; 3]; 3000])
        .with_inserted_indices(Indices::U32((0..3000).collect()));
    rejects(mesh, Level::INFO, &["LineList"]);
}

#[test]
fn rejects_render_world_mesh() {
    let mut mesh = bevy_mesh(&fieldlod_tests::rock(3, 1));
    mesh.asset_usage = RenderAssetUsages::RENDER_WORLD;
    rejects(mesh, Level::INFO, &["MAIN_WORLD"]);
}

#[test]
fn unsupported_meshes_are_logged_once_with_name() {
    let mut app = app();
    spawn_camera(&mut app, 10.0);
    for name in ["first rope", "second rope"] {
        let mesh = Mesh::new(PrimitiveTopology::LineStrip, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0f32; 3]; 3000]);
        let object = spawn_object(&mut app, mesh);
        insert(&mut app, object, Name::new(name));
        app.update();
    }
    run_until(&mut app, "both are plain", |app| progress(app).plain == 2);
    let count = |name| logged_times(Level::INFO, &[name, "LineStrip"]);
    assert_eq!(count("first rope") + count("second rope"), 1);
    assert!(!logged(Level::ERROR, &["LineStrip"]));
    assert!(!logged(Level::INFO, &["rope", "TypeId"]));
}

/// Observed events, in order: the observing entity, the target, and whether the target is ready.
#[derive(Resource, Default)]
struct Seen(Vec<(Entity, Entity, bool)>);

#[test]
fn entity_events_propagate_to_parents() {
    let mut app = app();
    spawn_camera(&mut app, 10.0);
    app.init_resource::<Seen>();
    let root = app.world_mut().spawn(Transform::default()).id();
    let mut root_mut = app.world_mut().entity_mut(root);
    root_mut.observe(move |ready: On<LodReady>, mut seen: ResMut<Seen>| {
        seen.0.push((root, ready.original_event_target(), true));
    });
    root_mut.observe(move |failed: On<LodFailed>, mut seen: ResMut<Seen>| {
        seen.0.push((root, failed.original_event_target(), false));
    });
    let mut lines = Mesh::new(PrimitiveTopology::LineList, RenderAssetUsages::default());
    lines.insert_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0f32; 3]; 3000]);
    let good = spawn_rock(&mut app, 4);
    let bad = spawn_object(&mut app, lines);
    app.world_mut().entity_mut(root).add_children(&[good, bad]);
    app.update();
    let state = |app: &App, entity: Entity| app.world().get::<LodState>(entity).copied();
    assert_eq!(state(&app, good), Some(LodState::Waiting));
    run_until(&mut app, "both events arrive", |app| {
        app.world().resource::<Seen>().0.len() == 2
    });
    let seen = &app.world().resource::<Seen>().0;
    assert!(seen.contains(&(root, good, true)) && seen.contains(&(root, bad, false)));
    let ready = LodState::Ready(LodKind::WholeMesh);
    assert_eq!(
        [good, bad].map(|e| state(&app, e)),
        [Some(ready), Some(LodState::Failed)]
    );
    app.world_mut().entity_mut(good).remove::<AutoLod>();
    app.update();
    assert_eq!(state(&app, good), None);
}
