//! Copies of objects: clones and saved scenes.

use std::collections::HashSet;

use bevy::prelude::*;
use bevy::world_serialization::DynamicWorldBuilder;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;

use crate::headless::{
    before_a_camera, insert, level, move_camera, origins, progress, ready, stats, units, visible,
};

#[test]
fn cloned_prop_shares_levels_and_outlives_original() {
    let (mut app, camera, prop) = before_a_camera(4, 1000.0);
    let clone = app.world_mut().entity_mut(prop).clone_and_spawn();
    app.update();
    ready(&mut app, 2);
    assert_eq!(origins(&app).len(), 1);
    let far = level(&mut app, clone, camera);
    assert!(far > Some(2));
    assert_eq!(level(&mut app, prop, camera), far);
    app.world_mut().entity_mut(prop).despawn();
    move_camera(&mut app, camera, 2.0);
    assert_eq!(level(&mut app, clone, camera), Some(0));
    app.world_mut().entity_mut(clone).remove::<AutoLod>();
    app.update();
    app.update();
    assert_eq!(level(&mut app, clone, camera), None);
    assert!(!app.world().entity(clone).contains::<LodState>());
}

#[test]
fn saved_scene_restores_sources() {
    for subdivisions in [4, 5] {
        let (mut app, camera, object) = before_a_camera(subdivisions, 300.0);
        let world = app.world();
        let registry = world.resource::<AppTypeRegistry>().clone();
        let children = world.get::<Children>(object).into_iter().flatten().copied();
        let saved = DynamicWorldBuilder::from_world(world, &registry.read())
            .extract_entities(std::iter::once(object).chain(children))
            .build();
        app.world_mut().entity_mut(object).despawn();
        saved
            .write_to_world(app.world_mut(), &mut default())
            .unwrap();
        app.update();
        ready(&mut app, 1);
        let far = stats(&app, camera);
        assert_eq!(far.units_drawn as usize, visible(&app, camera).len());
        move_camera(&mut app, camera, 2.0);
        let near = stats(&app, camera);
        assert_eq!(near.triangles_full, 20 * 4u64.pow(subdivisions));
        assert!(near.triangles_drawn * 2 > near.triangles_full, "{near:?}");
    }
}

#[test]
fn clone_with_children_gets_own_units() {
    let (mut app, camera, object) = before_a_camera(5, 4.0);
    let before = visible(&app, camera).len();
    let mut original = app.world_mut().entity_mut(object);
    let clone = original.clone_and_spawn_with_opt_out(|cloner| {
        cloner.linked_cloning(true);
    });
    let beside = Transform::from_xyz(0.5, 0.0, 0.0);
    insert(&mut app, clone, beside);
    app.update();
    ready(&mut app, 2);
    assert_eq!(
        visible(&app, camera).len(),
        stats(&app, camera).units_drawn as usize
    );
    assert!(visible(&app, camera).len() > before);
    let mut seen = HashSet::new();
    for unit in units(&mut app) {
        let entity = app.world().entity(unit);
        let object = entity.get::<LodUnit>().unwrap().object;
        assert_eq!(entity.get::<ChildOf>().unwrap().parent(), object);
        assert!(seen.insert((object, entity.get::<Mesh3d>().unwrap().id())));
    }
    app.world_mut().entity_mut(clone).despawn();
    app.update();
    assert_eq!(visible(&app, camera).len(), before);
    assert_eq!(progress(&app).ready, 1);
}
