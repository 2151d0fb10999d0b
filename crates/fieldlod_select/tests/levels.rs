//! The cuts of a walk are those of one instance at a time; levels of whole meshes go on where something else decides
//! for a while.

mod common;

use common::{
    HIERARCHIES, any_camera, any_orthographic, any_settings, hierarchies, look, perspective,
    synthetic, vector, zoomed,
};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{
    AdvancedSettings, Cut, InstanceId, LodSettings, Scene, Selector, View, VisibleFlux, select,
};
use glam::{Affine3A, Quat, Vec3};
use proptest::prelude::*;

/// A field of props.
struct Field {
    hierarchy: Hierarchy,
    scene: Scene,
    placements: Vec<Affine3A>,
    ids: Vec<InstanceId>,
}

impl Field {
    fn new(placements: Vec<Affine3A>) -> Self {
        Self::of(synthetic::whole_mesh_levels(9, 0.004), placements)
    }

    fn of(hierarchy: Hierarchy, placements: Vec<Affine3A>) -> Self {
        let mut scene = Scene::default();
        let mesh = scene.add_mesh(&hierarchy);
        let place = |placement: &Affine3A| scene.add_instance(mesh, *placement, 1.0);
        let ids = placements.iter().map(place).collect();
        scene.update();
        Self {
            hierarchy,
            scene,
            placements,
            ids,
        }
    }

    /// A square of them around a place ahead.
    fn square(side: u8) -> Self {
        Self::new(Self::places_in_square(side))
    }

    fn places_in_square(side: u8) -> Vec<Affine3A> {
        let cells = (0..side).flat_map(|x| (0..side).map(move |z| (f32::from(x), f32::from(z))));
        let place = |(x, z): (f32, f32)| {
            let middle = f32::from(side) * 0.5;
            let turn = Quat::from_rotation_y(x + z);
            Affine3A::from_rotation_translation(turn, Vec3::new(x - middle, 0.0, -z) * 9.0)
        };
        cells.map(place).collect()
    }

    fn levels(&self, selector: &Selector) -> Vec<Vec<u32>> {
        let ids = self.ids.iter();
        ids.map(|&id| selector.units(&self.scene, id).to_vec())
            .collect()
    }

