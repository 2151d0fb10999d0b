//! Compares differential quantities (eq. 9, 12–14) with central differences, to 85° off axis.
#![expect(
    clippy::disallowed_methods,
    reason = "tests may use angles and powers; selection does not run here"
)]

mod common;

use camera_field::double::{Intrinsics, Spherical};
use common::{assert_close, central_differences, points, wide_cameras};
use glam::{DVec2, DVec3};
use proptest::prelude::*;

/// Step of the differences, relative to the depth, because the field changes over lengths like the depth.
const STEP: f64 = 1e-5;
/// Tolerance of a derivative, relative to strength over depth.
const TOLERANCE: f64 = 1e-7;

proptest! {
    #[test]
    fn divergence_is_zero(camera in wide_cameras(), p in points()) {
        let [dx, dy, dz] = central_differences(p, STEP * p.z, |p| camera.field(p));
        assert_close(dx.x + dy.y + dz.z, camera.divergence(p), camera.strength(p) / p.z, TOLERANCE);
    }

    #[test]
    fn curl_matches_central_differences(camera in wide_cameras(), p in points()) {
        let [dx, dy, dz] = central_differences(p, STEP * p.z, |p| camera.field(p));
        let curl = DVec3::new(dy.z - dz.y, dz.x - dx.z, dx.y - dy.x);
        let scale = camera.strength(p) / p.z;
        assert_close((curl - camera.curl(p)).length(), 0.0, scale, TOLERANCE);
        assert_close(curl.length(), camera.curl_magnitude(p), scale, TOLERANCE);
    }

    #[test]
    fn gradient_matches_central_differences(camera in wide_cameras(), p in points()) {
        let gradient = DVec3::from(central_differences(p, STEP * p.z, |p| camera.strength(p)));
        let scale = camera.strength(p) / p.z;
        assert_close((gradient - camera.gradient(p)).length(), 0.0, scale, TOLERANCE);
    }

    /// §3.2: the curl is the rate at which the strength grows along φ at constant distance.
    #[test]
    fn curl_is_the_growth_of_strength_along_phi(camera in wide_cameras(), p in points()) {
        let at = Spherical::from_cartesian(p);
        let growth = camera.gradient(p).dot(at.basis().u_phi);
        assert_close(growth, camera.curl_magnitude(p), camera.strength(p) / p.z, TOLERANCE);
    }

    /// §3.3: the gradient points to the camera only on the axis.
    #[test]
    fn gradient_points_to_camera_only_on_axis(camera in wide_cameras(), p in points()) {
        let off_axis = p.x.hypot(p.y) / p.length();
        let turn = camera.gradient(p).normalize().cross(-p.normalize()).length();
        prop_assert_eq!(turn > 1e-9, off_axis > 1e-9, "{} {}", turn, off_axis);
        let on_axis = DVec3::Z * p.z;
        prop_assert!(camera.gradient(on_axis).normalize().distance(DVec3::NEG_Z) < 1e-12);
    }

    /// Eq. 13: all points of a level surface have its strength.
    #[test]
    fn level_surfaces_have_equal_strength(
        camera in wide_cameras(), strength in 1e-3..1e6_f64, p in points(),
    ) {
        let cos_phi = Intrinsics::aspect_ratio(p);
        let on_ray = p.normalize() * camera.level_radius(strength, cos_phi);
        assert_close(camera.strength(on_ray), strength, strength, 1e-9);
        let by_slope = camera.level_point(strength, DVec2::new(p.x, p.y) / p.z);
        assert_close(by_slope.distance(on_ray), 0.0, on_ray.length(), 1e-9);
    }

    /// Tests the derivative of the projection, which splats and texture filters use.
    #[test]
    fn displacement_in_pixels_matches_central_differences(
        camera in wide_cameras(), p in points(), direction in common::unit_vectors(),
    ) {
        let step = direction * (STEP * p.z);
        let moved = camera.project_px(p + step) - camera.project_px(p - step);
        let difference = moved / (2.0 * STEP * p.z);
        let error = difference - camera.displace_px(p, direction);
        prop_assert!(error.length() <= TOLERANCE * camera.pixel_scale(p));
    }
}

#[test]
fn level_surface_mesh_is_level_and_faces_camera() {
    let camera = Intrinsics::centered(300.0, DVec2::new(800.0, 600.0));
    let mesh = camera.level_surface_mesh(50.0, 8);
    assert_eq!(mesh.positions.len(), 81);
    assert_eq!(mesh.indices.len(), 8 * 8 * 6);
    // Rounding may move points on the edge out of the view, so they are moved inwards a little.
    for &p in &mesh.positions {
        let inside = DVec3::new(p.x * (1.0 - 1e-12), p.y * (1.0 - 1e-12), p.z);
        assert_close(camera.strength(inside), 50.0, 50.0, 1e-9);
    }
    for corners in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|corner| mesh.positions[corners[corner] as usize]);
        assert!((b - a).cross(c - a).dot(a) < 0.0, "faces away");
    }
}
