//! What works in Bevy goes on working with levels of detail.

use bevy::asset::AssetPlugin;
use bevy::camera::CameraPlugin;
use bevy::camera::visibility::{NoCpuCulling, NoFrustumCulling, VisibilityRange};
use bevy::diagnostic::{Diagnostic, DiagnosticPath, DiagnosticsStore};
use bevy::ecs::component::Mutable;
use bevy::ecs::system::RunSystemOnce;
use bevy::mesh::MeshPlugin;
use bevy::pbr::wireframe::Wireframe;
use bevy::pbr::{Material, MaterialPlugin};
use bevy::picking::mesh_picking::ray_cast::{MeshRayCast, MeshRayCastSettings};
use bevy::prelude::*;
use bevy::render::batching::NoAutomaticBatching;
use bevy::render::render_resource::AsBindGroup;
use bevy_fieldlod::diagnostics;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::finish;

use crate::headless::{
    add, app, before_a_camera, entity_count, insert, move_camera, progress, ready, rock,
    spawn_camera, spawn_rock, stats, unfinished, units, visible,
};

/// A material of a game's own.
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug, Default)]
struct Glow {}

impl Material for Glow {}

#[test]
fn units_inherit_a_custom_material() {
    let mut app = unfinished(AssetPlugin::default());
    app.add_plugins(MaterialPlugin::<Glow>::default());
    finish(&mut app);
    let camera = spawn_camera(&mut app, 3.0);
    let rock = spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    let world = app.world_mut();
    let mut materials = world.resource_mut::<Assets<Glow>>();
    let first = materials.add(Glow::default());
    let second = materials.add(Glow::default());
    let drawn = stats(&app, camera).triangles_drawn;
    for material in [first, second] {
        app.world_mut()
            .entity_mut(rock)
            .remove::<MeshMaterial3d<StandardMaterial>>()
            .insert(MeshMaterial3d(material.clone()));
        app.update();
        let units = units(&mut app);
        assert!(!units.is_empty());
        for unit in units {
            let unit = app.world().entity(unit);
            let inherited = unit
                .get::<MeshMaterial3d<Glow>>()
                .map(|inherited| inherited.id());
            assert_eq!(inherited, Some(material.id()));
            assert!(!unit.contains::<MeshMaterial3d<StandardMaterial>>());
        }
        assert_eq!(stats(&app, camera).triangles_drawn, drawn);
    }
    // Units that are spawned later inherit it too.
    move_camera(&mut app, camera, 2.0);
    for unit in units(&mut app) {
        assert!(app.world().get::<MeshMaterial3d<Glow>>(unit).is_some());
    }
}

/// What a renderer extension of a game's reads on every entity that it draws.
#[derive(Component, Clone, PartialEq, Debug)]
struct Outline(u8);

/// Whether all units have a component that the object has.
fn have_units<C: Component + Clone + PartialEq>(app: &mut App, expected: Option<&C>) -> bool {
    app.update();
    let units = units(app);
    !units.is_empty()
        && units
            .iter()
            .all(|unit| app.world().get::<C>(*unit) == expected)
}

fn follows<C: Component<Mutability = Mutable> + Clone + PartialEq>(
    app: &mut App,
    object: Entity,
    values: [C; 2],
) {
    let [first, second] = values;
    insert(app, object, first.clone());
    assert!(have_units(app, Some(&first)));
    *app.world_mut().get_mut::<C>(object).unwrap() = second.clone();
    assert!(have_units(app, Some(&second)));
    app.world_mut().entity_mut(object).remove::<C>();
    assert!(have_units::<C>(app, None));
}

#[test]
fn units_inherit_and_follow_components() {
    let mut app = app();
    app.inherit_in_lod_units::<Outline>();
    spawn_camera(&mut app, 4.0);
    let rock = spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    follows(&mut app, rock, [1, 2].map(Outline));
    follows(
        &mut app,
        rock,
        [50.0, 60.0].map(|end| VisibilityRange::abrupt(0.0, end)),
    );
    follows(&mut app, rock, [Wireframe, Wireframe]);
    insert(&mut app, rock, NoAutomaticBatching);
    app.update();
    let has = |unit: Entity| app.world().entity(unit).contains::<NoAutomaticBatching>();
    let children = app.world().get::<Children>(rock).unwrap();
    assert!(children.iter().all(has));
}

#[test]
fn units_inherit_visibility() {
    for subdivisions in [4, 5] {
        let (mut app, camera, rock) = before_a_camera(subdivisions, 4.0);
        let before = visible(&app, camera);
        assert!(!before.is_empty());
        let root = app.world_mut().spawn(Visibility::Visible).id();
        app.world_mut().entity_mut(root).add_child(rock);
        for (visibility, expected) in [
            (Visibility::Hidden, Vec::new()),
            (Visibility::Visible, before),
        ] {
            *app.world_mut().get_mut::<Visibility>(root).unwrap() = visibility;
            app.update();
            app.update();
            assert_eq!(visible(&app, camera), expected);
        }
    }
}

