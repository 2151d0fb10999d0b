//! Hidden instances are drawn coarser. They are refined in the frame in which they appear, and coarsened some frames
//! after they disappear.

mod common;

use camera_field::Camera;
use common::world::{Placed, World};
use common::{look, perspective};
use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_select::{
    InstanceId, LodSettings, OcclusionBuffer, Scene, Statistics, View, VisibleFlux,
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

/// A wall, which is a flattened rock, and a rock behind it.
fn world() -> (World, [InstanceId; 2]) {
    let place = |at: Vec3, scale: Vec3| {
        Placed::new(
            0,
            Affine3A::from_translation(at) * Affine3A::from_scale(scale),
        )
    };
    let world = World::new(&[
        place(Vec3::new(0.0, 0.0, -5.0), Vec3::new(2.5, 2.5, 0.3)),
        place(Vec3::new(0.0, 0.0, -12.0), Vec3::ONE),
    ]);
    let ids = world.ids().try_into().unwrap();
    (world, ids)
}

/// A view in which the wall hides the rock, and a view from beside the wall.
fn views() -> [View; 2] {
    let from = |x: f32| look(perspective(1.0), Vec3::X * x, Vec3::new(0.0, 0.0, -12.0));
    [from(0.0), from(9.0)]
}

/// The units of an instance that nothing hides.
fn seen_units(world: &World, id: InstanceId, view: &View) -> Vec<u32> {
    let plain = LodSettings {
        visible_flux: None,
        ..settings()
    };
    world.select(view, &plain).units(&world.scene, id).to_vec()
}

#[test]
fn hidden_instance_draws_under_a_quarter_of_units() {
    let (world, [_, rock]) = world();
    let [hiding, _] = views();
    let selector = world.select(&hiding, &settings());
    let hidden = selector.units(&world.scene, rock).len();
    let seen = seen_units(&world, rock, &hiding).len();
    assert!(hidden > 0 && hidden * 4 < seen, "{hidden} of {seen} units");
}

#[test]
fn instance_that_appears_is_refined_in_the_same_frame() {
    let (mut world, [wall, rock]) = world();
    let [hiding, beside] = views();
    let mut selector = world.select(&hiding, &settings());
    // The camera steps to the side.
    selector.select(&world.scene, &beside, &settings());
    let expected = seen_units(&world, rock, &beside);
    assert_eq!(selector.units(&world.scene, rock), expected);
    // The wall is removed.
    let mut selector = world.select(&hiding, &settings());
    world.scene.remove(wall);
    world.scene.update();
    selector.select(&world.scene, &hiding, &settings());
    let expected = seen_units(&world, rock, &hiding);
    assert_eq!(selector.units(&world.scene, rock), expected);
}

#[test]
fn instance_that_disappears_is_coarsened_after_some_frames() {
    let (world, [_, rock]) = world();
    let [hiding, beside] = views();
    let mut selector = world.select(&beside, &settings());
    let seen = selector.units(&world.scene, rock).len();
    let mut is_coarse = || {
        selector.select(&world.scene, &hiding, &settings());
        selector.units(&world.scene, rock).len() * 4 <= seen
    };
    let first = (0..20).find(|_| is_coarse());
    assert_eq!(first, Some(usize::from(HOLD_FRAMES)));
    // Once no share is held, a still view decides nothing.
    for _ in 0..HOLD_FRAMES {
        is_coarse();
    }
    assert_eq!(selector.statistics(), Statistics::default());
    assert_eq!(selector.changes().count(), 0);
}

#[test]
fn budget_counts_hidden_instances_as_hidden() {
    let (mut world, _) = world();
    // A crowd behind the wall, and some beside it.
    let place = |index: u8| {
        let x = f32::from(index % 10) * 0.5 - 2.5 + if index < 40 { 0.0 } else { 12.0 };
        let at = Vec3::new(x, 0.0, -16.0 - f32::from(index / 10));
        Placed::new(0, Affine3A::from_translation(at))
    };
    world.add(&(0..60).map(place).collect::<Vec<_>>());
    world.scene.update();
    let [hiding, _] = views();
    let budget = world.select(&hiding, &settings()).triangle_count() / 2;
    let scarce = LodSettings {
        triangle_budget: Some(budget),
        ..settings()
    };
    let drawn = world.select(&hiding, &scarce).triangle_count();
    assert!(
        drawn <= budget && drawn * 10 > budget * 9,
        "{drawn} of {budget}"
    );
}

/// Visible shares of a large rock, of a small one behind it and of a small one beside it.
fn shares_from(eye: Vec3, is_occluder: bool) -> [Vec<f32>; 3] {
    let rock = bake_mesh(&fixtures::rock(5, 1), &BakeConfig::default()).unwrap();
    let mut scene = Scene::default();
    let large = scene.add_mesh(&rock);
    let small = scene.add_mesh(&rock.whole_mesh_levels().unwrap());
    let ids = [
        (large, Vec3::new(0.0, 0.0, -6.0), 2.0),
        (small, Vec3::new(0.3, 0.2, -12.0), 0.5),
        (small, Vec3::new(7.0, 0.2, -12.0), 0.5),
    ]
    .map(|(mesh, at, size)| {
        let turn = Quat::from_rotation_y(0.3);
        let place = Affine3A::from_scale_rotation_translation(Vec3::splat(size), turn, at);
        scene.add_instance(mesh, place, 1.0)
    });
    scene.set_occluder(ids[0], is_occluder);
    scene.update();
    let view = look(perspective(0.85), eye, eye - Vec3::Z);
    let buffer = OcclusionBuffer::new(&scene, &view, 8000);
    ids.map(|id| buffer.visible_shares(&scene, id))
}

#[test]
fn large_occluder_hides_what_is_behind_it() {
    let [large, behind, beside] = shares_from(Vec3::ZERO, true);
    assert!(behind.iter().all(|&share| share < 1e-6));
    assert!(beside.iter().all(|&share| share == 1.0));
    // The near side of the rock hides its far side, except for groups that reach around.
    assert!(large.contains(&1.0) && large.iter().any(|&share| share < 0.5));
}

#[test]
fn excluded_occluder_and_eye_of_nan_hide_nothing() {
    let [_, behind, _] = shares_from(Vec3::ZERO, false);
    assert!(behind.iter().all(|&share| share == 1.0));
    let of_nan = shares_from(Vec3::NAN, true).concat();
    assert!(of_nan.iter().all(|&share| share == 1.0));
}

/// The depth at which a ray from the eye, of depth 1, meets a ball.
fn depth_of_ball(ray: Vec3, center: Vec3, radius: f32) -> f32 {
    let (squared, along) = (ray.dot(ray), ray.dot(center));
    let rest = along * along - squared * (center.dot(center) - radius * radius);
    if rest > 0.0 {
        (along - rest.sqrt()) / squared
    } else {
        f32::INFINITY
    }
}

#[test]
fn depth_image_equals_the_depths_of_rays() {
    let bake = |mesh| bake_mesh(&mesh, &BakeConfig::default()).unwrap();
    let mut scene = Scene::default();
    let ball = scene.add_mesh(&bake(fixtures::icosphere(5)));
    let ground = scene.add_mesh(&bake(fixtures::plane(32)));
    let mut put = |mesh, at: Vec3, scale: Vec3| {
        let placement = Affine3A::from_translation(at) * Affine3A::from_scale(scale);
        scene.add_instance(mesh, placement, 1.0);
    };
    // The nearer ball is mirrored. The ground reaches below and behind the camera and to the horizon, in triangles of
    // 190 m.
    let balls = [
        (Vec3::new(-1.0, 0.5, -8.0), 2.0),
        (Vec3::new(0.5, 0.2, -4.0), 1.0),
    ];
    put(ball, balls[0].0, Vec3::splat(balls[0].1));
    put(ball, balls[1].0, Vec3::new(-1.0, 1.0, 1.0) * balls[1].1);
    let size = Vec3::new(6000.0, 1.0, 6000.0);
    put(ground, Vec3::new(-3000.0, -1.0, -3000.0), size);
    scene.update();
    let view = View::new(perspective(1.0), &Affine3A::IDENTITY);
    let buffer = OcclusionBuffer::new(&scene, &view, u32::MAX);
    let size = Vec2::new(256.0, 144.0);
    let Camera::Perspective(lens) = view.camera() else {
        unreachable!("the camera is a perspective");
    };
    let (mut compared, mut texels) = (0, buffer.nearness().iter());
    for (y, x) in (0..144u8).flat_map(|y| (0..=255u8).map(move |x| (y, x))) {
        let nearness = *texels.next().unwrap();
        let at = (Vec2::new(f32::from(x), f32::from(y)) + 0.5) / size * 2.0 - 1.0;
        let ray = (at * lens.slope_max * Vec2::new(1.0, -1.0)).extend(-1.0);
        let depth = |growth: f32, texels_down: f32| {
            let of_ground = match -1.0 / (ray.y - texels_down * lens.slope_max.y / 72.0) {
                depth if (0.0..2900.0).contains(&depth) => depth,
                _ => f32::INFINITY,
            };
            let of_balls = balls.map(|(at, radius)| depth_of_ball(ray, at, radius * growth));
            of_balls.into_iter().fold(of_ground, f32::min)
        };
        // Levels differ from the ball at its outline, and clipped triangles by a twentieth of a texel.
        let [least, most] = [depth(1.02, 0.05), depth(0.97, -0.05)];
        if most < least * 1.05 {
            compared += 1;
            let depth = 1.0 / nearness;
            assert!(
                (least * 0.999..=most * 1.001).contains(&depth),
                "{x} {y}: {depth}"
            );
        } else if least == f32::INFINITY {
            assert!(nearness < 1.0 / 2000.0, "{x} {y}: {nearness}");
        }
    }
    assert!(compared > 256 * 144 / 3);
    assert_eq!(texels.next(), None);
}
