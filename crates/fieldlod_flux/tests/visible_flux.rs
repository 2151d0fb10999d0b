//! Hidden instances are drawn coarser. They are refined in the frame in which they appear, and coarsened some frames
//! after they disappear.

mod common;

use camera_field::Camera;
use common::{Eye, Stage, add_mesh, look, perspective, rock, settings};
use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_flux::{DepthImage, FluxSettings, Occluders};
use fieldlod_select::{InstanceId, LodSettings, Scene, Selector, Statistics, View};
use glam::{Affine3A, Quat, Vec2, Vec3};

const HOLD_FRAMES: u8 = 6;

fn new_eye() -> Eye {
    Eye::new(FluxSettings {
        hold_frames: HOLD_FRAMES,
        least_share: 0.0,
        ..FluxSettings::default()
    })
}

/// A wall, which is a flattened rock, and a rock behind it.
fn wall_and_rock() -> (Stage, [InstanceId; 2]) {
    let mut stage = Stage::new();
    let wall = stage.put(Vec3::new(0.0, 0.0, -5.0), Vec3::new(2.5, 2.5, 0.3));
    let rock = stage.put(Vec3::new(0.0, 0.0, -12.0), Vec3::ONE);
    stage.scene.update();
    (stage, [wall, rock])
}

/// A view in which the wall hides the rock, and a view from beside the wall.
fn views() -> [View; 2] {
    let from = |x: f32| look(perspective(1.0), Vec3::X * x, Vec3::new(0.0, 0.0, -12.0));
    [from(0.0), from(9.0)]
}

/// Triangles of an instance that nothing hides.
fn seen_triangles(stage: &Stage, id: InstanceId, view: &View) -> u64 {
    stage.triangles(&stage.select_all_visible(view), id)
}

#[test]
fn hidden_instance_draws_under_a_quarter_of_triangles() {
    let (stage, [_, rock]) = wall_and_rock();
    let [hiding, _] = views();
    let mut eye = new_eye();
    eye.select(&stage, &hiding, &settings());
    let hidden = stage.triangles(&eye.selector, rock);
    let seen = seen_triangles(&stage, rock, &hiding);
    assert!(hidden > 0 && hidden * 4 < seen, "{hidden} of {seen}");
}

#[test]
fn instance_that_appears_is_refined_in_the_same_frame() {
    let (mut stage, [wall, rock]) = wall_and_rock();
    let [hiding, beside] = views();
    let mut eye = new_eye();
    eye.select(&stage, &hiding, &settings());
    // The camera steps to the side.
    eye.select(&stage, &beside, &settings());
    let expected = seen_triangles(&stage, rock, &beside);
    assert_eq!(stage.triangles(&eye.selector, rock), expected);
    // The wall is removed.
    let mut eye = new_eye();
    eye.select(&stage, &hiding, &settings());
    stage.remove(wall);
    stage.scene.update();
    eye.select(&stage, &hiding, &settings());
    let expected = seen_triangles(&stage, rock, &hiding);
    assert_eq!(stage.triangles(&eye.selector, rock), expected);
}

#[test]
fn instance_that_disappears_is_coarsened_after_some_frames() {
    let (stage, [_, rock]) = wall_and_rock();
    let [hiding, beside] = views();
    let mut eye = new_eye();
    eye.select(&stage, &beside, &settings());
    let seen = stage.triangles(&eye.selector, rock);
    let mut is_coarse = || {
        eye.select(&stage, &hiding, &settings());
        stage.triangles(&eye.selector, rock) * 4 <= seen
    };
    let first = (0..20).find(|_| is_coarse());
    assert_eq!(first, Some(usize::from(HOLD_FRAMES)));
    // Once no share is held, a still view decides nothing.
    for _ in 0..HOLD_FRAMES {
        is_coarse();
    }
    assert_eq!(eye.selector.statistics(), Statistics::default());
    assert_eq!(eye.selector.changes().count(), 0);
}

#[test]
fn budget_counts_hidden_instances_as_hidden() {
    let (mut stage, _) = wall_and_rock();
    // A crowd behind the wall, and some beside it.
    for index in 0..60u8 {
        let x = f32::from(index % 10) * 0.5 - 2.5 + if index < 40 { 0.0 } else { 12.0 };
        stage.put(Vec3::new(x, 0.0, -16.0 - f32::from(index / 10)), Vec3::ONE);
    }
    stage.scene.update();
    let [hiding, _] = views();
    let triangles = |settings: &LodSettings| {
        let mut eye = new_eye();
        eye.select(&stage, &hiding, settings);
        eye.selector.triangle_count()
    };
    let budget = triangles(&settings()) / 2;
    let drawn = triangles(&LodSettings {
        triangle_budget: Some(budget),
        ..settings()
    });
    assert!(
        drawn <= budget && drawn * 10 > budget * 9,
        "{drawn} of {budget}"
    );
}

/// Visible shares of a large rock, of a small one behind it and of a small one beside it.
fn shares_from(eye: Vec3, hides: bool) -> [f32; 3] {
    let (mut scene, mut occluders) = (Scene::default(), Occluders::default());
    let large = add_mesh(&mut scene, &mut occluders, rock());
    let whole = rock().whole_mesh_levels().unwrap();
    let small = add_mesh(&mut scene, &mut occluders, &whole);
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
    occluders.set_hides(ids[0], hides);
    scene.update();
    let view = look(perspective(0.85), eye, eye - Vec3::Z);
    let image = DepthImage::new(&scene, &view, &occluders, 8000);
    ids.map(|id| image.visible_share(&scene, &occluders, id))
}

#[test]
fn large_occluder_hides_what_is_behind_it() {
    assert_eq!(shares_from(Vec3::ZERO, true), [1.0, 0.0, 1.0]);
}

#[test]
fn excluded_occluder_and_eye_of_nan_hide_nothing() {
    assert_eq!(shares_from(Vec3::ZERO, false), [1.0; 3]);
    assert_eq!(shares_from(Vec3::NAN, true), [1.0; 3]);
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
    let (mut scene, mut occluders) = (Scene::default(), Occluders::default());
    let ball = add_mesh(&mut scene, &mut occluders, &bake(fixtures::icosphere(5)));
    let ground = add_mesh(&mut scene, &mut occluders, &bake(fixtures::plane(32)));
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
    let buffer = DepthImage::new(&scene, &view, &occluders, u32::MAX);
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

/// Nothing is drawn or decided again if occluders are set to what they are, and a forced level asks for no weights.
#[test]
fn still_view_decides_nothing_after_equal_occluders() {
    let (mut stage, [wall, rock]) = wall_and_rock();
    let [hiding, _] = views();
    let mut eye = new_eye();
    eye.select(&stage, &hiding, &settings());
    stage.occluders.set_hides(wall, true);
    stage.occluders.drop_unused();
    eye.select(&stage, &hiding, &settings());
    assert_eq!(eye.selector.statistics(), Statistics::default());
    // The wall becomes transparent.
    let hidden = stage.triangles(&eye.selector, rock);
    stage.occluders.set_hides(wall, false);
    eye.select(&stage, &hiding, &settings());
    assert!(stage.triangles(&eye.selector, rock) > hidden);
    let forced = LodSettings {
        forced_level: Some(1),
        ..settings()
    };
    eye.select(&stage, &hiding, &forced);
    let mut plain = Selector::default();
    plain.select(&stage.scene, &hiding, &forced);
    assert_eq!(eye.selector.triangle_count(), plain.triangle_count());
}
