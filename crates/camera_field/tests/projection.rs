//! Tests of cameras that are read from projection matrices.
#![expect(
    clippy::disallowed_methods,
    reason = "tests may use angles and powers; selection does not run here"
)]

mod common;

use camera_field::double::{CAMERA_FROM_VIEW, Camera, Intrinsics};
use camera_field::{Camera as SingleCamera, ProjectionError};
use glam::{DMat4, DVec2, DVec3, Mat4, Vec2};
use proptest::prelude::*;

const VIEWPORT: DVec2 = DVec2::new(1920.0, 1080.0);

/// Projects by the matrix to pixels from the image centre, with y down.
fn matrix_px(clip_from_view: &DMat4, p_view: DVec3) -> DVec2 {
    let ndc = clip_from_view.project_point3(p_view);
    DVec2::new(ndc.x, -ndc.y) * VIEWPORT * 0.5
}

fn expect_perspective(clip_from_view: &DMat4) -> Intrinsics {
    match Camera::from_projection(clip_from_view, VIEWPORT) {
        Ok(Camera::Perspective(camera)) => camera,
        other => panic!("not perspective: {other:?}"),
    }
}

proptest! {
    /// Finite, infinite and reversed depth give the same camera. It projects like the matrix.
    #[test]
    fn perspective_matches_its_matrix_for_every_depth_convention(
        fov in 0.2..2.8_f64, p in common::points(),
    ) {
        let aspect = VIEWPORT.x / VIEWPORT.y;
        let matrices = [
            DMat4::perspective_rh(fov, aspect, 0.1, 1000.0),
            DMat4::perspective_rh(fov, aspect, 1000.0, 0.1),
            DMat4::perspective_rh_gl(fov, aspect, 0.1, 1000.0),
            DMat4::perspective_infinite_rh(fov, aspect, 0.1),
            DMat4::perspective_infinite_reverse_rh(fov, aspect, 0.1),
        ];
        for matrix in &matrices {
            let camera = expect_perspective(matrix);
            let by_matrix = matrix_px(matrix, CAMERA_FROM_VIEW * p);
            let by_camera = camera.project_px(p);
            prop_assert!((by_matrix - by_camera).length() <= 1e-9 * (1.0 + by_camera.length()));
            prop_assert!((camera.image_px() - VIEWPORT).length() <= 1e-9);
            // Eq. 2: f = res/2 · cot(fov/2).
            let focal_px = VIEWPORT.y * 0.5 / (fov * 0.5).tan();
            common::assert_close(camera.focal_px.y, focal_px, focal_px, 1e-12);
        }
    }

    /// Off-centre frusta keep their edges, with y pointing down.
    #[test]
    fn off_centre_frusta_keep_their_edges(
        left in -2.0..0.5_f64, width in 0.1..3.0_f64, bottom in -2.0..0.5_f64, height in 0.1..3.0_f64,
    ) {
        let (right, top) = (left + width, bottom + height);
        let matrix = DMat4::frustum_rh(left, right, bottom, top, 1.0, 50.0);
        let camera = expect_perspective(&matrix);
        let edges = [camera.slope_min.x, camera.slope_max.x, camera.slope_min.y, camera.slope_max.y];
        for (edge, expected) in edges.into_iter().zip([left, right, -top, -bottom]) {
            common::assert_close(edge, expected, 1.0, 1e-12);
        }
    }

    #[test]
    fn orthographic_cameras_keep_their_rectangle(
        left in -20.0..5.0_f64, width in 0.1..30.0_f64, bottom in -20.0..5.0_f64, height in 0.1..30.0_f64,
    ) {
        let (right, top) = (left + width, bottom + height);
        let matrix = DMat4::orthographic_rh(left, right, bottom, top, -10.0, 50.0);
        let Ok(Camera::Orthographic(camera)) = Camera::from_projection(&matrix, VIEWPORT) else {
            panic!("not orthographic");
        };
        common::assert_close(camera.pixels_per_unit.x, VIEWPORT.x / width, VIEWPORT.x / width, 1e-12);
        common::assert_close(camera.pixels_per_unit.y, VIEWPORT.y / height, VIEWPORT.y / height, 1e-12);
        let edges = [camera.min.x, camera.max.x, camera.min.y, camera.max.y];
        for (edge, expected) in edges.into_iter().zip([left, right, -top, -bottom]) {
            common::assert_close(edge, expected, 50.0, 1e-12);
        }
    }

    #[test]
    fn any_matrix_gives_a_usable_camera_or_an_error(
        entries in prop::array::uniform16(proptest::num::f32::ANY),
        width in proptest::num::f32::ANY, height in proptest::num::f32::ANY,
    ) {
        let matrix = Mat4::from_cols_array(&entries);
        if let Ok(SingleCamera::Perspective(camera)) =
            SingleCamera::from_projection(&matrix, Vec2::new(width, height))
        {
            prop_assert!(camera.focal_px.is_finite() && camera.focal_px.min_element() > 0.0);
            prop_assert!(camera.slope_min.cmplt(camera.slope_max).all());
        }
    }
}

