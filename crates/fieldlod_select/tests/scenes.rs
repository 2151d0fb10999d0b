//! Ids, layers, removals and unusual views of scenes, and the number of decisions in a frame.

mod common;

use common::world::{AnyWeights, Placed, World, step_of_walk};
use common::{hierarchies, look, orthographic, perspective, vector, with_advanced, zoomed};
use fieldlod_hierarchy::Sphere;
use fieldlod_select::{
    GroupTable, InstanceId, InstanceView, LodSettings, Offscreen, Scene, Selector, ShadowLight,
    Statistics, View,
};
use glam::{Affine3A, Vec3};
use proptest::prelude::*;

/// Settings whose cuts do not depend on the last cuts.
fn without_hysteresis() -> LodSettings {
    with_advanced(|advanced| (advanced.hysteresis, advanced.edge_hysteresis) = (1.0, 0.0))
}

fn one_view() -> View {
    look(perspective(1.0), Vec3::new(0.3, 0.2, 6.0), Vec3::ZERO)
}

#[test]
fn ids_are_unique_and_indices_are_reused() {
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(&hierarchies()[3]);
    let first = scene.add_instance(mesh, Affine3A::IDENTITY, 1.0);
    scene.remove(first);
    let second = scene.add_instance(mesh, Affine3A::IDENTITY, 1.0);
    assert_eq!(first.index(), second.index());
    assert_ne!(first, second);
    // Changes by the first id do not affect the second instance.
    scene.remove(first);
    scene.set_placement(first, Affine3A::from_translation(Vec3::splat(1e6)));
    scene.update();
    let mut selector = Selector::default();
    selector.select(&scene, &one_view(), &LodSettings::default());
    assert!(selector.units(&scene, first).is_empty());
    assert!(selector.units(&scene, second).len() > 1);
}

#[test]
fn ids_of_removed_meshes_are_reused() {
    let mut scene = Scene::default();
    let [first, second] = [0, 1].map(|which| scene.add_mesh(&hierarchies()[which]));
    scene.remove_mesh(first);
    scene.remove_mesh(first);
    let third = scene.add_mesh(&hierarchies()[2]);
    assert_eq!(third, first);
    let fourth = scene.add_mesh(&hierarchies()[3]);
    assert!(fourth != third && fourth != second);
}

#[test]
fn units_leave_with_their_instance_and_mesh() {
    let mut scene = Scene::default();
    // As units, as a whole mesh, and at the coarsest level.
    let far = Affine3A::from_translation(Vec3::Z * -1e6);
    let near = Affine3A::IDENTITY;
    for (which, placement) in [(0, near), (5, near), (0, far)] {
        let mesh = scene.add_table(GroupTable::new(&hierarchies()[which]));
        let id = scene.add_instance(mesh, placement, 1.0);
        scene.update();
        let mut selector = Selector::default();
        selector.select(&scene, &one_view(), &LodSettings::default());
        let drawn = selector.units(&scene, id).to_vec();
        assert!(!drawn.is_empty());
        scene.remove(id);
        scene.remove_mesh(mesh);
        scene.update();
        selector.select(&scene, &one_view(), &LodSettings::default());
        let changes: Vec<_> = selector.changes().collect();
        assert_eq!(changes.len(), 1);
        assert_eq!((changes[0].instance, changes[0].left), (id, &drawn[..]));
        assert!(changes[0].entered.is_empty() && selector.units(&scene, id).is_empty());
        assert_eq!(selector.triangle_count(), 0);
    }
}