    /// What selection without memory draws.
    fn fresh_levels(&self, view: &View, settings: &LodSettings) -> Vec<Vec<u32>> {
        let mut selector = Selector::default();
        selector.select(&self.scene, view, settings);
        self.levels(&selector)
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn walk_cuts_equal_naive_cuts(
        places in prop::collection::vec((vector(), 0.2f32..4.0), 150),
        camera in prop_oneof![any_camera(), any_orthographic(), Just(perspective(1.0))],
        (settings, is_plain) in (any_settings(), any::<bool>()),
        reach in prop_oneof![10.0f32..100.0, 100.0f32..2000.0],
        (start, go) in (vector(), vector()),
        (towards, turn) in (vector(), vector()),
        (pace, turn_pace) in (prop_oneof![Just(0.0f32), 1e-4f32..0.02], prop_oneof![Just(0.0f32), 1e-4f32..0.1]),
        zoom in prop_oneof![2 => Just(0.0f32), 1 => -1e-3f32..1e-3, 1 => -0.05f32..0.05],
        clusters in prop_oneof![1 => Just(None), 2 => (0..HIERARCHIES).prop_map(Some)],
    ) {
        let settings = if is_plain {
            LodSettings { advanced: AdvancedSettings { min_aspect_ratio: 0.0, max_curl: 0.0, ..settings.advanced }, ..settings }
        } else {
            settings
        };
        let place = |(place, size): &(Vec3, f32)| {
            let turn = Quat::from_rotation_y(place.x * 9.0);
            Affine3A::from_scale_rotation_translation(Vec3::splat(*size), turn, *place * reach)
        };
        let places = places.iter().map(place);
        let field = match clusters {
            None => Field::new(places.collect()),
            Some(mesh) => Field::of(hierarchies()[mesh].clone(), places.take(12).collect()),
        };
        let mut cuts = vec![Cut::default(); field.ids.len()];
        let mut selector = Selector::default();
        let mut followed = vec![Vec::new(); field.ids.len()];
        for frame in 0u8..40 {
            // It goes alone, turns alone, does both, and stands; and zooms now and then.
            let way = f32::from(frame.min(10) + frame.saturating_sub(20).min(10));
            let turned = f32::from(frame.saturating_sub(10).min(20));
            let eye = start * reach * 0.2 + go * reach * pace * way;
            let ahead = towards + Vec3::new(0.01, 0.02, 0.03) + turn * turn_pace * turned;
            let zoom = 1.0 + zoom * f32::from(frame % 16).min(8.0);
            let view = look(zoomed(camera, zoom), eye, eye + ahead * reach);
            selector.select(&field.scene, &view, &settings);
            for (cut, placement) in cuts.iter_mut().zip(&field.placements) {
                select(&field.hierarchy, placement, &view, &settings, cut);
            }
            let expected: Vec<Vec<u32>> = cuts.iter().map(|cut| cut.units().to_vec()).collect();
            prop_assert_eq!(field.levels(&selector), &expected[..]);
            for change in selector.changes() {
                let drawn: &mut Vec<u32> = &mut followed[change.instance.index()];
                drawn.retain(|unit| !change.left.contains(unit));
                drawn.extend(change.entered);
                drawn.sort_unstable();
            }
            prop_assert_eq!(&followed, &expected);
            let triangles: u64 = cuts.iter().map(Cut::triangle_count).sum();
            prop_assert_eq!(selector.triangle_count(), triangles);
        }
    }
}

fn view_at(step: u16) -> View {
    let eye = Vec3::new(f32::from(step) * 0.03, 1.7, 0.0);
    let ahead = Vec3::new(f32::from(step) * 0.0015, -0.05, -1.0);
    look(perspective(1.0), eye, eye + ahead)
}

/// The others pass the test for the next frames.
#[test]
fn walk_decides_few_of_many_clusters() {
    let field = Field::of(hierarchies()[0].clone(), Field::places_in_square(30));
    let mut selector = Selector::default();
    let (mut decided, mut mixed) = (0, 0);
    for step in 0..60 {
        selector.select(&field.scene, &view_at(step), &LodSettings::default());
        if step > 0 {
            decided += selector.statistics().instances_decided;
            let cuts = field.levels(&selector);
            mixed += cuts.iter().filter(|units| units.len() > 1).count();
        }
    }
    assert!(mixed > 59 * 20, "{mixed}");
    assert!(decided * 2 < mixed, "{decided} of {mixed}");
}

/// All others certainly stay as they are.
#[test]
fn walk_decides_few_of_many_levels() {
    let field = Field::square(60);
    let mut selector = Selector::default();
    let (mut decided, mut finer) = (0, 0);
    for step in 0..100 {
        selector.select(&field.scene, &view_at(step), &LodSettings::default());
        decided += selector.statistics().instances_decided;
        let coarsest = field.hierarchy.units.len() as u32 - 1;
        let levels = field.levels(&selector);
        finer += levels.iter().filter(|drawn| drawn[0] < coarsest).count();
    }
    assert!(decided * 4 < finer, "{decided} of {finer}");
}

#[test]
fn levels_go_on_after_something_else_decided() {
    let mut field = Field::square(30);
    let free = LodSettings {
        advanced: AdvancedSettings {
            hysteresis: 1.0,
            edge_hysteresis: 0.0,
            ..AdvancedSettings::default()
        },
        ..LodSettings::default()
    };
    let hiding = LodSettings {
        visible_flux: Some(VisibleFlux {
            hold_frames: 0,
            ..VisibleFlux::default()
        }),
        ..free
    };
    let forced = LodSettings {
        forced_level: Some(3),
        ..free
    };
    let mut selector = Selector::default();
    for step in 0..40 {
        let settings = match step / 5 % 4 {
            1 => &hiding,
            3 => &forced,
            _ => &free,
        };
        selector.select(&field.scene, &view_at(step), settings);
        let expected = field.fresh_levels(&view_at(step), settings);
        assert_eq!(field.levels(&selector), expected, "step {step}");
    }
    // Loaded in parts: what is drawn is the finest level at hand.
    let mesh = field.scene.mesh_of(field.ids[0]).unwrap();
    let wanted = field.fresh_levels(&view_at(40), &free);
    selector.select(&field.scene, &view_at(40), &free);
    assert_eq!(field.levels(&selector), wanted);
    for finest in [5, 7, 0] {
        field.scene.set_available(mesh, |group| group >= finest);
        selector.select(&field.scene, &view_at(40), &free);
        let at_hand = wanted.iter().map(|drawn| vec![drawn[0].max(finest)]);
        assert_eq!(field.levels(&selector), at_hand.collect::<Vec<_>>());
    }
    // What is removed leaves at the level that it had.
    let before = selector.triangle_count();
    let of_first = field.levels(&selector)[0][0];
    field.scene.remove(field.ids[0]);
    field.scene.update();
    selector.select(&field.scene, &view_at(41), &free);
    let left = selector
        .changes()
        .find(|change| change.instance == field.ids[0]);
    assert_eq!(left.map(|change| change.left), Some(&[of_first][..]));
    assert!(selector.triangle_count() < before);
}
