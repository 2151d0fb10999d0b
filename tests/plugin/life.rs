//! Objects come, change and go.

use std::any::TypeId;
use std::path::Path;

use bevy::camera::visibility::VisibleEntities;
use bevy::mesh::MeshTag;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{FieldLodDebugPlugin, FieldLodHeatMap, LodSurfaceMaterial};
use fieldlod_tests::apps::{bevy_mesh, finish};

use crate::headless::{
    app, entity_count, ready, run_until, spawn_camera, spawn_object, stats, status,
};

#[test]
fn a_mesh_is_drawn_in_full_until_its_hierarchy_is_ready() {
    let mut app = app(Path::new("."));
    let camera = spawn_camera(&mut app, 30.0);
    let object = spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(6, 1)));
    let visible = |app: &App| {
        let visible = app.world().get::<VisibleEntities>(camera).unwrap();
        visible.get(TypeId::of::<Mesh3d>()).to_vec()
    };
    let mut frames_in_full = 0;
    run_until(&mut app, "the cut takes over", |app| {
        app.update();
        let in_full = visible(app) == [object];
        frames_in_full += usize::from(in_full);
        // In every frame, either the source or the cut is in the list.
        assert_eq!(in_full, status(app).ready == 0);
        !in_full
    });
    assert!(frames_in_full > 0);
    let stats = stats(&app, camera);
    assert_eq!(stats.triangles_full, 81_920);
    assert!(
        stats.triangles_drawn * 4 < stats.triangles_full,
        "{stats:?}"
    );
    assert_eq!(visible(&app).len(), stats.units_drawn as usize);
}

#[test]
fn instances_share_one_hierarchy() {
    let mut app = app(Path::new("."));
    let first = spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(5, 1)));
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
fn despawning_leaves_nothing_behind() {
    let mut app = app(Path::new("."));
    let camera = spawn_camera(&mut app, 2.5);
    let before = entity_count(&mut app);
    let object = spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(6, 1)));
    ready(&mut app, 1);
    assert!(entity_count(&mut app) > before + 10);
    app.world_mut().entity_mut(object).despawn();
    app.update();
    app.update();
    assert_eq!(entity_count(&mut app), before);
    assert_eq!(stats(&app, camera).triangles_full, 0);
    assert_eq!(status(&app), FieldLodProgress::default());
}

#[test]
fn an_exchanged_mesh_gets_its_own_hierarchy() {
    let mut app = app(Path::new("."));
    let camera = spawn_camera(&mut app, 30.0);
    let object = spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(5, 1)));
    ready(&mut app, 1);
    let other = bevy_mesh(&fieldlod_tests::rock(4, 2));
    let other = app.world_mut().resource_mut::<Assets<Mesh>>().add(other);
    app.world_mut().entity_mut(object).insert(Mesh3d(other));
    app.update();
    ready(&mut app, 1);
    assert_eq!(stats(&app, camera).triangles_full, 20 * 4u64.pow(4));
}

#[test]
fn a_changed_mesh_asset_is_baked_anew() {
    let mut app = app(Path::new("."));
    let camera = spawn_camera(&mut app, 30.0);
    let object = spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(5, 1)));
    ready(&mut app, 1);
    let id = app.world().get::<Mesh3d>(object).unwrap().id();
    let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
    meshes
        .insert(id, bevy_mesh(&fieldlod_tests::rock(4, 1)))
        .unwrap();
    run_until(&mut app, "the change arrives", |app| status(app).ready == 0);
    ready(&mut app, 1);
    assert_eq!(stats(&app, camera).triangles_full, 20 * 4u64.pow(4));
}

#[test]
fn a_frozen_cut_stays_while_the_camera_moves() {
    let mut app = app(Path::new("."));
    let camera = spawn_camera(&mut app, 60.0);
    spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(6, 1)));
    ready(&mut app, 1);
    let far = stats(&app, camera).triangles_drawn;
    app.world_mut().resource_mut::<FieldLodDebug>().freeze = true;
    app.world_mut()
        .get_mut::<Transform>(camera)
        .unwrap()
        .translation
        .z = 6.0;
    app.update();
    assert_eq!(stats(&app, camera).triangles_drawn, far);
    app.world_mut().resource_mut::<FieldLodDebug>().freeze = false;
    app.update();
    assert!(stats(&app, camera).triangles_drawn > 2 * far);
}

#[test]
fn a_mesh_exchanged_under_a_frozen_cut_is_drawn() {
    let mut app = app(Path::new("."));
    let camera = spawn_camera(&mut app, 3.0);
    let object = spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(6, 1)));
    ready(&mut app, 1);
    app.world_mut().resource_mut::<FieldLodDebug>().freeze = true;
    let other = bevy_mesh(&fieldlod_tests::rock(3, 2));
    let other = app.world_mut().resource_mut::<Assets<Mesh>>().add(other);
    app.world_mut().entity_mut(object).insert(Mesh3d(other));
    app.update();
    ready(&mut app, 1);
    assert!(stats(&app, camera).triangles_drawn > 0);
}