#[test]
fn still_camera_decides_nothing_and_walk_decides_few() {
    // Instances in units are decided in each frame while finer than the coarsest level, whole meshes near a change.
    for (mesh, side, decided_per_finer) in [(0, 30, 1.1), (5, 60, 0.5)] {
        let world = World::forest(mesh, side, 9.0);
        let settings = LodSettings::default();
        let mut selector = world.select(&step_of_walk(0), &settings);
        let count = usize::from(side * side);
        assert_eq!(selector.changes().count(), count);
        selector.select(&world.scene, &step_of_walk(0), &settings);
        assert_eq!(selector.statistics(), Statistics::default());
        assert_eq!(selector.changes().count(), 0);
        let coarsest =
            world.cuts(&world.select(&step_of_walk(0), &LodSettings::with_error_px(f32::INFINITY)));
        let (mut decided, mut finer) = (0, 0);
        for step in 1..60 {
            selector.select(&world.scene, &step_of_walk(step), &settings);
            decided += selector.statistics().instances_decided;
            let cuts = world.cuts(&selector);
            finer += cuts.iter().zip(&coarsest).filter(|(a, b)| a != b).count();
        }
        assert!(finer > 59 * 20, "mesh {mesh}: {finer}");
        let most = finer as f32 * decided_per_finer;
        assert!((decided as f32) < most, "mesh {mesh}: {decided} of {finer}");
    }
}

#[test]
fn instances_on_other_layers_are_skipped_until_shown() {
    let mut world = World::forest(3, 40, 3.0);
    let set_layers = |world: &mut World, layers| {
        for id in world.ids() {
            world.scene.set_layers(id, layers);
        }
        world.scene.update();
    };
    set_layers(&mut world, 0);
    let settings = LodSettings::default();
    let mut selector = Selector::default();
    for step in 0..50 {
        selector.select(&world.scene, &step_of_walk(step), &settings);
        assert_eq!(selector.statistics().instances_decided, 0);
        assert_eq!(selector.changes().count(), 0);
    }
    // Instances are drawn in the frame in which their layers are shown.
    set_layers(&mut world, u64::MAX);
    selector.select(&world.scene, &step_of_walk(50), &settings);
    let shown = world.select(&step_of_walk(50), &settings);
    assert_eq!(world.cuts(&selector), world.cuts(&shown));
    assert_eq!(selector.changes().count(), 1600);
}

#[test]
fn view_of_nan_refines_all_and_recovers() {
    let world = World::new(&[Placed::new(0, Affine3A::IDENTITY)]);
    let settings = without_hysteresis();
    let mut selector = world.select(&one_view(), &settings);
    let before = world.cuts(&selector);
    let nowhere = Affine3A::from_translation(Vec3::splat(f32::NAN));
    let nowhere = View::new(perspective(1.0), &nowhere);
    selector.select(&world.scene, &nowhere, &settings);
    let all = hierarchies()[0].source_triangle_count();
    assert_eq!(selector.triangle_count(), all);
    selector.select(&world.scene, &one_view(), &settings);
    assert_eq!(world.cuts(&selector), before);
}

#[test]
fn levels_equal_fresh_ones_after_other_settings() {
    let mut world = World::forest(5, 30, 9.0);
    let free = without_hysteresis();
    let forced = LodSettings {
        forced_level: Some(3),
        ..free
    };
    let mut selector = Selector::default();
    for step in 0..40u16 {
        let phase = step / 5 % 4;
        let settings = if phase == 3 { forced } else { free };
        let view = step_of_walk(step);
        let mut fresh = Selector::default();
        for selector in [&mut selector, &mut fresh] {
            let weights = &mut AnyWeights(step.into());
            match phase {
                1 => selector.select_weighed(&world.scene, &view, &settings, weights),
                _ => selector.select(&world.scene, &view, &settings),
            }
        }
        assert_eq!(world.cuts(&selector), world.cuts(&fresh), "step {step}");
    }
    // Loaded in parts: missing levels fall back to the finest available level.
    let view = step_of_walk(40);
    let wanted = world.cuts(&world.select(&view, &free));
    for finest in [5, 7, 0] {
        world
            .scene
            .set_available(world.meshes[5], |group| group >= finest);
        selector.select(&world.scene, &view, &free);
        let available = wanted.iter().map(|drawn| vec![drawn[0].max(finest)]);
        assert_eq!(world.cuts(&selector), available.collect::<Vec<_>>());
    }
    // The unit of its level leaves with a removed instance.
    let id = world.ids()[0];
    let level = selector.units(&world.scene, id).to_vec();
    world.scene.remove(id);
    world.scene.update();
    selector.select(&world.scene, &view, &free);
    let changes: Vec<_> = selector.changes().collect();
    assert_eq!(changes.len(), 1);
    assert_eq!((changes[0].instance, changes[0].left), (id, &level[..]));
}

