//! Splat kernels (eq. 15, Fig. 13): the paper's steps, the keystone and the exact image.

use crate::common::*;

/// Surfels that face the camera. Their radius is at most `largest` times their depth.
fn surfels(largest: f64) -> impl Strategy<Value = Surfel> {
    (facing(0.02), 1e-3..largest).prop_map(|((center, normal), size)| Surfel {
        center,
        normal,
        radius: size * center.z,
    })
}

fn unit_circle() -> impl Iterator<Item = DVec2> {
    (0..64).map(|i| DVec2::from_angle(f64::from(i) / 64.0 * TAU))
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
        let (a, b) = surfel.axes();
        for e in unit_circle() {
            let expected = camera.project_px(surfel.center + a * e.x + b * e.y);
            let error = kernel.map_exact(e).distance(expected);
            prop_assert!(error <= 1e-8 * (scale + expected.length()), "{error}");
            prop_assert!(kernel.unmap_exact(expected).distance(e) <= 1e-6);
            prop_assert!(kernel.unmap_affine(kernel.map_affine(e)).distance(e) <= 1e-9);
            if kernel.keystone.length() < 0.49 {
                let found = kernel.unmap_sheared(kernel.map_sheared(e)).unwrap();
                prop_assert!(found.distance(e) <= 1e-6, "{found} {e}");
            }
        }
    }

    /// The product of the three steps of Fig. 13, in the plane perpendicular to the sight ray, is the
    /// derivative of the projection.
    #[test]
    fn paper_kernel_is_affine_image_of_disk(
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
        let affine = PI * surfel.radius.powi(2) * factor;
        assert_close(kernel.affine_area_px2(), affine, affine, 1e-9);
        let disk = camera.flux_through_disk(surfel.center, surfel.normal, surfel.radius);
        assert_close(kernel.area_px2(), disk, disk, 1e-9);
        prop_assert!(disk >= affine);
    }

    #[test]
    fn exact_image_is_an_off_centre_ellipse(
        camera in wide_cameras(), surfel in surfels(0.9),
    ) {
        let kernel = SplatKernel::new(&camera, &surfel);
        let (center, [a, b]) = kernel.ellipse();
        for e in unit_circle() {
            let rim = kernel.map_exact(e) - center;
            let on_ellipse = dvec2(rim.perp_dot(b), a.perp_dot(rim)) / a.perp_dot(b);
            assert_close(on_ellipse.length(), 1.0, 1.0, 1e-6);
        }
        let area = PI * a.perp_dot(b).abs();
        assert_close(area, kernel.area_px2(), area, 1e-9);
    }

    /// The keystone is a third of curl over strength plus a distance term, which is zero for a disk
    /// perpendicular to the sight ray.
    #[test]
    fn keystone_is_sum_of_curl_and_distance_terms(
        camera in wide_cameras(), surfel in surfels(0.9),
    ) {
        let sight = surfel.center.normalize();
        let across = Surfel { normal: -sight, ..surfel };
        for surfel in [surfel, across] {
            let keystone = SplatKernel::new(&camera, &surfel).keystone;
            let (a, b) = surfel.axes();
            let by_distance = dvec2(sight.dot(a), sight.dot(b)) / surfel.center.length();
            let sum = surfel.keystone_from_curl(&camera) + by_distance;
            prop_assert!(sum.distance(keystone) <= 1e-9, "{sum} {keystone}");
        }
        let tan_phi = surfel.center.x.hypot(surfel.center.y) / surfel.center.z;
        let expected = surfel.radius / surfel.center.length() * tan_phi;
        assert_close(across.keystone_from_curl(&camera).length(), expected, 1.0, 1e-9);
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

/// Eq. 15: the area of a splat is the area per sample in the destination image.
#[test]
fn splat_area_is_the_area_per_projected_sample() {
    let (p, normal) = (dvec3(0.4, -0.3, 2.0), dvec3(0.1, 0.3, -1.0).normalize());
    let [source, destination] =
        [100.0, 700.0].map(|f| square_camera(f).projection_factor(p, normal));
    // Both cameras are at one place, so the area is the squared ratio of focal lengths, (700/100)².
    assert_close(splat_area_px2(destination, source), 49.0, 49.0, 1e-12);
}
