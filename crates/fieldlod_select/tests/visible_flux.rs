//! What is hidden counts less: at once when it comes into view, late when it goes out of it.

mod common;

use camera_field::{Camera, Intrinsics};
use common::{hierarchies, look, perspective};
use fieldlod_select::{
    InstanceId, LodSettings, OcclusionBuffer, Scene, Selector, Statistics, View, VisibleFlux,
};
use glam::{Affine3A, Quat, Vec2, Vec3};

const HOLD_FRAMES: u8 = 6;

fn settings() -> LodSettings {
    LodSettings {
        visible_flux: Some(VisibleFlux {
            hold_frames: HOLD_FRAMES,
            least_share: 0.0,
            ..VisibleFlux::default()
        }),
        ..LodSettings::with_error_px(0.5)
    }
}

/// A rock behind a wall, which is a flattened rock.
fn scene() -> (Scene, [InstanceId; 2]) {
    let mut scene = Scene::default();
    let rock = scene.add_mesh(&hierarchies()[0]);
    let mut add = |at: Vec3, scale: Vec3| {
        let placement = Affine3A::from_translation(at) * Affine3A::from_scale(scale);
        scene.add_instance(rock, placement, 1.0)
    };
    let ids = [
        add(Vec3::new(0.0, 0.0, -5.0), Vec3::new(2.5, 2.5, 0.3)),
        add(Vec3::new(0.0, 0.0, -12.0), Vec3::ONE),
    ];
    scene.update();
    (scene, ids)
}

/// From before the wall, and from beside it.
fn view(is_beside: bool) -> View {
    let eye = Vec3::new(if is_beside { 9.0 } else { 0.0 }, 0.0, 0.0);
    look(perspective(1.0), eye, Vec3::new(0.0, 0.0, -12.0))
}

/// The units of an instance that is seen as a whole, from beside the wall, without any memory.
fn seen_units(scene: &Scene, id: InstanceId, view: &View) -> Vec<u32> {
    let mut selector = Selector::default();
    let plain = LodSettings {
        visible_flux: None,
        ..settings()
    };
    selector.select(scene, view, &plain);
    selector.units(scene, id).to_vec()
}

#[test]
fn what_is_hidden_is_drawn_at_its_coarsest() {
    let (scene, [_, rock]) = scene();
    let mut selector = Selector::default();
    selector.select(&scene, &view(false), &settings());
    let hidden = selector.units(&scene, rock).len();
    let seen = seen_units(&scene, rock, &view(false)).len();
    assert!(hidden > 0 && hidden * 4 < seen, "{hidden} of {seen} units");
}

#[test]
fn what_comes_out_of_hiding_is_refined_in_the_same_frame() {
    let (mut scene, [wall, rock]) = scene();
    let mut selector = Selector::default();
    for _ in 0..20 {
        selector.select(&scene, &view(false), &settings());
    }
    // By a step to the side.
    selector.select(&scene, &view(true), &settings());
    let expected = seen_units(&scene, rock, &view(true));
    assert_eq!(selector.units(&scene, rock), expected);
    // By what hid it being removed.
    let mut selector = Selector::default();
    selector.select(&scene, &view(false), &settings());
    scene.remove(wall);
    scene.update();
    selector.select(&scene, &view(false), &settings());
    let expected = seen_units(&scene, rock, &view(false));
    assert_eq!(selector.units(&scene, rock), expected);
}

#[test]
fn what_goes_into_hiding_is_coarsened_after_some_frames() {
    let (scene, [_, rock]) = scene();
    let mut selector = Selector::default();
    selector.select(&scene, &view(true), &settings());
    let seen = selector.units(&scene, rock).len();
    let frames: Vec<bool> = (0..20)
        .map(|_| {
            selector.select(&scene, &view(false), &settings());
            selector.units(&scene, rock).len() * 4 > seen
        })
        .collect();
    let first = frames.iter().position(|is_fine| !is_fine);
    assert_eq!(first, Some(usize::from(HOLD_FRAMES)));
    // Nothing is done any more once that has happened.
    assert_eq!(selector.statistics(), Statistics::default());
    assert_eq!(selector.changes().count(), 0);
}

