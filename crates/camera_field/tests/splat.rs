//! Tests of splat kernels (eq. 15, Fig. 13): the paper's steps, the keystone and the exact image.
#![expect(
    clippy::disallowed_methods,
    reason = "tests may use angles and powers; selection does not run here"
)]

mod common;

use camera_field::double::{Intrinsics, SplatKernel, Surfel, splat_area_px2};
use common::{assert_close, count_samples, points, unit_vectors, wide_camera, wide_cameras};
use glam::{DMat2, DVec2, DVec3};
use proptest::prelude::*;

/// Surfels that face the camera. Their radius is at most `largest` times their depth.
fn surfels(largest: f64) -> impl Strategy<Value = Surfel> {
    let facing = (points(), unit_vectors())
        .prop_map(|(p, n)| (p, if n.dot(p) > 0.0 { -n } else { n }))
        .prop_filter("edge-on", |(p, n)| -n.dot(p.normalize()) > 0.02);
    (facing, 1e-3..largest).prop_map(|((center, normal), size)| Surfel {
        center,
        normal,
        radius: size * center.z,
    })
}

fn unit_circle() -> impl Iterator<Item = DVec2> {
    (0..64).map(|i| DVec2::from_angle(f64::from(i) / 64.0 * core::f64::consts::TAU))
}

/// The point of the disk for a point `e` of the unit disk.
fn on_disk(surfel: &Surfel, e: DVec2) -> DVec3 {
    let (a, b) = surfel.axes();
    surfel.center + a * e.x + b * e.y
}

/// `A Aᵀ`, which depends on the ellipse but not on the choice of its axes.
fn shape(kernel: &SplatKernel) -> DMat2 {
    let a = DMat2::from_cols(kernel.axes_px[0], kernel.axes_px[1]);
    a * a.transpose()
}

