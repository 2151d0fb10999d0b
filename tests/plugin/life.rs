//! Objects come, change and go.

use bevy::log::tracing::Level;
use bevy::mesh::MeshTag;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{BakeConfig, FieldLodDebugPlugin, FieldLodHeatMap};
use fieldlod_tests::soak::open_edges;

use crate::headless::{
    IDLE_FRAMES, add, app, app_with, before_a_camera, entity_count, insert, logged, move_camera,
    progress, ready, rock, run_until, spawn_camera, spawn_rock, stats, units, visible,
};

#[test]
fn source_is_drawn_until_levels_are_ready() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 30.0);
    let object = spawn_rock(&mut app, 6);
    let mut frames_in_full = 0;
    run_until(&mut app, "the cut takes over", |app| {
        app.update();
        let in_full = visible(app, camera) == [object];
        frames_in_full += usize::from(in_full);
        // In every frame, either the source or the cut is in the list.
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
fn removing_mesh_removes_levels() {
    for subdivisions in [4, 6] {
        let mut app = app();
        let camera = spawn_camera(&mut app, 30.0);
        let bare = entity_count(&mut app);
        let object = spawn_rock(&mut app, subdivisions);
        ready(&mut app, 1);
        assert!(!visible(&app, camera).is_empty());
        app.world_mut().entity_mut(object).remove::<Mesh3d>();
        (0..3).for_each(|_| app.update());
        assert_eq!(stats(&app, camera).triangles_drawn, 0);
        assert_eq!(entity_count(&mut app), bare);
        assert!(!app.world().entity(object).contains::<LodState>());
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
fn despawned_object_leaves_no_units() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 2.5);
    let before = entity_count(&mut app);
    let object = spawn_rock(&mut app, 6);
    ready(&mut app, 1);
    assert!(entity_count(&mut app) > before + 10);
    app.world_mut().entity_mut(object).despawn();
    app.update();
    app.update();
    assert_eq!(entity_count(&mut app), before);
    assert_eq!(stats(&app, camera).triangles_full, 0);
    assert_eq!(progress(&app), FieldLodProgress::default());
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
        // The camera needs units that are not there yet, in the frame of the edit.
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
fn frozen_cut_ignores_camera() {
    let mut app = app_with(FieldLodDebugPlugin);
    let camera = spawn_camera(&mut app, 60.0);
    spawn_rock(&mut app, 6);
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
fn unmeasured_mesh_is_drawn_at_full_detail() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 8.0);
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.bake = BakeConfig::fast();
    let object = spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    let id = app.world().get::<Mesh3d>(object).unwrap().id();
    let words = [id.to_string(), "displacement_px".into()];
    let told = || logged(Level::WARN, &words.each_ref().map(String::as_str));
    // Quality needs none.
    let quality = stats(&app, camera);
    assert!(quality.triangles_drawn < quality.triangles_full);
    assert!(!told());
    let guaranteed = FieldLodCamera::guaranteed(1.0);
    insert(&mut app, camera, guaranteed);
    app.update();
    let stats = stats(&app, camera);
    assert_eq!(stats.triangles_drawn, stats.triangles_full);
    assert!(told());
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
    assert!(entity_count(&mut app) > before, "no units came");
    assert!(own_materials(&app, object).is_empty());
}

/// The materials of a game's that the units of `object` have.
fn own_materials(app: &App, object: Entity) -> Vec<AssetId<StandardMaterial>> {
    let units = app.world().get::<Children>(object).unwrap().iter();
    let material = |unit| app.world().get::<MeshMaterial3d<StandardMaterial>>(unit);
    let mut ids: Vec<_> = units.filter_map(material).map(|own| own.id()).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// The levels in which its units are painted: only painted ones have a tag.
fn painted_levels(app: &App, object: Entity) -> Vec<u32> {
    let units = app.world().get::<Children>(object).unwrap().iter();
    let tags = units.filter_map(|unit| app.world().get::<MeshTag>(unit));
    let mut levels: Vec<u32> = tags.map(|tag| tag.0 >> 24).collect();
    levels.sort_unstable();
    levels.dedup();
    levels
}

#[test]
fn painted_prop_gets_materials_back() {
    let mut app = app_with(FieldLodDebugPlugin);
    spawn_camera(&mut app, 50.0);
    let object = spawn_rock(&mut app, 4);
    insert(&mut app, object, MeshTag(77));
    ready(&mut app, 1);
    let material_and_tag = |app: &App| {
        let entity = app.world().entity(object);
        let own = entity.get::<MeshMaterial3d<StandardMaterial>>();
        (own.map(|own| own.id()), entity.get::<MeshTag>().unwrap().0)
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

#[test]
fn meshes_of_units_exist_while_units_are_drawn() {
    let (mut app, camera, _) = before_a_camera(6, 3.0);
    let counts = |app: &mut App| {
        let units = units(app).len();
        let meshes = app.world().resource::<Assets<Mesh>>().len();
        (meshes, units)
    };
    let near = counts(&mut app);
    // The source, and meshes of Bevy.
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
