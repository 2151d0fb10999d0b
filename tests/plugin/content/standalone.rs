//! Meshes that are drawn from a `.fieldlod` file without a glTF file.

use std::fs;
use std::path::Path;

use bevy::camera::primitives::Aabb;
use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{LodError, LodUnit};
use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Precision};

use crate::headless::{
    app_in, failures, logged, progress, ready, run_until, spawn_camera, stats, units,
};

/// Writes the levels of a rock and of a larger one.
fn write_rocks(folder: &Path, precision: Precision) {
    let bake = |(index, subdivisions)| {
        let rock = bake_mesh(&fixtures::rock(subdivisions, 1), &BakeConfig::fast());
        BakedPrimitive::new(0, index, "rock", rock.unwrap())
    };
    let file = BakedFile {
        primitives: [(0, 4), (1, 6)].map(bake).into(),
    };
    fs::write(folder.join("rocks.fieldlod"), file.to_bytes_with(precision)).unwrap();
}

fn spawn(app: &mut App, primitive: u32, more: impl Bundle) -> Entity {
    let file = app.world().resource::<AssetServer>().load("rocks.fieldlod");
    let mesh = LodMesh3d::new(file, 0, primitive);
    app.world_mut().spawn((mesh, more)).id()
}

#[test]
fn file_without_gltf_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    for precision in [Precision::Lossless, Precision::Quantized16] {
        write_rocks(folder.path(), precision);
        let mut app = app_in(folder.path());
        let camera = spawn_camera(&mut app, 4.0);
        let fine = AutoLod {
            bias: 2.0,
            ..default()
        };
        let prop = spawn(&mut app, 0, fine);
        let large = spawn(&mut app, 1, ());
        let again = spawn(&mut app, 1, Transform::from_xyz(3.0, 0.0, 0.0));
        ready(&mut app, 3);
        let world = app.world();
        assert_eq!(
            world.get::<LodState>(prop),
            Some(&LodState::Ready(LodKind::WholeMesh))
        );
        assert_eq!(
            world.get::<LodState>(large),
            Some(&LodState::Ready(LodKind::Clusters))
        );
        // Entities of the same primitive share the mesh.
        assert_eq!(world.get::<Mesh3d>(large), world.get::<Mesh3d>(again));
        assert_eq!(world.get::<AutoLod>(prop).map(|lod| lod.bias), Some(2.0));
        assert!(world.get::<Aabb>(large).is_some());
        assert!(!units(&mut app).is_empty());
        let stats = stats(&app, camera);
        let fewer = 1..stats.triangles_full;
        assert!(fewer.contains(&stats.triangles_drawn), "{stats:?}");
    }
}

#[test]
fn removed_component_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    write_rocks(folder.path(), Precision::Lossless);
    let mut app = app_in(folder.path());
    spawn_camera(&mut app, 4.0);
    let large = spawn(&mut app, 1, ());
    ready(&mut app, 1);
    app.world_mut().entity_mut(large).remove::<LodMesh3d>();
    (0..3).for_each(|_| app.update());
    let entity = app.world().entity(large);
    assert!(!entity.contains::<Mesh3d>() && !entity.contains::<AutoLod>());
    let mut left = app.world_mut().query::<&LodUnit>();
    assert_eq!(left.iter(app.world()).count(), 0);
    assert_eq!(progress(&app).ready, 0);
    // The component is inserted again.
    let file = app.world().resource::<AssetServer>().load("rocks.fieldlod");
    app.world_mut()
        .entity_mut(large)
        .insert(LodMesh3d::new(file, 0, 0));
    ready(&mut app, 1);
}

/// The error of a primitive that cannot be drawn.
fn failure(folder: &Path, primitive: u32) -> LodError {
    let mut app = app_in(folder);
    spawn(&mut app, primitive, ());
    run_until(&mut app, "a failure", |app| !failures(app).is_empty());
    failures(&app)[0].clone()
}

#[test]
fn faults_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let file = || "rocks.fieldlod".to_owned();
    write_rocks(folder.path(), Precision::Lossless);
    let (mesh, primitive) = (0, 7);
    let missing = LodError::NoPrimitive {
        file: file(),
        mesh,
        primitive,
    };
    assert_eq!(failure(folder.path(), primitive), missing);
    assert!(logged(Level::ERROR, &["rocks.fieldlod", "no primitive 7"]));
    fs::remove_file(folder.path().join("rocks.fieldlod")).unwrap();
    let not_loaded = LodError::FileNotLoaded { file: file() };
    assert_eq!(failure(folder.path(), 0), not_loaded);
}

#[test]
fn file_that_loads_after_failure_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let mut app = app_in(folder.path());
    spawn(&mut app, 0, ());
    run_until(&mut app, "a failure", |app| !failures(app).is_empty());
    write_rocks(folder.path(), Precision::Lossless);
    let assets = app.world().resource::<AssetServer>();
    assets.reload("rocks.fieldlod");
    ready(&mut app, 1);
}
