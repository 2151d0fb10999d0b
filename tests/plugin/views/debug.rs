//! Debug views: painted levels, frozen cuts, the overlay.

use bevy::mesh::MeshTag;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{FieldLodDebugPlugin, FieldLodHeatMap};

use crate::headless::{
    app_with, entity_count, insert, move_camera, ready, spawn_camera, spawn_rock, stats,
};

#[test]
fn frozen_cut_ignores_camera() {
    let mut app = app_with(FieldLodDebugPlugin);
    let camera = spawn_camera(&mut app, 60.0);
    spawn_rock(&mut app, 6);
    ready(&mut app, 1);
    let far = stats(&app, camera).triangles_drawn;
    app.world_mut().resource_mut::<FieldLodDebug>().freeze = true;
    move_camera(&mut app, camera, 6.0);
    assert_eq!(stats(&app, camera).triangles_drawn, far);
    app.world_mut().resource_mut::<FieldLodDebug>().freeze = false;
    app.update();
    assert!(stats(&app, camera).triangles_drawn > 2 * far);
}

#[test]
fn painted_units_get_new_material_later() {
    let mut app = app_with(FieldLodDebugPlugin);
    for distance in [2.0, 6.0, 20.0, 60.0, 200.0] {
        spawn_camera(&mut app, distance);
    }
    let object = spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    let own = own_materials(&app, object);
    assert_eq!(own.len(), 1);
    app.world_mut().resource_mut::<FieldLodDebug>().color_levels = true;
    app.update();
    let levels = painted_levels(&app, object);
    assert!(levels.len() > 3, "{levels:?}");
    assert!(own_materials(&app, object).is_empty());
    let mut assets = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    let red = assets.add(StandardMaterial::from(Color::srgb(1.0, 0.0, 0.0)));
    insert(&mut app, object, MeshMaterial3d(red.clone()));
    app.update();
    assert_eq!(
        painted_levels(&app, object),
        levels,
        "a new material must not paint over the levels"
    );
    assert!(own_materials(&app, object).is_empty());
    app.world_mut().resource_mut::<FieldLodDebug>().color_levels = false;
    app.update();
    assert_eq!(own_materials(&app, object), [red.id()]);
    assert!(painted_levels(&app, object).is_empty());
}

#[test]
fn new_units_are_painted_at_once() {
    let mut app = app_with(FieldLodDebugPlugin);
    let camera = spawn_camera(&mut app, 60.0);
    let object = spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    app.world_mut().resource_mut::<FieldLodDebug>().color_levels = true;
    app.update();
    let before = entity_count(&mut app);
    move_camera(&mut app, camera, 3.0);
    assert!(entity_count(&mut app) > before, "no unit is new");
    assert!(own_materials(&app, object).is_empty());
}

/// The standard materials of the units of `object`.
fn own_materials(app: &App, object: Entity) -> Vec<AssetId<StandardMaterial>> {
    let units = app.world().get::<Children>(object).unwrap().iter();
    let material = |unit| app.world().get::<MeshMaterial3d<StandardMaterial>>(unit);
    let mut ids: Vec<_> = units.filter_map(material).map(|own| own.id()).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// The levels of painted units: only these have a tag.
fn painted_levels(app: &App, object: Entity) -> Vec<u32> {
    let units = app.world().get::<Children>(object).unwrap().iter();
    let tags = units.filter_map(|unit| app.world().get::<MeshTag>(unit));
    let mut levels: Vec<u32> = tags.map(|tag| **tag >> 24).collect();
    levels.sort_unstable();
    levels.dedup();
    levels
}

#[test]
fn painted_prop_gets_materials_back() {
    let mut app = app_with(FieldLodDebugPlugin);
    spawn_camera(&mut app, 50.0);
    let object = spawn_rock(&mut app, 4);
    let mut tag = MeshTag::default();
    *tag = 77;
    insert(&mut app, object, tag);
    ready(&mut app, 1);
    let material_and_tag = |app: &App| {
        let entity = app.world().entity(object);
        let own = entity.get::<MeshMaterial3d<StandardMaterial>>();
        (own.map(|own| own.id()), **entity.get::<MeshTag>().unwrap())
    };
    let before = material_and_tag(&app);
    assert!(before.0.is_some() && before.1 == 77);
    let mut debug = app.world_mut().resource_mut::<FieldLodDebug>();
    debug.heat_map = Some(FieldLodHeatMap::PixelError);
    app.update();
    let painted = material_and_tag(&app);
    assert!(painted.0.is_none() && painted.1 >> 24 > 0, "{painted:?}");
    let mut debug = app.world_mut().resource_mut::<FieldLodDebug>();
    debug.heat_map = None;
    app.update();
    assert_eq!(material_and_tag(&app), before);
}

#[test]
fn overlay_is_shown_and_hidden() {
    let mut app = app_with(FieldLodDebugPlugin);
    spawn_camera(&mut app, 50.0);
    spawn_rock(&mut app, 4);
    ready(&mut app, 1);
    app.world_mut().resource_mut::<FieldLodDebug>().overlay = true;
    app.world_mut().resource_mut::<FieldLodDebug>().bounds = true;
    app.update();
    app.update();
    let text = app
        .world_mut()
        .query::<&Text>()
        .single(app.world())
        .unwrap();
    assert!(
        text.0.contains("1 ready") && text.0.contains("of 5120 triangles"),
        "{}",
        text.0
    );
    app.world_mut().resource_mut::<FieldLodDebug>().overlay = false;
    app.update();
    app.update();
    assert_eq!(app.world_mut().query::<&Text>().iter(app.world()).len(), 0);
}