fn perspective() -> Mat4 {
    Mat4::perspective_infinite_reverse_rh(1.0, 1.5, 0.1)
}

#[test]
fn camera_from_view_is_its_own_inverse() {
    assert_eq!(CAMERA_FROM_VIEW * CAMERA_FROM_VIEW, glam::DMat3::IDENTITY);
    assert_eq!(CAMERA_FROM_VIEW * DVec3::NEG_Z, DVec3::Z, "forward");
    assert_eq!(CAMERA_FROM_VIEW * DVec3::Y, DVec3::NEG_Y, "up");
}

#[test]
fn depth_rows_are_ignored() {
    let viewport = Vec2::new(300.0, 200.0);
    let mut odd = perspective();
    odd.z_axis.z = f32::NAN;
    odd.w_axis.z = f32::INFINITY;
    assert_eq!(
        SingleCamera::from_projection(&odd, viewport),
        SingleCamera::from_projection(&perspective(), viewport),
    );
}

#[test]
fn mirrored_image_gives_the_unmirrored_camera() {
    let viewport = DVec2::new(300.0, 200.0);
    let matrix = DMat4::frustum_rh(-1.0, 2.0, -0.5, 1.5, 1.0, 50.0);
    let mirrored = DMat4::from_scale(DVec3::new(-1.0, -1.0, 1.0)) * matrix;
    assert_eq!(
        Camera::from_projection(&mirrored, viewport),
        Camera::from_projection(&matrix, viewport),
    );
}

#[test]
fn rejects_unusable_projections() {
    let viewport = Vec2::new(300.0, 200.0);
    let rejected = |change: fn(&mut Mat4)| {
        let mut matrix = perspective();
        change(&mut matrix);
        SingleCamera::from_projection(&matrix, viewport).unwrap_err()
    };
    assert_eq!(
        rejected(|m| m.x_axis.x = f32::NAN),
        ProjectionError::NotFinite
    );
    assert_eq!(rejected(|m| m.x_axis.x = 0.0), ProjectionError::Degenerate);
    assert_eq!(rejected(|m| m.z_axis.w = 0.0), ProjectionError::Degenerate);
    assert_eq!(rejected(|m| m.y_axis.x = 0.1), ProjectionError::Sheared);
    assert_eq!(rejected(|m| m.w_axis.x = 0.1), ProjectionError::Sheared);
    assert_eq!(rejected(|m| m.x_axis.w = 0.1), ProjectionError::Sheared);
    assert_eq!(
        rejected(|m| m.z_axis.w = 1.0),
        ProjectionError::LooksBackwards
    );
}

#[test]
fn rejects_empty_viewports() {
    for viewport in [
        Vec2::ZERO,
        Vec2::new(100.0, -1.0),
        Vec2::new(f32::NAN, 9.0),
        Vec2::INFINITY,
    ] {
        assert_eq!(
            SingleCamera::from_projection(&perspective(), viewport),
            Err(ProjectionError::EmptyViewport),
        );
    }
}
