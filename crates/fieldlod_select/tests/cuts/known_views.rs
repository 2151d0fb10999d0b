//! Views with a known result.

use fieldlod_select::{Cut, LodSettings, View, select};
use glam::{Affine3A, Quat, Vec3};

use crate::common::{hierarchies, look, orthographic, perspective, with_advanced};

fn triangles(view: &View, placement: &Affine3A, error_px: f32) -> u64 {
    let mut cut = Cut::default();
    select(
        &hierarchies()[0],
        placement,
        view,
        &LodSettings::with_error_px(error_px),
        &mut cut,
    );
    cut.triangle_count()
}

fn triangles_from(view: &View) -> u64 {
    triangles(view, &Affine3A::IDENTITY, 1.0)
}

fn coarsest() -> u64 {
    triangles(
        &look(perspective(1.0), Vec3::Z * 1e6, Vec3::ZERO),
        &Affine3A::IDENTITY,
        1.0,
    )
}

#[test]
fn farther_is_coarser() {
    let counts: Vec<u64> = [1.5, 3.0, 6.0, 12.0, 50.0, 1000.0]
        .iter()
        .map(|&distance| triangles_from(&look(perspective(1.0), Vec3::Z * distance, Vec3::ZERO)))
        .collect();
    assert!(counts.is_sorted_by(|a, b| a >= b), "{counts:?}");
    assert!(counts[0] > 10 * counts[5], "{counts:?}");
}

#[test]
fn zooming_in_refines() {
    let wide = triangles_from(&look(perspective(1.2), Vec3::Z * 20.0, Vec3::ZERO));
    let narrow = triangles_from(&look(perspective(0.1), Vec3::Z * 20.0, Vec3::ZERO));
    assert!(narrow > 3 * wide, "{narrow} {wide}");
}

#[test]
fn larger_instance_is_finer() {
    let view = look(perspective(1.0), Vec3::Z * 20.0, Vec3::ZERO);
    // At 1 px the large instance has full detail.
    let small = triangles(&view, &Affine3A::IDENTITY, 2.0);
    let large = triangles(&view, &Affine3A::from_scale(Vec3::splat(6.0)), 2.0);
    assert!(large > 3 * small, "{large} {small}");
}

#[test]
fn object_behind_or_beside_camera_is_coarsest() {
    let eye = Vec3::Z * 3.0;
    for target in [Vec3::Z * 9.0, eye + Vec3::X, eye + Vec3::Y - Vec3::Z * 0.1] {
        let away = look(perspective(0.6), eye, target);
        assert_eq!(triangles_from(&away), coarsest(), "{target}");
    }
}

#[test]
fn surface_around_camera_is_fine() {
    let inside = look(perspective(1.0), Vec3::Z * 0.9, Vec3::Z * 2.0);
    assert!(triangles_from(&inside) > 2 * coarsest());
}

#[test]
fn cut_is_independent_of_turn_and_origin() {
    let turn = Affine3A::from_quat(Quat::from_rotation_y(1.0));
    let straight = triangles_from(&look(perspective(1.0), Vec3::Z * 5.0, Vec3::ZERO));
    let eye = turn.transform_point3(Vec3::Z * 5.0);
    assert_eq!(
        triangles(&look(perspective(1.0), eye, Vec3::ZERO), &turn, 1.0),
        straight
    );
    let shift = Vec3::new(1e5, 0.0, -2e5);
    let moved = triangles(
        &look(perspective(1.0), eye + shift, shift),
        &(Affine3A::from_translation(shift) * turn),
        1.0,
    );
    let change = moved.abs_diff(straight);
    assert!(change * 20 <= straight, "{moved} {straight}");
}

#[test]
fn orthographic_cut_is_independent_of_distance() {
    let at = |distance: f32| triangles_from(&look(orthographic(), Vec3::Z * distance, Vec3::ZERO));
    assert_eq!(at(3.0), at(900.0));
    assert!(at(3.0) > coarsest());
}

#[test]
fn pose_of_nan_draws_full_detail() {
    let nowhere = View::new(
        perspective(1.0),
        &Affine3A::from_translation(Vec3::splat(f32::NAN)),
    );
    let source = hierarchies()[0].source_triangle_count();
    assert_eq!(triangles_from(&nowhere), source);
}

/// How often the cut of a camera that shakes by 0.2 % around `distance` changes in 60 frames.
fn flips(distance: f32, hysteresis: f32) -> usize {
    let hierarchy = &hierarchies()[0];
    let settings = with_advanced(|advanced| advanced.hysteresis = hysteresis);
    let mut cut = Cut::default();
    let mut last: Option<Cut> = None;
    let mut flips = 0;
    for frame in 0..60 {
        let shake = if frame % 2 == 0 { 1.0 } else { 1.002 };
        let view = look(perspective(1.0), Vec3::Z * (distance * shake), Vec3::ZERO);
        select(hierarchy, &Affine3A::IDENTITY, &view, &settings, &mut cut);
        flips += usize::from(frame > 1 && last.as_ref() != Some(&cut));
        last = Some(cut.clone());
    }
    flips
}

#[test]
fn hysteresis_holds_cut_of_shaking_camera() {
    let distances: Vec<f32> = (10..200u8).map(|step| f32::from(step) * 0.2).collect();
    let flips_of = |hysteresis| {
        distances
            .iter()
            .map(|&d| flips(d, hysteresis))
            .sum::<usize>()
    };
    assert!(flips_of(1.0) > 0, "no distance is at a threshold");
    assert_eq!(flips_of(0.8), 0);
}
