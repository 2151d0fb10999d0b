//! Compares integrals of the field (eq. 8–11) with counted samples, and with each other.

use crate::common::*;

/// A triangle around `p`, with corners at the distance `size` from `p`.
fn triangle_at(p: DVec3, normal: DVec3, size: f64) -> [DVec3; 3] {
    let (a, b) = frame(normal);
    [0.0, 2.2, 4.1].map(|angle: f64| p + (a * angle.cos() + b * angle.sin()) * size)
}

/// Returns `true` if a ray from the camera meets a triangle, which may reach behind the camera.
fn ray_meets_triangle(ray: DVec3, [p0, p1, p2]: [DVec3; 3]) -> bool {
    let (e1, e2) = (p1 - p0, p2 - p0);
    let across = ray.cross(e2);
    let determinant = e1.dot(across);
    let u = -p0.dot(across) / determinant;
    let perpendicular = (-p0).cross(e1);
    let v = ray.dot(perpendicular) / determinant;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && e2.dot(perpendicular) / determinant > 0.0
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Property 1: compares flux with counted samples. By Jarník's inequality, the number of lattice
    /// points in a closed curve differs from its area by less than its length.
    #[test]
    fn flux_counts_the_samples_in_the_image(
        shift in prop::array::uniform2(-1.2..1.2_f64), normal in unit_vectors(), size in 0.1..3.0_f64,
    ) {
        let camera = Intrinsics {
            focal_px: dvec2(200.0, 160.0),
            slope_min: dvec2(-0.7, -0.4),
            slope_max: dvec2(0.5, 0.8),
        };
        let triangle = triangle_at(dvec3(shift[0], shift[1], 1.0), normal, size);
        let in_image = |ray: DVec3| camera.contains(ray) && ray_meets_triangle(ray, triangle);
        let count = count_samples(&camera, DVec2::ZERO, 200.0, in_image);
        // The clipped outline is at most as long as that of the image, 1.2 f_x by 1.2 f_y.
        let longest_outline = 2.0 * 1.2 * (200.0 + 160.0);
        let flux = camera.flux_through_triangle(triangle);
        prop_assert!((flux.abs() - count).abs() < longest_outline, "{flux} {count}");
    }
}

proptest! {
    /// Property 1: flux equals the area of the projected polygon.
    #[test]
    fn flux_equals_projected_area(
        camera in off_centre_cameras(), p in points(), normal in unit_vectors(), size in 0.01..0.9_f64,
    ) {
        let triangle = triangle_at(p, normal, size * p.z);
        prop_assume!(triangle.iter().all(|corner| corner.z > 0.05 * p.z));
        let [a, b, c] = triangle.map(|p| camera.project_px(p));
        // Triangles that are counter-clockwise for the camera are clockwise with y down.
        let area = -0.5 * (b - a).perp_dot(c - a);
        let scale = (b - a).length() * (c - a).length();
        assert_close(camera.flux_through_triangle_in_view(triangle), area, scale, 1e-7);
    }

    /// The clipped flux of a triangle is the sum over its pieces, and never exceeds the image.
    #[test]
    fn clipped_flux_is_additive_and_bounded(
        camera in off_centre_cameras(),
        corners in prop::array::uniform3(prop::array::uniform3(-9.0..9.0_f64)),
    ) {
        let [a, b, c] = corners.map(DVec3::from);
        let middle = (a + b + c) / 3.0;
        let whole = camera.flux_through_triangle([a, b, c]);
        let parts = [[a, b, middle], [b, c, middle], [c, a, middle]];
        let sum: f64 = parts.into_iter().map(|part| camera.flux_through_triangle(part)).sum();
        let image = camera.image_px().element_product();
        prop_assert!(whole.abs() <= image * (1.0 + 1e-6), "{whole} {image}");
        assert_close(sum, whole, image, 1e-6);
    }

    /// Eq. 11: patches with the same solid angle have the same flux. Here they are a piece of a sphere
    /// around the camera and a flat patch.
    #[test]
    fn equal_solid_angles_have_equal_flux(
        camera in off_centre_cameras(), rho in 0.1..50.0_f64,
    ) {
        // The parameters are swapped, so that the front faces the camera.
        let ray = |u: f64, v: f64| {
            let slope = camera.slope_min + (camera.slope_max - camera.slope_min) * dvec2(v, u);
            slope.extend(1.0)
        };
        let curved = camera.flux_through_patch(48, |u, v| ray(u, v).normalize() * rho);
        let flat = camera.flux_through_patch(2, |u, v| ray(u, v) * rho);
        let image = camera.image_px().element_product();
        assert_close(flat, image, image, 1e-9);
        // Facets and image both have straight edges, so the only error is rounding.
        assert_close(curved, image, image, 1e-6);
    }

    /// A closed surface in view has no net flux (eq. 9, 10).
    #[test]
    fn flux_through_a_closed_surface_is_zero(p in points(), share in 0.01..0.9_f64) {
        prop_assume!(p.length() < 11.0 * p.z);
        let camera = square_camera(100.0);
        let radius = share * p.z;
        let sphere = |u: f64, v: f64| p + from_spherical(radius, v * PI, u * TAU);
        let net = camera.flux_through_patch(24, sphere);
        prop_assert!(net.abs() <= 1e-6 * camera.strength(p) * radius * radius * 40.0);
    }

    /// Compares the closed form of a disk with its facets.
    #[test]
    fn flux_through_a_disk_has_a_closed_form(
        p in points(), normal in unit_vectors(), share in 0.01..0.8_f64,
    ) {
        let camera = square_camera(100.0);
        let (a, b) = frame(normal);
        let radius = share * p.z;
        let rim = |step: i32| {
            let turn = f64::from(step) / 4096.0 * TAU;
            p + (a * turn.cos() + b * turn.sin()) * radius
        };
        let facet = |i| camera.flux_through_triangle_in_view([p, rim(i), rim(i + 1)]);
        let facets: f64 = (0..4096).map(facet).sum();
        let disk = camera.flux_through_disk(p, normal, radius);
        assert_close(facets, disk, disk, 1e-4);
    }
}

#[test]
fn triangle_through_the_camera_has_no_flux() {
    let edge_on = [DVec3::ZERO, DVec3::Z, dvec3(1.0, 0.0, 1.0)];
    assert_eq!(square_camera(100.0).flux_through_triangle(edge_on), 0.0);
}
