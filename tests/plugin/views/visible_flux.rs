//! Visible flux.

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use crate::headless::{before_a_camera, insert, ready, spawn_rock, stats};

/// A rock, and a larger one between it and the camera.
fn rock_behind_a_rock(has_flux: bool) -> (App, Entity, Entity) {
    let (mut app, camera, _) = before_a_camera(6, 12.0);
    if has_flux {
        insert(&mut app, camera, FieldLodVisibleFlux);
    }
    let wall = spawn_rock(&mut app, 6);
    let place = Transform::from_xyz(0.0, 0.0, 6.0).with_scale(Vec3::new(2.5, 2.5, 0.4));
    insert(&mut app, wall, place);
    ready(&mut app, 2);
    (0..60).for_each(|_| app.update());
    (app, camera, wall)
}

fn glass(app: &mut App) -> MeshMaterial3d<StandardMaterial> {
    let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    MeshMaterial3d(materials.add(StandardMaterial {
        alpha_mode: AlphaMode::Blend,
        ..default()
    }))
}

fn drawn(app: &App, camera: Entity) -> u64 {
    stats(app, camera).triangles_drawn
}

#[test]
fn hidden_object_needs_fewer_triangles() {
    let (without, camera, _) = rock_behind_a_rock(false);
    let all = drawn(&without, camera);
    let (mut app, camera, wall) = rock_behind_a_rock(true);
    let hidden = drawn(&app, camera);
    assert!(hidden < all, "{hidden} of {all}");
    // The first frame without the wall hides nothing.
    app.world_mut().entity_mut(wall).despawn();
    app.update();
    let (alone, other, _) = before_a_camera(6, 12.0);
    assert_eq!(drawn(&app, camera), drawn(&alone, other));
}

#[test]
fn visible_flux_added_later_has_occluders() {
    let (mut app, camera, wall) = rock_behind_a_rock(false);
    let all = drawn(&app, camera);
    insert(&mut app, camera, FieldLodVisibleFlux);
    (0..60).for_each(|_| app.update());
    let hidden = drawn(&app, camera);
    assert!(hidden < all, "{hidden} of {all}");
    // A material that changes while no camera uses visible flux counts too.
    let mut camera_mut = app.world_mut().entity_mut(camera);
    camera_mut.remove::<FieldLodVisibleFlux>();
    (0..60).for_each(|_| app.update());
    let glass = glass(&mut app);
    insert(&mut app, wall, glass);
    (0..3).for_each(|_| app.update());
    insert(&mut app, camera, FieldLodVisibleFlux);
    (0..60).for_each(|_| app.update());
    assert!(drawn(&app, camera) > hidden);
}

#[test]
fn transparent_object_hides_nothing() {
    let (without, camera, _) = rock_behind_a_rock(false);
    let all = drawn(&without, camera);
    let (alone, other, _) = before_a_camera(6, 12.0);
    let alone = drawn(&alone, other);
    let make_glass = |app: &mut App, wall: Entity| {
        let glass = glass(app);
        insert(app, wall, glass);
    };
    let edit = |app: &mut App, wall: Entity| {
        let material = app.world().get::<MeshMaterial3d<StandardMaterial>>(wall);
        let (material, glass) = (material.unwrap().id(), glass(app));
        let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
        let glass = materials.get(&glass).unwrap().clone();
        materials.insert(material, glass).unwrap();
    };
    let remove = |app: &mut App, wall: Entity| {
        let mut wall = app.world_mut().entity_mut(wall);
        wall.remove::<MeshMaterial3d<StandardMaterial>>();
    };
    let changes: [&dyn Fn(&mut App, Entity); 3] = [&make_glass, &edit, &remove];
    for change in changes {
        let (mut app, camera, wall) = rock_behind_a_rock(true);
        change(&mut app, wall);
        (0..3).for_each(|_| app.update());
        let rock_behind_glass = drawn(&app, camera);
        // Glass does not hide the rock as a wall does.
        let hidden_behind_glass = all - rock_behind_glass;
        assert!(
            hidden_behind_glass * 2 < alone,
            "{rock_behind_glass} of {all}"
        );
    }
}
