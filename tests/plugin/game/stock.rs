//! Features of Bevy work with levels of detail.

use std::time::Duration;

use bevy::animation::{AnimatedBy, AnimationTargetId, animated_field};
use bevy::camera::visibility::{NoFrustumCulling, VisibilityRange};
use bevy::diagnostic::{Diagnostic, DiagnosticPath, DiagnosticsStore};
use bevy::ecs::component::Mutable;
use bevy::pbr::wireframe::Wireframe;
use bevy::pbr::{ExtendedMaterial, Lightmap, Material, MaterialExtension, MaterialPlugin};
use bevy::prelude::*;
use bevy::render::batching::NoAutomaticBatching;
use bevy::render::render_resource::AsBindGroup;
use bevy::time::TimeUpdateStrategy;
use bevy_fieldlod::diagnostics;
use bevy_fieldlod::prelude::*;

use crate::headless::{
    add, app, app_with, before_a_camera, entity_count, insert, minimal_app, move_camera, progress,
    ready, rock, spawn_camera, spawn_rock, stats, units, visible,
};

/// A custom material.
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug, Default)]
struct Glow {}

impl Material for Glow {}

/// An extension of the standard material.
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug, Default)]
struct Moss {}

impl MaterialExtension for Moss {}

/// Units inherit a material of any type, when they are spawned and when it changes.
fn inherits<M: Material + Default>()
where
    M::Data: PartialEq + Eq + std::hash::Hash + Clone,
{
    let mut app = app_with(MaterialPlugin::<M>::default());
    let camera = spawn_camera(&mut app, 3.0);
    let rock = spawn_rock(&mut app, 5);
    ready(&mut app, 1);
    let world = app.world_mut();
    let mut materials = world.resource_mut::<Assets<M>>();
    let first = materials.add(M::default());
    let second = materials.add(M::default());
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
                .get::<MeshMaterial3d<M>>()
                .map(|inherited| inherited.id());
            assert_eq!(inherited, Some(material.id()));
            assert!(!unit.contains::<MeshMaterial3d<StandardMaterial>>());
        }
        assert_eq!(stats(&app, camera).triangles_drawn, drawn);
    }
    // Units that are spawned later inherit it too.
    move_camera(&mut app, camera, 2.0);
    for unit in units(&mut app) {
        assert!(app.world().get::<MeshMaterial3d<M>>(unit).is_some());
    }
    let mut rock = app.world_mut().entity_mut(rock);
    rock.remove::<MeshMaterial3d<M>>();
    assert!(have_units::<MeshMaterial3d<M>>(&mut app, None));
}

#[test]
fn units_inherit_every_type_of_material() {
    inherits::<Glow>();
    inherits::<ExtendedMaterial<StandardMaterial, Moss>>();
}

/// A component that a renderer extension reads on every entity that it draws.
#[derive(Component, Clone, PartialEq, Debug)]
struct Outline(u8);

/// Draws a frame. Returns whether all units have this value of a component.
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
    let lightmap = Lightmap {
        uv_rect: Rect::new(0.0, 0.5, 0.5, 1.0),
        ..default()
    };
    insert(&mut app, rock, (NoAutomaticBatching, lightmap));
    app.update();
    for unit in units(&mut app) {
        let unit = app.world().entity(unit);
        assert!(unit.contains::<NoAutomaticBatching>());
        assert_eq!(unit.get::<Lightmap>().unwrap().uv_rect.min.y, 0.5);
    }
}

/// Animates the translation of `entity` from 0 to `place` within a second.
fn animate(app: &mut App, entity: Entity, place: Vec3) {
    let target = AnimationTargetId::from_name(&Name::new("rock"));
    let way = EasingCurve::new(Vec3::ZERO, place, EaseFunction::Linear);
    let mut clip = AnimationClip::default();
    let way = AnimatableCurve::new(animated_field!(Transform::translation), way);
    clip.add_curve_to_target(target, way);
    let world = app.world_mut();
    let clip = world.resource_mut::<Assets<AnimationClip>>().add(clip);
    let (graph, node) = AnimationGraph::from_clip(clip);
    let graph = world.resource_mut::<Assets<AnimationGraph>>().add(graph);
    let mut player = AnimationPlayer::default();
    player.play(node);
    let graph = AnimationGraphHandle(graph);
    let bundle = (player, graph, target, AnimatedBy(entity));
    world.entity_mut(entity).insert(bundle);
}

