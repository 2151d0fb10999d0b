//! Cameras that are read from projection matrices.

use camera_field::{Camera as SingleCamera, ProjectionError};
use glam::{DMat3, Mat4, Vec2};

use crate::common::*;

const VIEWPORT: DVec2 = dvec2(1920.0, 1080.0);

/// Projects by the matrix to pixels from the image centre, with y down.
fn matrix_px(clip_from_view: &DMat4, p_view: DVec3) -> DVec2 {
    let ndc = clip_from_view.project_point3(p_view);
    dvec2(ndc.x, -ndc.y) * VIEWPORT * 0.5
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
    fn perspective_matches_its_matrix_for_every_depth_convention(fov in 0.2..2.8_f64, p in points()) {
        let aspect = VIEWPORT.x / VIEWPORT.y;
        for matrix in &[
            DMat4::perspective_rh(fov, aspect, 0.1, 1000.0),
            DMat4::perspective_rh(fov, aspect, 1000.0, 0.1),
            DMat4::perspective_rh_gl(fov, aspect, 0.1, 1000.0),
            DMat4::perspective_infinite_rh(fov, aspect, 0.1),
            DMat4::perspective_infinite_reverse_rh(fov, aspect, 0.1),
        ] {
            let camera = expect_perspective(matrix);
            let by_matrix = matrix_px(matrix, CAMERA_FROM_VIEW * p);
            let by_camera = camera.project_px(p);
            prop_assert!((by_matrix - by_camera).length() <= 1e-9 * (1.0 + by_camera.length()));
            prop_assert!((camera.image_px() - VIEWPORT).length() <= 1e-9);
            // Eq. 2: f = res/2 · cot(fov/2).
            let focal_px = VIEWPORT.y * 0.5 / (fov * 0.5).tan();
            assert_close(camera.focal_px.y, focal_px, focal_px, 1e-12);
        }
    }

    /// Off-centre images keep their edges, with y pointing down.
    #[test]
    fn off_centre_images_keep_their_edges(
        left in -20.0..5.0_f64, width in 0.1..30.0_f64, bottom in -20.0..5.0_f64, height in 0.1..30.0_f64,
    ) {
        let (right, top) = (left + width, bottom + height);
        let camera = expect_perspective(&DMat4::frustum_rh(left, right, bottom, top, 1.0, 50.0));
        let matrix = DMat4::orthographic_rh(left, right, bottom, top, -10.0, 50.0);
        let Ok(Camera::Orthographic(flat)) = Camera::from_projection(&matrix, VIEWPORT) else {
            panic!("not orthographic");
        };
        let px_per_unit = VIEWPORT / dvec2(width, height);
        for (min, max, scale) in [
            (camera.slope_min, camera.slope_max, camera.focal_px),
            (flat.min, flat.max, flat.pixels_per_unit),
        ] {
            prop_assert!((min - dvec2(left, -top)).length() < 1e-10);
            prop_assert!((max - dvec2(right, -bottom)).length() < 1e-10);
            prop_assert!((scale / px_per_unit - 1.0).abs().max_element() < 1e-12);
        }
    }

    #[test]
    fn any_matrix_gives_a_camera_or_error(
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

#[test]
fn camera_from_view_is_its_own_inverse() {
    assert_eq!(CAMERA_FROM_VIEW * CAMERA_FROM_VIEW, DMat3::IDENTITY);
    assert_eq!(CAMERA_FROM_VIEW * DVec3::NEG_Z, DVec3::Z, "forward");
    assert_eq!(CAMERA_FROM_VIEW * DVec3::Y, DVec3::NEG_Y, "up");
}

#[test]
fn mirrored_image_gives_the_unmirrored_camera() {
    let matrix = DMat4::frustum_rh(-1.0, 2.0, -0.5, 1.5, 1.0, 50.0);
    let mirrored = DMat4::from_scale(dvec3(-1.0, -1.0, 1.0)) * matrix;
    assert_eq!(expect_perspective(&mirrored), expect_perspective(&matrix));
}

#[test]
fn rejects_unusable_projections_and_ignores_depth_rows() {
    let viewport = Vec2::new(300.0, 200.0);
    let read = |viewport: Vec2, change: fn(&mut Mat4)| {
        let mut matrix = Mat4::perspective_infinite_reverse_rh(1.0, 1.5, 0.1);
        change(&mut matrix);
        SingleCamera::from_projection(&matrix, viewport)
    };
    let changes: [(fn(&mut Mat4), _); 8] = [
        (|m| m.x_axis.x = f32::NAN, ProjectionError::NotFinite),
        (|m| m.x_axis.x = 0.0, ProjectionError::Degenerate),
        (|m| m.z_axis.w = 0.0, ProjectionError::Degenerate),
        (|m| m.y_axis.x = 0.1, ProjectionError::Sheared),
        (|m| m.w_axis.x = 0.1, ProjectionError::Sheared),
        (|m| m.x_axis.w = 0.1, ProjectionError::Sheared),
        (|m| m.w_axis.w = 2.0, ProjectionError::Sheared),
        (|m| m.z_axis.w = 1.0, ProjectionError::LooksBackwards),
    ];
    for (change, expected) in changes {
        assert_eq!(read(viewport, change), Err(expected));
    }
    for [x, y] in [
        [0.0, 0.0],
        [100.0, -1.0],
        [f32::NAN, 9.0],
        [f32::INFINITY; 2],
    ] {
        assert_eq!(
            read(Vec2::new(x, y), |_| ()),
            Err(ProjectionError::EmptyViewport)
        );
    }
    let depth_row: fn(&mut Mat4) = |m| (m.z_axis.z, m.w_axis.z) = (f32::NAN, f32::INFINITY);
    assert_eq!(read(viewport, depth_row), read(viewport, |_| ()));
}