#[test]
fn a_guarantee_costs_triangles() {
    let mut app = app(Path::new("."));
    let quality = spawn_camera(&mut app, 8.0);
    let guaranteed = spawn_camera(&mut app, 8.0);
    let view = FieldLodSettings {
        guaranteed: true,
        ..default()
    };
    app.world_mut().entity_mut(guaranteed).insert(view);
    spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(6, 1)));
    ready(&mut app, 1);
    let [quality, guaranteed] = [quality, guaranteed].map(|camera| stats(&app, camera));
    assert_eq!(quality.triangles_full, guaranteed.triangles_full);
    assert!(quality.triangles_drawn < guaranteed.triangles_drawn);
    assert!(guaranteed.triangles_drawn < guaranteed.triangles_full);
}

#[test]
fn level_colours_and_a_new_material_reach_the_units() {
    let mut app = app_with_debug();
    for distance in [2.0, 6.0, 20.0, 60.0, 200.0] {
        spawn_camera(&mut app, distance);
    }
    let object = spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(5, 1)));
    ready(&mut app, 1);
    let own = worn(&app, object);
    assert_eq!(own.len(), 1);
    app.world_mut().resource_mut::<FieldLodDebug>().color_levels = true;
    app.update();
    let levels = painted_levels(&app, object);
    assert!(levels.len() > 3, "{levels:?}");
    assert!(worn(&app, object).is_empty());
    let mut assets = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    let red = assets.add(StandardMaterial::from(Color::srgb(1.0, 0.0, 0.0)));
    app.world_mut()
        .entity_mut(object)
        .insert(MeshMaterial3d(red.clone()));
    app.update();
    assert_eq!(
        painted_levels(&app, object),
        levels,
        "a new material must not paint over the levels"
    );
    assert!(worn(&app, object).is_empty());
    app.world_mut().resource_mut::<FieldLodDebug>().color_levels = false;
    app.update();
    assert_eq!(worn(&app, object), [red.id()]);
    assert!(painted_levels(&app, object).is_empty());
}

#[test]
fn units_that_come_are_painted_in_the_frame_in_which_they_come() {
    let mut app = app_with_debug();
    let camera = spawn_camera(&mut app, 60.0);
    let object = spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(5, 1)));
    ready(&mut app, 1);
    app.world_mut().resource_mut::<FieldLodDebug>().color_levels = true;
    app.update();
    let before = entity_count(&mut app);
    crate::headless::move_camera(&mut app, camera, 3.0);
    assert!(entity_count(&mut app) > before, "no units came");
    assert!(worn(&app, object).is_empty());
}

fn app_with_debug() -> App {
    let mut app = crate::headless::unfinished(AssetPlugin::default());
    app.add_plugins(FieldLodDebugPlugin);
    finish(&mut app);
    app
}

/// The materials of a game's that the units of `object` wear.
fn worn(app: &App, object: Entity) -> Vec<AssetId<StandardMaterial>> {
    let units = app.world().get::<Children>(object).unwrap().iter();
    let material = |unit| app.world().get::<MeshMaterial3d<StandardMaterial>>(unit);
    let mut ids: Vec<_> = units.filter_map(material).map(|worn| worn.id()).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// The levels in which its units are painted.
fn painted_levels(app: &App, object: Entity) -> Vec<u32> {
    let units = app.world().get::<Children>(object).unwrap().iter();
    let is_painted = |unit: &Entity| {
        let painted = app.world().get::<MeshMaterial3d<LodSurfaceMaterial>>(*unit);
        painted.is_some()
    };
    let tag = |unit| app.world().get::<MeshTag>(unit).unwrap().0 >> 24;
    let mut levels: Vec<u32> = units.filter(is_painted).map(tag).collect();
    levels.sort_unstable();
    levels.dedup();
    levels
}

#[test]
fn a_painted_prop_gets_back_what_it_wore() {
    let mut app = app_with_debug();
    spawn_camera(&mut app, 50.0);
    let object = spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(4, 1)));
    app.world_mut().entity_mut(object).insert(MeshTag(77));
    ready(&mut app, 1);
    let wears = |app: &App| {
        let entity = app.world().entity(object);
        let own = entity.get::<MeshMaterial3d<StandardMaterial>>();
        let painted = entity.contains::<MeshMaterial3d<LodSurfaceMaterial>>();
        (
            own.map(|own| own.id()),
            painted,
            entity.get::<MeshTag>().unwrap().0,
        )
    };
    let before = wears(&app);
    assert!(before.0.is_some() && !before.1 && before.2 == 77);
    let mut debug = app.world_mut().resource_mut::<FieldLodDebug>();
    debug.heat_map = Some(FieldLodHeatMap::PixelError);
    app.update();
    let painted = wears(&app);
    assert!(
        painted.0.is_none() && painted.1 && painted.2 >> 24 > 0,
        "{painted:?}"
    );
    let mut debug = app.world_mut().resource_mut::<FieldLodDebug>();
    debug.heat_map = None;
    app.update();
    assert_eq!(wears(&app), before);
}

#[test]
fn the_overlay_comes_and_goes() {
    let mut app = app_with_debug();
    spawn_camera(&mut app, 50.0);
    spawn_object(&mut app, bevy_mesh(&fieldlod_tests::rock(4, 1)));
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