#[test]
fn animated_object_changes_its_cut() {
    for subdivisions in [4, 5] {
        let (mut app, camera, rock) = before_a_camera(subdivisions, 4.0);
        let before = stats(&app, camera).triangles_drawn;
        let tick = TimeUpdateStrategy::ManualDuration(Duration::from_millis(50));
        app.insert_resource(tick);
        animate(&mut app, rock, Vec3::new(0.0, 0.0, -200.0));
        let mut counts = Vec::new();
        for _ in 0..30 {
            app.update();
            let place = *app.world().get::<GlobalTransform>(rock).unwrap();
            for unit in visible(&app, camera) {
                assert_eq!(*app.world().get::<GlobalTransform>(unit).unwrap(), place);
            }
            counts.push(stats(&app, camera).triangles_drawn);
        }
        counts.dedup();
        assert!(
            counts.len() > 3 && counts.is_sorted_by(|a, b| a > b),
            "{counts:?}"
        );
        assert!(counts.last().unwrap() * 4 < before, "{counts:?}");
    }
}

#[test]
fn moved_parent_changes_cut() {
    for subdivisions in [4, 5] {
        let (mut app, camera, rock) = before_a_camera(subdivisions, 4.0);
        let before = stats(&app, camera).triangles_drawn;
        let root = app.world_mut().spawn(Transform::default()).id();
        insert(&mut app, root, Visibility::default());
        app.world_mut().entity_mut(root).add_child(rock);
        app.update();
        assert_eq!(progress(&app).ready, 1);
        let away = Transform::from_xyz(0.0, 0.0, -200.0);
        insert(&mut app, root, away);
        app.update();
        let stats = stats(&app, camera);
        assert!(stats.triangles_drawn * 2 < before, "{stats:?}");
    }
}

#[test]
fn larger_scale_needs_more_triangles() {
    for subdivisions in [4, 5] {
        let (mut app, camera, rock) = before_a_camera(subdivisions, 60.0);
        let small = stats(&app, camera).triangles_drawn;
        insert(&mut app, rock, Transform::from_scale(Vec3::splat(20.0)));
        app.update();
        assert!(stats(&app, camera).triangles_drawn > 2 * small);
    }
}

#[test]
fn visibility_ranges_of_other_objects_work() {
    let (mut app, camera, _) = before_a_camera(5, 4.0);
    let before = visible(&app, camera);
    let near = add(&mut app, rock(2, 3));
    let place = Transform::from_xyz(0.5, 0.0, 0.0);
    let mut spawn = |range| {
        let bundle = (Mesh3d(near.clone()), place, range);
        app.world_mut().spawn(bundle).id()
    };
    let shown = spawn(VisibilityRange::abrupt(0.0, 10.0));
    let hidden = spawn(VisibilityRange::abrupt(10.0, 20.0));
    app.update();
    app.update();
    let after = visible(&app, camera);
    assert!(after.contains(&shown) && !after.contains(&hidden));
    assert_eq!(after.len(), before.len() + 1);
}

#[test]
fn public_types_are_registered() {
    let app = app();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let names = [
        "AutoLod",
        "NoLod",
        "FieldLodCamera",
        "FieldLodViewStats",
        "LodUnit",
        "FieldLodAppConfig",
        "FieldLodProgress",
        "FieldLodDebug",
    ];
    for name in names {
        let registration = registry.get_with_short_type_path(name);
        let registration = registration.unwrap_or_else(|| panic!("{name} is not registered"));
        assert!(
            registration.data::<ReflectComponent>().is_some()
                || registration.data::<ReflectResource>().is_some(),
            "{name}"
        );
    }
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
    let mut app = minimal_app();
    let mesh = add(&mut app, rock(5, 1));
    app.world_mut().spawn((Mesh3d(mesh), AutoLod::default()));
    // Without a renderer, the camera has no size in pixels and is ignored.
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