/// Whether any sample point of a sphere swept along a direction is in a view.
fn may_cast(center: Vec3, radius: f32, direction: Vec3, sees: &impl Fn(Vec3) -> bool) -> bool {
    let axes = Vec3::AXES.map(|axis| [axis, -axis]);
    let ring = axes.as_flattened().iter().chain([&Vec3::ZERO]);
    let steps = (0u16..600).map(|step| f32::from(step) * 0.5);
    let mut points = steps.flat_map(|way| {
        let around = ring.clone();
        around.map(move |out| center + *out * radius + direction * way)
    });
    points.any(sees)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    /// An instance that may cast a shadow into the view has the same cut as without a list of lights.
    #[test]
    fn shadow_casters_keep_their_cuts(
        places in prop::collection::vec(vector(), 60..120),
        (eye, step, turn) in (vector(), vector(), vector()),
        (sun, lamp, by_lamp) in (vector(), vector(), any::<bool>()),
        is_orthographic in any::<bool>(),
        (pace, zoom) in (prop_oneof![Just(1.0f32), Just(0.05f32)], prop_oneof![Just(0.0f32), -0.02f32..0.02]),
    ) {
        let mut scene = Scene::default();
        // As units and as a whole mesh.
        let rock = &hierarchies()[0];
        let meshes = [scene.add_mesh(rock), scene.add_mesh(&rock.whole_mesh_levels().unwrap())];
        let rocks: Vec<(InstanceId, Vec3)> = places.iter().zip(meshes.iter().cycle()).map(|(place, mesh)| {
            let at = *place * 30.0;
            (scene.add_instance(*mesh, Affine3A::from_translation(at), 1.0), at)
        }).collect();
        scene.update();
        let mut settings = without_hysteresis();
        settings.advanced.offscreen = Offscreen::OnAxis { bias: 1.0 };
        let (mut all, mut lit) = (Selector::default(), Selector::default());
        let mut fewer = 0;
        let lens = if is_orthographic { orthographic() } else { perspective(0.8) };
        for frame in 0u8..16 {
            let lens = zoomed(lens, 1.0 + zoom * f32::from(frame));
            let frame = f32::from(frame) * pace;
            let at = eye * 10.0 + step * frame;
            let view = look(lens, at, at + Vec3::NEG_Z * 5.0 + turn * frame * 0.3);
            let direction = (sun + Vec3::Y * 0.01 * frame + Vec3::splat(0.011)).normalize();
            let reach = Sphere { center: lamp * 20.0 + step * frame, radius: 12.0 };
            let light = if by_lamp { ShadowLight::Lamp(reach) } else { ShadowLight::Sun(direction) };
            all.select(&scene, &view, &settings);
            lit.select(&scene, &view.with_shadow_lights(&[light]), &settings);
            let seen = InstanceView::new(&view, &Affine3A::IDENTITY);
            let sees = |point: Vec3| {
                let point = seen.sphere_in_camera(&Sphere { center: point, radius: 0.0 }).center;
                view.camera().contains(point)
            };
            for &(rock, place) in &rocks {
                let (of_all, of_lit) = (all.units(&scene, rock), lit.units(&scene, rock));
                let casts = if by_lamp {
                    place.distance(reach.center) < reach.radius
                } else {
                    may_cast(place, 0.9, direction, &sees)
                };
                prop_assert!(of_all == of_lit || !casts && !sees(place));
                prop_assert!(of_lit.len() <= of_all.len());
                fewer += usize::from(of_all != of_lit);
            }
        }
        prop_assert!(!by_lamp || fewer > 0);
    }
}
