//! Meshes that cannot have levels of detail are drawn as they are, and the log says why.

use bevy::asset::RenderAssetUsages;
use bevy::log::tracing::Level;
use bevy::mesh::morph::MeshMorphWeights;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;

use crate::headless::{
    Events, app, insert, logged, progress, run_until, spawn_camera, spawn_object, spawn_rock,
    visible,
};

/// Whether `object` stays plain and visible, and one line tells its id and all of `words`.
fn assert_plain(app: &mut App, camera: Entity, object: Entity, level: Level, words: &[&str]) {
    run_until(app, "the mesh is given up", |app| progress(app).plain == 1);
    app.update();
    assert_eq!(visible(app, camera), [object]);
    let id = app.world().get::<Mesh3d>(object).unwrap().id();
    let id = format!("{:?}", id.untyped());
    let words: Vec<&str> = words.iter().copied().chain([id.as_str()]).collect();
    assert!(logged(level, &words), "{words:?}");
    let expected = app.world().get::<Mesh3d>(object).unwrap().id();
    let events = &app.world().resource::<Events>().0;
    let failed = |event: &FieldLodEvent| matches!(event, FieldLodEvent::Failed { mesh, .. } if *mesh == expected);
    assert_eq!(events.iter().any(failed), level == Level::ERROR);
}

fn rejects(mesh: Mesh, words: &[&str]) {
    let mut app = app();
    let camera = spawn_camera(&mut app, 10.0);
    let object = spawn_object(&mut app, mesh);
    assert_plain(&mut app, camera, object, Level::ERROR, words);
}

#[test]
fn rejects_positions_of_nan() {
    let mut rock = fieldlod_tests::rock(3, 1);
    rock.positions[7].y = f32::NAN;
    rejects(bevy_mesh(&rock), &["vertex 7"]);
}

#[test]
fn rejects_indices_out_of_range() {
    let mut rock = fieldlod_tests::rock(3, 1);
    rock.indices[5] = 1_000_000;
    rejects(bevy_mesh(&rock), &["1000000"]);
}

#[test]
fn rejects_lines() {
    let mesh = Mesh::new(PrimitiveTopology::LineList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0f32; 3]; 3000])
        .with_inserted_indices(Indices::U32((0..3000).collect()));
    rejects(mesh, &["LineList"]);
}

#[test]
fn leaves_skinned_meshes_as_they_are() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 10.0);
    let object = spawn_rock(&mut app, 5);
    insert(&mut app, object, SkinnedMesh::default());
    assert_plain(&mut app, camera, object, Level::INFO, &["skinned"]);
}

#[test]
fn leaves_morphed_meshes_as_they_are() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 10.0);
    let object = spawn_rock(&mut app, 5);
    insert(&mut app, object, MeshMorphWeights::Reference(object));
    assert_plain(&mut app, camera, object, Level::INFO, &["morph"]);
}