proptest! {
    #[test]
    fn exact_map_is_the_projection_of_the_disk(camera in wide_cameras(), surfel in surfels(0.9)) {
        let kernel = SplatKernel::new(&camera, &surfel);
        let scale = kernel.axes_px[0].length() + kernel.axes_px[1].length();
        for e in unit_circle() {
            let expected = camera.project_px(on_disk(&surfel, e));
            let error = kernel.map_exact(e).distance(expected);
            prop_assert!(error <= 1e-8 * (scale + expected.length()), "{error}");
            prop_assert!(kernel.unmap_exact(expected).distance(e) <= 1e-6);
            prop_assert!(kernel.unmap_affine(kernel.map_affine(e)).distance(e) <= 1e-9);
        }
    }

    /// The product of the three steps of Fig. 13, in the plane perpendicular to the sight ray, is the
    /// derivative of the projection.
    #[test]
    fn paper_kernel_is_the_affine_image_of_the_disk(
        camera in wide_cameras(), surfel in surfels(0.5),
    ) {
        let exact = shape(&SplatKernel::new(&camera, &surfel));
        let paper = shape(&SplatKernel::paper(&camera, &surfel));
        let scale = exact.col(0).length() + exact.col(1).length();
        prop_assert!((exact - paper).col(0).length() <= 1e-8 * scale);
        prop_assert!((exact - paper).col(1).length() <= 1e-8 * scale);
    }

    /// The area of the kernel is `π r² c·n`, as in eq. 15. The keystone makes the exact image larger.
    #[test]
    fn areas_match_the_field(camera in wide_cameras(), surfel in surfels(0.5)) {
        let kernel = SplatKernel::new(&camera, &surfel);
        let factor = camera.projection_factor(surfel.center, surfel.normal);
        let affine = core::f64::consts::PI * surfel.radius.powi(2) * factor;
        assert_close(kernel.affine_area_px2(), affine, affine, 1e-9);
        let disk = camera.flux_through_disk(surfel.center, surfel.normal, surfel.radius);
        assert_close(kernel.area_px2(), disk, disk, 1e-9);
        prop_assert!(disk >= affine);
    }

    #[test]
    fn exact_image_is_an_ellipse_around_a_shifted_centre(
        camera in wide_cameras(), surfel in surfels(0.9),
    ) {
        let kernel = SplatKernel::new(&camera, &surfel);
        let (center, [a, b]) = kernel.ellipse();
        for e in unit_circle() {
            let rim = kernel.map_exact(e) - center;
            let on_ellipse = DVec2::new(rim.perp_dot(b), a.perp_dot(rim)) / a.perp_dot(b);
            assert_close(on_ellipse.length(), 1.0, 1.0, 1e-6);
        }
        let area = core::f64::consts::PI * a.perp_dot(b).abs();
        assert_close(area, kernel.area_px2(), area, 1e-9);
    }

    /// The keystone is a third of curl over strength plus a distance term.
    #[test]
    fn keystone_is_the_curl_term_and_the_distance_term(
        camera in wide_cameras(), surfel in surfels(0.9),
    ) {
        let keystone = SplatKernel::new(&camera, &surfel).keystone;
        let sight = surfel.center.normalize();
        let (a, b) = surfel.axes();
        let by_distance = DVec2::new(sight.dot(a), sight.dot(b)) / surfel.center.length();
        let sum = surfel.keystone_from_curl(&camera) + by_distance;
        prop_assert!(sum.distance(keystone) <= 1e-9, "{sum} {keystone}");
    }

    /// For a disk perpendicular to the sight ray, the curl gives the whole keystone.
    #[test]
    fn curl_gives_the_whole_keystone_across_the_sight_ray(
        camera in wide_cameras(), surfel in surfels(0.9),
    ) {
        let across = Surfel { normal: -surfel.center.normalize(), ..surfel };
        let keystone = SplatKernel::new(&camera, &across).keystone;
        prop_assert!(across.keystone_from_curl(&camera).distance(keystone) <= 1e-9);
        let tan_phi = surfel.center.x.hypot(surfel.center.y) / surfel.center.z;
        assert_close(keystone.length(), surfel.radius / surfel.center.length() * tan_phi, 1.0, 1e-9);
    }

    #[test]
    fn sheared_kernel_can_be_inverted(camera in wide_cameras(), surfel in surfels(0.5)) {
        let kernel = SplatKernel::new(&camera, &surfel);
        prop_assume!(kernel.keystone.length() < 0.49);
        for e in unit_circle() {
            let found = kernel.unmap_sheared(kernel.map_sheared(e)).unwrap();
            prop_assert!(found.distance(e) <= 1e-6, "{found} {e}");
        }
    }

    /// The error of the paper's kernel is of first order in the keystone, that of the sheared kernel of second.
    #[test]
    fn sheared_kernel_is_accurate_to_second_order(
        camera in wide_cameras(), surfel in surfels(0.3),
    ) {
        let kernel = SplatKernel::new(&camera, &surfel);
        let g = kernel.keystone.length();
        for e in unit_circle() {
            let exact = kernel.map_exact(e);
            let reach = (exact - kernel.center_px).length();
            let affine = kernel.map_affine(e).distance(exact);
            let sheared = kernel.map_sheared(e).distance(exact);
            prop_assert!(affine <= reach * g * (1.0 + 1e-9) + 1e-9);
            prop_assert!(sheared <= reach * g * g * (1.0 + 1e-9) + 1e-9);
            prop_assert!(sheared <= affine + 1e-9);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Compares the exact kernel with rays that hit the disk, within Jarník's inequality.
    #[test]
    fn exact_kernel_covers_the_samples_of_the_disk(surfel in surfels(0.6)) {
        let unit = SplatKernel::new(&wide_camera(DVec2::ONE), &surfel).area_px2();
        let camera = wide_camera(DVec2::splat((4000.0 / unit).sqrt()));
        let kernel = SplatKernel::new(&camera, &surfel);
        let (center, [a, b]) = kernel.ellipse();
        let reach_px = a.length() + b.length() + 1.0;
        prop_assume!(reach_px < 2500.0);
        let hits = |ray: DVec3| {
            let hit = ray * (surfel.center.dot(surfel.normal) / ray.dot(surfel.normal));
            hit.distance(surfel.center) <= surfel.radius
        };
        let count = count_samples(&camera, center, reach_px, hits);
        let outline_at_most = 4.0 * (a.length() + b.length());
        prop_assert!((count - kernel.area_px2()).abs() < outline_at_most);
    }
}

/// Eq. 15: the area of a splat is the area per sample in the destination image.
#[test]
fn splat_area_is_the_area_per_projected_sample() {
    let source = Intrinsics::centered(100.0, DVec2::splat(400.0));
    let destination = Intrinsics::centered(700.0, DVec2::splat(4000.0));
    let (p, normal) = (
        DVec3::new(0.4, -0.3, 2.0),
        DVec3::new(0.1, 0.3, -1.0).normalize(),
    );
    let area_px2 = splat_area_px2(
        destination.projection_factor(p, normal),
        source.projection_factor(p, normal),
    );
    // Both cameras are at one place, so the area is the squared ratio of focal lengths, (700/100)².
    assert_close(area_px2, 49.0, 49.0, 1e-12);
}
