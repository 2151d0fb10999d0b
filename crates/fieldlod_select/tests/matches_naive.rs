//! Fast paths equal the specification: the groups of one instance, changing scenes, and walks.

mod common;

use common::world::{AnyWeights, Placed, Watcher, World};
use common::{
    HIERARCHIES, any_camera, any_orthographic, any_placement, any_settings, any_view, hierarchies,
    look, perspective, unmeasured, vector, zoomed,
};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{
    AdvancedSettings, GroupTable, InstanceView, LodSettings, Scene, Selector, group_error_px,
    refine,
};
use glam::{Affine3A, Quat, Vec3, Vec3A};
use proptest::prelude::*;
use rayon::prelude::*;

fn any_placed(reach: f32) -> impl Strategy<Value = Placed> {
    let bias = prop_oneof![3 => Just(1.0f32), 1 => 0.2f32..4.0];
    (0usize..HIERARCHIES, any_placement(), vector(), bias).prop_map(
        move |(mesh, placement, shift, bias)| {
            let shift = Affine3A::from_translation(shift * shift.length() * reach);
            Placed {
                bias,
                ..Placed::new(mesh, shift * placement)
            }
        },
    )
}

#[derive(Clone, Debug)]
enum Event {
    Add(Vec<Placed>),
    /// Every n-th instance.
    Remove(usize),
    /// Removes every n-th instance, and adds others.
    Replace(usize, Vec<Placed>),
    Move(usize, Vec3),
    Bias(usize, f32),
    Layers(usize, u64),
    Nothing,
}

fn any_event() -> impl Strategy<Value = Event> {
    let some = || prop::collection::vec(any_placed(50.0), 1..6);
    prop_oneof![
        2 => some().prop_map(Event::Add),
        1 => prop::collection::vec(any_placed(50.0), 100..140).prop_map(Event::Add),
        2 => (1usize..10).prop_map(Event::Remove),
        2 => (1usize..10, some()).prop_map(|(n, placed)| Event::Replace(n, placed)),
        2 => (1usize..10, vector()).prop_map(|(n, by)| Event::Move(n, by * 20.0)),
        1 => (1usize..10, 0.2f32..4.0).prop_map(|(n, bias)| Event::Bias(n, bias)),
        2 => (1usize..4, 0u64..4).prop_map(|(n, layers)| Event::Layers(n, layers)),
        1 => Just(Event::Nothing),
    ]
}

