//! Compares integrals of the field (eq. 8–11) with counted samples, and with each other.
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests may use angles, powers and vectors; selection does not run here"
)]

mod common;

use camera_field::double::Intrinsics;
use common::{
    assert_close, count_samples, from_spherical, off_centre_cameras, points, ray_meets_triangle,
    unit_vectors, wide_camera,
};
use glam::{DVec2, DVec3};
use proptest::prelude::*;

/// A triangle around `p`, with corners at the distance `size` from `p`.
fn triangle_at(p: DVec3, normal: DVec3, turn: f64, size: f64) -> [DVec3; 3] {
    let (a, b) = common::frame(normal);
    [0.0, 2.2, 4.1].map(|angle| p + (a * (angle + turn).cos() + b * (angle + turn).sin()) * size)
}

fn perimeter_px(camera: &Intrinsics, triangle: [DVec3; 3]) -> f64 {
    let [a, b, c] = triangle.map(|p| camera.project_px(p));
    a.distance(b) + b.distance(c) + c.distance(a)
}

/// A camera in which `triangle` covers about `samples` pixels.
fn camera_for(triangle: [DVec3; 3], samples: f64) -> Intrinsics {
    let unit = wide_camera(DVec2::ONE)
        .flux_through_triangle_in_view(triangle)
        .abs();
    wide_camera(DVec2::splat((samples / unit).sqrt()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Property 1: compares flux with counted samples. By Jarník's inequality, the number of lattice
    /// points in a closed curve differs from its area by less than its length.
    #[test]
    fn flux_through_triangle_is_its_sample_count(
        p in points(), normal in unit_vectors(), turn in 0.0..6.0_f64, size in 0.01..0.8_f64,
    ) {
        let triangle = triangle_at(p, normal, turn, size * p.z);
        prop_assume!(normal.dot(p.normalize()).abs() > 0.02);
        prop_assume!(triangle.iter().all(|corner| corner.z > 0.02 * p.z));
        let camera = camera_for(triangle, 4000.0);
        let corners = triangle.map(|p| camera.project_px(p));
        let reach_px = corners.iter().map(|c| c.distance(corners[0])).fold(0.0, f64::max) + 2.0;
        prop_assume!(reach_px < 3000.0);
        let hits = |ray: DVec3| ray_meets_triangle(ray, triangle);
        let count = count_samples(&camera, corners[0], reach_px, hits);
        let flux = camera.flux_through_triangle_in_view(triangle);
        prop_assert!((flux.abs() - count).abs() < perimeter_px(&camera, triangle));
        prop_assert_eq!(flux > 0.0, normal.dot(p) < 0.0, "positive when it faces the camera");
    }

    /// The part outside the field of view adds nothing.
    #[test]
    fn clipped_flux_counts_the_samples_in_the_image(
        shift in prop::array::uniform2(-1.2..1.2_f64), normal in unit_vectors(), size in 0.1..3.0_f64,
    ) {
        let camera = Intrinsics {
            focal_px: DVec2::new(100.0, 80.0),
            slope_min: DVec2::new(-0.7, -0.4),
            slope_max: DVec2::new(0.5, 0.8),
        };
        let triangle = triangle_at(DVec3::new(shift[0], shift[1], 1.0), normal, 0.0, size);
        let in_image = |ray: DVec3| {
            let distance = triangle[0].dot(normal) / ray.dot(normal);
            distance > 0.0 && camera.contains(ray) && ray_meets_triangle_in_front(ray, triangle)
        };
        let count = count_samples(&camera, DVec2::ZERO, 100.0, in_image);
        // The clipped outline is at most as long as that of the image, 1.2 f_x by 1.2 f_y.
        let longest_outline = 2.0 * (120.0 + 96.0);
        let flux = camera.flux_through_triangle(triangle);
        prop_assert!((flux.abs() - count).abs() < longest_outline, "{flux} {count}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Compares the visible cap of a sphere with counted samples. Its outline is that of the sphere,
    /// so every ray that meets the sphere counts once.
    #[test]
    fn flux_through_curved_patch_is_its_sample_count(p in points(), share in 0.05..0.8_f64) {
        let radius = share * p.z;
        let unit = wide_camera(DVec2::ONE);
        let focal_px = (4000.0 / unit.flux_through_disk(p, -p.normalize(), radius)).sqrt();
        let camera = wide_camera(DVec2::splat(focal_px));
        let (a, b) = common::frame(-p);
        let widest = (radius / p.length()).acos();
        let cap = |u: f64, v: f64| {
            let local = from_spherical(radius, u * widest, v * core::f64::consts::TAU);
            p + a * local.x + b * local.y - p.normalize() * local.z
        };
        let rim: Vec<DVec2> = (0..64).map(|i| camera.project_px(cap(1.0, f64::from(i) / 64.0))).collect();
        let middle = rim.iter().sum::<DVec2>() / 64.0;
        let reach_px = rim.iter().map(|px| px.distance(middle)).fold(0.0, f64::max) * 1.05 + 1.0;
        let in_view = rim.iter().all(|px| (*px / focal_px).abs().max_element() < 12.0);
        prop_assume!(in_view && reach_px < 1500.0);
        let count = count_samples(&camera, middle, reach_px, |ray| {
            ray.dot(p) > 0.0 && ray.cross(p).length() <= radius * ray.length()
        });
        let outline: f64 = (0..64).map(|i| rim[i].distance(rim[(i + 1) % 64])).sum();
        let flux = camera.flux_through_patch(64, cap);
        prop_assert!((flux - count).abs() < outline, "{} {}", flux, count);
    }
}

/// Like `ray_meets_triangle`, but also for triangles that reach behind the camera.
fn ray_meets_triangle_in_front(ray: DVec3, [p0, p1, p2]: [DVec3; 3]) -> bool {
    let (e1, e2) = (p1 - p0, p2 - p0);
    let across = ray.cross(e2);
    let determinant = e1.dot(across);
    let u = -p0.dot(across) / determinant;
    let perpendicular = (-p0).cross(e1);
    let v = ray.dot(perpendicular) / determinant;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && e2.dot(perpendicular) / determinant > 0.0
}

proptest! {
    /// Property 1: flux equals the area of the projected polygon.
    #[test]
    fn flux_equals_projected_area(
        camera in off_centre_cameras(), p in points(), normal in unit_vectors(), size in 0.01..0.9_f64,
    ) {
        let triangle = triangle_at(p, normal, 0.0, size * p.z);
        prop_assume!(triangle.iter().all(|corner| corner.z > 0.05 * p.z));
        let [a, b, c] = triangle.map(|p| camera.project_px(p));
        // Triangles that are counter-clockwise for the camera are clockwise with y down.
        let area = -0.5 * (b - a).perp_dot(c - a);
        let scale = (b - a).length() * (c - a).length();
        assert_close(camera.flux_through_triangle_in_view(triangle), area, scale, 1e-7);
    }

    /// The clipped flux of a triangle is the sum over its pieces, and never exceeds the image.
    #[test]
    fn clipped_flux_is_additive_and_at_most_the_image(
        camera in off_centre_cameras(),
        corners in prop::array::uniform3(prop::array::uniform3(-9.0..9.0_f64)),
    ) {
        let [a, b, c] = corners.map(DVec3::from);
        let middle = (a + b + c) / 3.0;
        let whole = camera.flux_through_triangle([a, b, c]);
        let parts = [[a, b, middle], [b, c, middle], [c, a, middle]];
        let sum: f64 = parts.into_iter().map(|part| camera.flux_through_triangle(part)).sum();
        let image = camera.image_px().x * camera.image_px().y;
        prop_assert!(whole.abs() <= image * (1.0 + 1e-6), "{whole} {image}");
        assert_close(sum, whole, image, 1e-6);
    }

    /// Eq. 11: patches with the same solid angle have the same flux. Here they are a piece of a sphere
    /// around the camera and a flat patch.
    #[test]
    fn flux_through_patches_of_one_solid_angle_is_equal(
        camera in off_centre_cameras(), rho in 0.1..50.0_f64,
    ) {
        let slope = |u: f64, v: f64| {
            camera.slope_min + (camera.slope_max - camera.slope_min) * DVec2::new(u, v)
        };
        // The parameters are swapped, so that the front faces the camera.
        let curved = camera.flux_through_patch(48, |u, v| slope(v, u).extend(1.0).normalize() * rho);
        let flat = camera.flux_through_patch(2, |u, v| slope(v, u).extend(1.0) * rho);
        let image = camera.image_px().x * camera.image_px().y;
        assert_close(flat, image, image, 1e-9);
        // Facets and image both have straight edges, so the only error is rounding.
        assert_close(curved, image, image, 1e-6);
    }

    /// A closed surface in view has no net flux (eq. 9, 10).
    #[test]
    fn flux_through_a_closed_surface_is_zero(p in points(), share in 0.01..0.9_f64) {
        let camera = wide_camera(DVec2::splat(100.0));
        let radius = share * p.z;
        let sphere = |u: f64, v: f64| {
            let (turn, tilt) = (u * core::f64::consts::TAU, v * core::f64::consts::PI);
            p + from_spherical(radius, tilt, turn)
        };
        let net = camera.flux_through_patch(24, sphere);
        let front = camera.flux_through_disk(p, -p.normalize(), radius);
        prop_assume!(p.length() < 11.0 * p.z && front.is_finite());
        prop_assert!(net.abs() <= 1e-6 * camera.strength(p) * radius * radius * 40.0);
    }

    /// Compares the closed form of a disk with its facets.
    #[test]
    fn flux_through_a_disk_has_a_closed_form(
        p in points(), normal in unit_vectors(), share in 0.01..0.8_f64,
    ) {
        let camera = wide_camera(DVec2::splat(100.0));
        let (a, b) = common::frame(normal);
        let radius = share * p.z;
        let rim = |turn: f64| p + (a * turn.cos() + b * turn.sin()) * radius;
        let facets: f64 = (0..4096).map(|i| {
            let turn = |i: i32| f64::from(i) / 4096.0 * core::f64::consts::TAU;
            camera.flux_through_triangle_in_view([p, rim(turn(i)), rim(turn(i + 1))])
        }).sum();
        let disk = camera.flux_through_disk(p, normal, radius);
        assert_close(facets, disk, disk, 1e-4);
    }
}

#[test]
fn a_triangle_through_the_camera_has_no_flux() {
    let camera = wide_camera(DVec2::splat(100.0));
    let edge_on = [
        DVec3::ZERO,
        DVec3::new(0.0, 0.0, 1.0),
        DVec3::new(1.0, 0.0, 1.0),
    ];
    assert_eq!(camera.flux_through_triangle(edge_on), 0.0);
}