#[test]
fn units_inherit_no_frustum_culling() {
    for subdivisions in [4, 5] {
        let (mut app, camera, rock) = before_a_camera(subdivisions, 4.0);
        let behind = Transform::from_xyz(0.0, 0.0, 50.0);
        insert(&mut app, rock, behind);
        app.update();
        app.update();
        assert_eq!(visible(&app, camera), []);
        insert(&mut app, rock, NoFrustumCulling);
        app.update();
        app.update();
        assert!(!visible(&app, camera).is_empty());
    }
}

#[test]
fn reparented_entities_gain_and_lose_levels() {
    let mut app = app();
    spawn_camera(&mut app, 40.0);
    let mesh = add(&mut app, rock(5, 1));
    let world = app.world_mut();
    let rock = world.spawn(Mesh3d(mesh)).id();
    let bundle = (
        AutoLod::default(),
        Transform::default(),
        Visibility::default(),
    );
    let root = world.spawn(bundle).id();
    app.update();
    assert_eq!(progress(&app), FieldLodProgress::default());
    app.world_mut().entity_mut(root).add_child(rock);
    ready(&mut app, 1);
    assert!(entity_count(&mut app) > 1);
    app.world_mut().entity_mut(rock).remove::<ChildOf>();
    app.update();
    app.update();
    assert_eq!(progress(&app), FieldLodProgress::default());
    assert_eq!(entity_count(&mut app), 1);
}

#[test]
fn headless_app_prepares_meshes() {
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        AssetPlugin::default(),
        TransformPlugin,
        MeshPlugin,
        CameraPlugin,
        FieldLodPlugin,
    ));
    app.finish();
    app.cleanup();
    let mesh = add(&mut app, rock(5, 1));
    app.world_mut().spawn((Mesh3d(mesh), AutoLod::default()));
    // Nobody computes a camera's projection here: it draws in full.
    app.world_mut().spawn(Camera3d::default());
    ready(&mut app, 1);
}

#[test]
fn diagnostics_equal_view_statistics() {
    let (mut app, camera, _) = before_a_camera(5, 4.0);
    app.update();
    let stats = stats(&app, camera);
    let store = app.world().resource::<DiagnosticsStore>();
    let value = |path: &DiagnosticPath| store.get(path).and_then(Diagnostic::value);
    for (path, expected) in [
        (&diagnostics::TRIANGLES_DRAWN, stats.triangles_drawn as f64),
        (&diagnostics::TRIANGLES_FULL, stats.triangles_full as f64),
        (&diagnostics::UNITS_DRAWN, f64::from(stats.units_drawn)),
    ] {
        assert!(path.as_str().starts_with("field_lod/"));
        assert_eq!(value(path), Some(expected), "{path}");
    }
    assert!(value(&diagnostics::SELECTION_MS).is_some_and(|ms| ms > 0.0));
}

/// What a ray down the middle of the picture hits.
fn pick(app: &mut App) -> Vec<(Entity, f32)> {
    let ray = Ray3d::new(Vec3::new(0.01, 0.02, 50.0), Dir3::NEG_Z);
    let cast = move |mut caster: MeshRayCast| {
        let hits = caster.cast_ray(ray, &MeshRayCastSettings::default());
        let hits = hits.iter().map(|(entity, hit)| (*entity, hit.distance));
        hits.collect::<Vec<_>>()
    };
    app.world_mut().run_system_once(cast).unwrap()
}

#[test]
fn rays_hit_mesh_entity_at_its_surface() {
    for subdivisions in [4, 5] {
        let mut app = app();
        spawn_camera(&mut app, 12.0);
        let rock = spawn_rock(&mut app, subdivisions);
        app.update();
        app.update();
        let before = pick(&mut app);
        assert_eq!(before[0].0, rock);
        ready(&mut app, 1);
        let after = pick(&mut app);
        // Without a renderer, units keep their data, and rays hit them too: at the same place here.
        assert!(after.iter().any(|(entity, _)| *entity == rock), "{after:?}");
        assert!(
            (after[0].1 - before[0].1).abs() < 0.02,
            "{before:?} {after:?}"
        );
    }
}

#[test]
fn no_cpu_culling_entities_are_not_listed() {
    let (mut app, camera, rock) = before_a_camera(4, 12.0);
    assert_eq!(visible(&app, camera), [rock]);
    insert(&mut app, rock, NoCpuCulling);
    app.update();
    app.update();
    assert_eq!(visible(&app, camera), []);
}
