//! Compares differential quantities (eq. 9, 12–14) with central differences.

use crate::common::*;

/// Step of the differences, relative to the depth, because the field changes over lengths like the depth.
const STEP: f64 = 1e-5;
/// Tolerance of a derivative, relative to strength over depth.
const TOLERANCE: f64 = 1e-7;

/// Derivative of `quantity` along each axis.
fn central_differences<T>(p: DVec3, quantity: impl Fn(DVec3) -> T) -> [T; 3]
where
    T: core::ops::Sub<Output = T> + core::ops::Div<f64, Output = T>,
{
    let step = STEP * p.z;
    DVec3::AXES.map(|axis| (quantity(p + axis * step) - quantity(p - axis * step)) / (2.0 * step))
}

proptest! {
    #[test]
    fn divergence_curl_and_gradient_match_differences(camera in wide_cameras(), p in points()) {
        let scale = camera.strength(p) / p.z;
        let [dx, dy, dz] = central_differences(p, |p| camera.field(p));
        assert_close(dx.x + dy.y + dz.z, camera.divergence(p), scale, TOLERANCE);
        let curl = dvec3(dy.z - dz.y, dz.x - dx.z, dx.y - dy.x);
        assert_near(curl, camera.curl(p), scale, TOLERANCE);
        assert_close(curl.length(), camera.curl_magnitude(p), scale, TOLERANCE);
        let gradient = DVec3::from(central_differences(p, |p| camera.strength(p)));
        assert_near(gradient, camera.gradient(p), scale, TOLERANCE);
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
    }

    /// Tests the derivative of the projection, which splats and texture filters use.
    #[test]
    fn displacement_in_pixels_matches_central_differences(
        camera in wide_cameras(), p in points(), direction in unit_vectors(),
    ) {
        let step = direction * (STEP * p.z);
        let moved = camera.project_px(p + step) - camera.project_px(p - step);
        let error = moved / (2.0 * STEP * p.z) - camera.displace_px(p, direction);
        prop_assert!(error.length() <= TOLERANCE * camera.pixel_scale(p));
    }
}