#[test]
fn two_views_do_not_share_what_they_hide() {
    let (scene, [_, rock]) = scene();
    let mut selectors = [Selector::default(), Selector::default()];
    for _ in 0..20 {
        for (selector, is_beside) in selectors.iter_mut().zip([false, true]) {
            selector.select(&scene, &view(is_beside), &settings());
        }
    }
    let [hidden, seen] = &selectors;
    assert!(hidden.units(&scene, rock).len() * 4 < seen.units(&scene, rock).len());
    assert_eq!(
        seen.units(&scene, rock),
        seen_units(&scene, rock, &view(true))
    );
}

#[test]
fn a_budget_counts_hidden_things_as_hidden() {
    let (mut scene, [_, rock]) = scene();
    let mesh = scene.mesh_of(rock).unwrap();
    // A crowd behind the wall, and some beside it.
    for index in 0..60u8 {
        let x = f32::from(index % 10) * 0.5 - 2.5 + if index < 40 { 0.0 } else { 12.0 };
        let place = Vec3::new(x, 0.0, -16.0 - f32::from(index / 10));
        scene.add_instance(mesh, Affine3A::from_translation(place), 1.0);
    }
    scene.update();
    let free = {
        let mut selector = Selector::default();
        selector.select(&scene, &view(false), &settings());
        selector.triangle_count()
    };
    let budget = free / 2;
    let mut selector = Selector::default();
    let scarce = LodSettings {
        triangle_budget: Some(budget),
        ..settings()
    };
    selector.select(&scene, &view(false), &scarce);
    let drawn = selector.triangle_count();
    assert!(
        drawn <= budget && drawn * 10 > budget * 9,
        "{drawn} of {budget}"
    );
}

fn seen_from(eye: Vec3) -> View {
    let camera = Camera::Perspective(Intrinsics::centered(200.0, Vec2::new(320.0, 180.0)));
    View::new(camera, &Affine3A::from_translation(eye))
}

/// A small ball behind a large one, or beside it.
fn hidden_and_beside() -> (Scene, [InstanceId; 3]) {
    let mut scene = Scene::default();
    let rock = fieldlod_bake::fixtures::rock(5, 1);
    let rock = fieldlod_bake::bake_mesh(&rock, &fieldlod_bake::BakeConfig::default()).unwrap();
    let large = scene.add_mesh(&rock);
    let small = scene.add_mesh(&rock.whole_mesh_levels().unwrap());
    let mut add = |mesh, at, size: f32| {
        let turn = Quat::from_rotation_y(0.3);
        let place = Affine3A::from_scale_rotation_translation(Vec3::splat(size), turn, at);
        scene.add_instance(mesh, place, 1.0)
    };
    let ids = [
        add(large, Vec3::new(0.0, 0.0, -6.0), 2.0),
        add(small, Vec3::new(0.3, 0.2, -12.0), 0.5),
        add(small, Vec3::new(7.0, 0.2, -12.0), 0.5),
    ];
    scene.update();
    (scene, ids)
}

#[test]
fn instance_behind_another_is_hidden() {
    let (scene, [large, behind, beside]) = hidden_and_beside();
    let buffer = OcclusionBuffer::new(&scene, &seen_from(Vec3::ZERO), 8000);
    let least = |id| {
        let shares = buffer.visible_shares(&scene, id);
        shares.into_iter().fold(1.0, f32::min)
    };
    let most = |id| {
        buffer
            .visible_shares(&scene, id)
            .into_iter()
            .fold(0.0, f32::max)
    };
    assert!(most(behind) < 1e-6);
    assert_eq!(least(beside), 1.0);
    // The far side of the large one is hidden by its near side, but where a group reaches around.
    assert_eq!(most(large), 1.0);
    assert!(least(large) < 0.5);
}

#[test]
fn instance_that_is_no_occluder_hides_nothing() {
    let (mut scene, [large, behind, _]) = hidden_and_beside();
    scene.set_occluder(large, false);
    scene.update();
    let buffer = OcclusionBuffer::new(&scene, &seen_from(Vec3::ZERO), 8000);
    assert!(
        buffer
            .visible_shares(&scene, behind)
            .iter()
            .all(|&share| share == 1.0)
    );
}

#[test]
fn eye_of_nan_sees_all() {
    let (scene, ids) = hidden_and_beside();
    let buffer = OcclusionBuffer::new(&scene, &seen_from(Vec3::NAN), 8000);
    for id in ids {
        assert!(
            buffer
                .visible_shares(&scene, id)
                .iter()
                .all(|&share| share == 1.0)
        );
    }
}
