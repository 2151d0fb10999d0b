//! Kinds of levels: none for small meshes, whole meshes for props, units for large meshes.

use bevy::camera::visibility::RenderLayers;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use crate::headless::{
    add, app, before_a_camera, entity_count, insert, level, move_camera, progress, ready, rock,
    run_until, spawn_camera, spawn_rock, stats, units,
};

#[test]
fn small_meshes_stay_plain() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 300.0);
    spawn_rock(&mut app, 1);
    run_until(&mut app, "it is plain", |app| progress(app).plain == 1);
    app.update();
    assert_eq!(stats(&app, camera).triangles_full, 0);
}

#[test]
fn objects_without_area_are_not_counted() {
    for subdivisions in [4, 5] {
        let (mut app, camera, object) = before_a_camera(subdivisions, 40.0);
        let counts = |app: &App| {
            let stats = stats(app, camera);
            (
                stats.triangles_drawn,
                stats.triangles_full,
                stats.units_drawn,
            )
        };
        let before = counts(&app);
        let mut counts_at = |place: Transform| {
            insert(&mut app, object, place);
            app.update();
            counts(&app)
        };
        let nowhere = Vec3::new(0.0, f32::NAN, 0.0);
        for nothing in [
            Transform::from_scale(Vec3::ZERO),
            Transform::from_scale(Vec3::X),
            Transform::from_scale(nowhere),
            Transform::from_translation(nowhere),
            Transform::from_translation(Vec3::splat(f32::INFINITY)),
        ] {
            assert_eq!(counts_at(nothing), (0, 0, 0), "{nothing:?}");
            assert_eq!(counts_at(Transform::default()), before);
        }
        // A flat object has an area.
        assert!(counts_at(Transform::from_scale(Vec3::new(1.0, 1.0, 0.0))).0 > 0);
        let mesh = app.world().get::<Mesh3d>(object).unwrap().clone();
        app.world_mut().despawn(object);
        let new = (mesh, AutoLod::default(), Transform::from_scale(Vec3::ZERO));
        app.world_mut().spawn(new);
        ready(&mut app, 1);
        assert_eq!(counts(&app), (0, 0, 0));
    }
}

#[test]
fn prop_is_one_entity_with_one_level() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 1000.0);
    let object = spawn_rock(&mut app, 4);
    app.update();
    let before = entity_count(&mut app);
    ready(&mut app, 1);
    assert_eq!(entity_count(&mut app), before);
    assert!(level(&mut app, object, camera) > Some(2));
    let far = stats(&app, camera);
    assert!(far.triangles_drawn * 50 < far.triangles_full, "{far:?}");
    assert_eq!(far.triangles_full, 5120);

    move_camera(&mut app, camera, 2.0);
    assert_eq!(level(&mut app, object, camera), Some(0));
    let near = stats(&app, camera);
    assert_eq!(near.triangles_drawn, near.triangles_full);
}

#[test]
fn prop_has_finest_level_of_all_views() {
    let mut app = app();
    let far = spawn_camera(&mut app, 1000.0);
    let near = spawn_camera(&mut app, 2.0);
    let object = spawn_rock(&mut app, 4);
    ready(&mut app, 1);
    assert_eq!(level(&mut app, object, far), Some(0));
    // Views on other layers are ignored.
    insert(&mut app, near, RenderLayers::layer(3));
    app.update();
    assert!(level(&mut app, object, far) > Some(0));
    insert(&mut app, near, RenderLayers::default());
    app.update();
    assert_eq!(level(&mut app, object, far), Some(0));
    // Inactive views are ignored.
    app.world_mut().get_mut::<Camera>(near).unwrap().is_active = false;
    app.update();
    assert!(level(&mut app, object, far) > Some(0));
    app.world_mut().get_mut::<Camera>(near).unwrap().is_active = true;
    app.update();
    assert_eq!(level(&mut app, object, far), Some(0));
    assert!(stats(&app, far).triangles_drawn > 0);
}

#[test]
fn kind_can_be_chosen() {
    let (mut app, camera, large) = before_a_camera(5, 2.5);
    assert!(units(&mut app).len() > 1);
    let chosen = AutoLod::of_kind(LodKind::WholeMesh);
    insert(&mut app, large, chosen);
    app.update();
    ready(&mut app, 1);
    assert!(units(&mut app).is_empty());
    insert(&mut app, large, AutoLod::of_kind(LodKind::Plain));
    app.update();
    run_until(&mut app, "it is plain", |app| progress(app).plain == 1);
    app.update();
    assert_eq!(stats(&app, camera).triangles_full, 0);
}

#[test]
fn bias_refines_levels() {
    for subdivisions in [4, 5] {
        let (mut app, camera, object) = before_a_camera(subdivisions, 40.0);
        let plain = stats(&app, camera).triangles_drawn;
        let biased = AutoLod {
            bias: 20.0,
            ..default()
        };
        insert(&mut app, object, biased);
        app.update();
        app.update();
        assert_eq!(progress(&app).ready, 1);
        let finer = stats(&app, camera).triangles_drawn;
        assert!(finer > 2 * plain, "{plain} {finer}");
    }
}

#[test]
fn whole_world_excludes_no_lod() {
    let mut app = app();
    spawn_camera(&mut app, 100.0);
    let mesh = add(&mut app, rock(4, 1));
    let world = app.world_mut();
    world.spawn(Mesh3d(mesh.clone()));
    let root = world.spawn((NoLod, Transform::default())).id();
    world.spawn((Mesh3d(mesh.clone()), ChildOf(root)));
    let marked = world.spawn((Mesh3d(mesh), AutoLod::default(), NoLod)).id();
    app.update();
    assert_eq!(progress(&app), FieldLodProgress::default());
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.whole_world = true;
    ready(&mut app, 1);
    app.world_mut().entity_mut(marked).remove::<NoLod>();
    app.update();
    ready(&mut app, 2);
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.whole_world = false;
    app.update();
    app.update();
    assert_eq!(progress(&app).ready, 1);
}