fn apply(world: &mut World, event: &Event) {
    let every = |n: &usize| world.ids().into_iter().step_by(*n).collect::<Vec<_>>();
    let ids = match event {
        Event::Remove(n)
        | Event::Replace(n, _)
        | Event::Move(n, _)
        | Event::Bias(n, _)
        | Event::Layers(n, _) => every(n),
        Event::Add(_) | Event::Nothing => Vec::new(),
    };
    for id in ids {
        let (scene, placed) = (&mut world.scene, world.placed.get_mut(&id).unwrap());
        match event {
            Event::Move(_, by) => {
                placed.placement.translation += Vec3A::from(*by);
                scene.set_placement(id, placed.placement);
            }
            Event::Bias(_, bias) => {
                placed.bias = *bias;
                scene.set_bias(id, *bias);
            }
            Event::Layers(_, layers) => {
                placed.layers = *layers;
                scene.set_layers(id, *layers);
            }
            _ => {
                scene.remove(id);
                world.placed.remove(&id);
            }
        }
    }
    if let Event::Add(placed) | Event::Replace(_, placed) = event {
        world.add(placed);
    }
    world.scene.update();
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 80, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn views_of_a_changing_scene_equal_naive(
        cameras in prop::array::uniform3((any_camera(), vector(), any_settings())),
        forced_level in prop::option::weighted(0.1, 0u32..4),
        events in prop::collection::vec(any_event(), 6..14),
        walk in vector(),
    ) {
        let mut world = World::new(&[]);
        let mut watchers = cameras.map(|(camera, eye, settings)| {
            Watcher::new(look(camera, eye * 30.0, Vec3::new(0.1, 0.0, 0.2)), settings)
        });
        watchers[0].settings.forced_level = forced_level;
        for (step, event) in (0u8..).zip(&events) {
            apply(&mut world, event);
            // The third view skips every other frame.
            let watching = if step % 2 == 0 { 3 } else { 2 };
            watchers[1].view = look(cameras[1].0, cameras[1].1 * 30.0 + walk * f32::from(step), Vec3::X);
            let layers = [u64::MAX, [u64::MAX, 1, 1, 2][usize::from(step % 4)], u64::MAX];
            let views = watchers[..watching].par_iter_mut().zip(layers);
            views.for_each(|(watcher, layers)| watcher.check(&world, layers));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 180, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn jumps_and_steps_with_weights_equal_naive(
        placed in prop::collection::vec(any_placed(100.0), 1..60),
        mut camera in any_camera(),
        (settings, is_weighed) in (any_settings(), prop::bool::weighted(0.7)),
        (start, reach) in (vector(), prop_oneof![Just(1.0f32), Just(30.0f32)]),
        steps in prop::collection::vec((vector(), vector(), 0u8..10), 8..20),
    ) {
        let mut world = World::new(&placed);
        let (mut eye, mut target) = (start * reach, Vec3::Z * -30.0);
        let mut watcher = Watcher::new(look(camera, eye, target), settings);
        watcher.weights = is_weighed.then_some(AnyWeights(0));
        for (go, turn, event) in steps {
            // Mostly small steps; sometimes a jump, a standstill or a moved object.
            match event {
                0 => eye += go * 50.0,
                1 => {}
                2 => apply(&mut world, &Event::Move(placed.len(), go)),
                3 => target += turn * 30.0,
                4 => camera = zoomed(camera, 1.0 + turn.x * 0.02),
                _ => {
                    eye += go * 0.1;
                    target += turn * 0.1;
                }
            }
            watcher.view = look(camera, eye, target + Vec3::new(0.1, 0.0, 0.2));
            watcher.check(&world, u64::MAX);
        }
    }

    #[test]
    fn smooth_walks_equal_naive(
        places in prop::collection::vec((vector(), 0.2f32..4.0), 100),
        camera in prop_oneof![any_camera(), any_orthographic(), Just(perspective(1.0))],
        (settings, is_plain) in (any_settings(), any::<bool>()),
        reach in prop_oneof![10.0f32..100.0, 100.0f32..2000.0],
        (start, go) in (vector(), vector()),
        (towards, turn) in (vector(), vector()),
        (pace, turn_pace) in (prop_oneof![Just(0.0f32), 1e-4f32..0.02], prop_oneof![Just(0.0f32), 1e-4f32..0.1]),
        zoom in prop_oneof![2 => Just(0.0f32), 1 => -1e-3f32..1e-3, 1 => -0.05f32..0.05],
        (mesh, count) in prop_oneof![1 => Just((5, 100)), 2 => (0..HIERARCHIES, Just(12))],
    ) {
        let mut settings = settings;
        if is_plain {
            settings.advanced = AdvancedSettings { min_aspect_ratio: 0.0, max_curl: 0.0, ..settings.advanced };
        }
        let place = |(place, size): &(Vec3, f32)| {
            let turn = Quat::from_rotation_y(place.x * 9.0);
            let placement = Affine3A::from_scale_rotation_translation(Vec3::splat(*size), turn, *place * reach);
            Placed::new(mesh, placement)
        };
        let world = World::new(&places.iter().take(count).map(place).collect::<Vec<_>>());
        let mut watcher = Watcher::new(look(camera, start, start + Vec3::X), settings);
        for frame in 0u8..40 {
            // The camera walks, then turns, then does both, then stands, with some zooms.
            let way = f32::from(frame.min(10) + frame.saturating_sub(20).min(10));
            let turned = f32::from(frame.saturating_sub(10).min(20));
            let eye = start * reach * 0.2 + go * reach * pace * way;
            let ahead = towards + Vec3::new(0.01, 0.02, 0.03) + turn * turn_pace * turned;
            let zoom = 1.0 + zoom * f32::from(frame % 16).min(8.0);
            watcher.view = look(zoomed(camera, zoom), eye, eye + ahead * reach);
            watcher.check(&world, u64::MAX);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn lanes_and_bounds_equal_the_scalar_criterion(
        which in 0usize..HIERARCHIES,
        view in any_view(),
        placement in any_placement(),
        settings in any_settings(),
        was in prop_oneof![Just(0u64), Just(u64::MAX), any::<u64>()],
    ) {
        let hierarchy = &hierarchies()[which];
        let table = GroupTable::new(hierarchy);
        let instance = InstanceView::new(&view.with_margins(&settings), &placement);
        let was_refined = vec![was; hierarchy.groups.len().div_ceil(64)];
        let mut refined = Vec::new();
        refine(&table, &instance, &settings, &was_refined, &mut refined);
        let threshold_px = settings.threshold_px() / settings.resolution_scale;
        for (index, group) in hierarchy.groups.iter().enumerate() {
            let bit = |words: &[u64]| words[index / 64] >> (index % 64) & 1 == 1;
            let error_px = group_error_px(group, &instance, &settings, bit(&was_refined));
            let threshold_px = if bit(&was_refined) { threshold_px * settings.advanced.hysteresis } else { threshold_px };
            let expected = group.is_terminal() || error_px > threshold_px || error_px.is_nan();
            prop_assert_eq!(bit(&refined), expected, "group {}: {} px against {} px, {:?}", index, error_px, threshold_px, settings);
        }
    }
}

#[test]
fn later_deviations_select_as_in_a_new_scene() {
    let settings = LodSettings {
        advanced: AdvancedSettings {
            hysteresis: 1.0,
            ..AdvancedSettings::default()
        },
        ..LodSettings::guaranteed(4.0)
    };
    let view = look(perspective(1.0), Vec3::Z * 20.0, Vec3::ZERO);
    let select = |scene: &mut Scene, selector: &mut Selector, id| {
        scene.update();
        selector.select(scene, &view, &settings);
        selector.units(scene, id).to_vec()
    };
    // Units, and a chain of whole meshes.
    for hierarchy in [3, 5].map(|index| &hierarchies()[index]) {
        let scene_of = |hierarchy: &Hierarchy| {
            let mut scene = Scene::default();
            let mesh = scene.add_mesh(hierarchy);
            let id = scene.add_instance(mesh, Affine3A::IDENTITY, 1.0);
            (scene, mesh, id)
        };
        let (mut measured, _, measured_id) = scene_of(hierarchy);
        let (mut later, mesh, id) = scene_of(&unmeasured(hierarchy.clone()));
        let mut selector = Selector::default();
        let in_full = select(&mut later, &mut selector, id);
        assert!(later.replace_table(mesh, GroupTable::new(hierarchy)));
        let cut = select(&mut later, &mut selector, id);
        assert!(cut != in_full);
        assert_eq!(
            cut,
            select(&mut measured, &mut Selector::default(), measured_id)
        );
        // Other levels would not fit what is drawn.
        assert!(!later.replace_table(mesh, GroupTable::new(&hierarchies()[0])));
    }
}
