//! Errata and unstated assumptions of the paper, as listed on the crate's front page.

use crate::common::*;

fn camera() -> Intrinsics {
    square_camera(1000.0)
}

/// Appendix iii prints (z, 0, x) and (0, z, y) as the normals of E₁ and E₂. They are perpendicular
/// to these planes only with the last signs inverted. The sine stays the same.
#[test]
fn appendix_iii_normals_have_the_wrong_sign() {
    let p = dvec3(1.0, 2.0, 3.0);
    let e1 = [p, DVec3::Y];
    let e2 = [p, DVec3::X];
    let is_normal = |normal: DVec3, plane: [DVec3; 2]| plane.iter().all(|d| d.dot(normal) == 0.0);
    assert!(!is_normal(dvec3(p.z, 0.0, p.x), e1));
    assert!(!is_normal(dvec3(0.0, p.z, p.y), e2));
    let (n1, n2) = (dvec3(p.z, 0.0, -p.x), dvec3(0.0, p.z, -p.y));
    assert!(is_normal(n1, e1) && is_normal(n2, e2));
    let sine = n1.normalize().cross(n2.normalize()).length();
    let printed = p.z
        * (p.length_squared() / ((p.x.powi(2) + p.z.powi(2)) * (p.y.powi(2) + p.z.powi(2)))).sqrt();
    assert_close(sine, printed, 1.0, 1e-12);
}

/// Eq. 15 is an area: doubling the destination's focal length multiplies the "size" by four.
#[test]
fn equation_15_is_an_area_not_a_diameter() {
    let surfel = Surfel {
        center: dvec3(1.0, 0.5, 4.0),
        normal: DVec3::NEG_Z,
        radius: 1e-4,
    };
    let cameras = [1000.0, 2000.0].map(square_camera);
    let areas = cameras.map(|camera| camera.projection_factor(surfel.center, surfel.normal));
    assert_close(areas[1] / areas[0], 4.0, 4.0, 1e-12);
    let widths = cameras.map(|camera| SplatKernel::new(&camera, &surfel).axes_px[0].length());
    assert_close(widths[1] / widths[0], 2.0, 2.0, 1e-12);
}

/// Fig. 13 keeps the area of an infinitely small surfel. The image of a disk 60° off axis, with a
/// radius of half its depth, is 1.37 times as large.
#[test]
fn kept_area_falls_short_for_large_surfels() {
    let center = from_spherical(2.0, 60.0_f64.to_radians(), 0.3);
    let surfel = Surfel {
        center,
        normal: -center.normalize(),
        radius: 0.5 * center.z,
    };
    let kernel = SplatKernel::new(&camera(), &surfel);
    let ratio = kernel.area_px2() / kernel.affine_area_px2();
    assert_close(ratio, 1.365, 1.0, 2e-3);
}

/// The thin axis of the kernel must be measured perpendicular to the sight ray, *before* the radial
/// stretch. The projected normal in the image turns it too far. In the worst case, 60° off axis, the
/// radius of the ellipse is wrong by more than a third.
#[test]
fn kernel_orientation_is_measured_across_the_sight_ray() {
    let center = from_spherical(2.0, 60.0_f64.to_radians(), 0.0);
    let worst = (1..90).map(|degrees| {
        let turn = f64::from(degrees).to_radians();
        let sight = center.normalize();
        let across = dvec3(sight.z, 0.0, -sight.x) * turn.cos() + DVec3::Y * turn.sin();
        let normal = (-sight + across * 2.0).normalize();
        let surfel = Surfel {
            center,
            normal,
            radius: 1e-3,
        };
        let right = SplatKernel::new(&camera(), &surfel);
        // The direction of the normal in the image replaces `across`.
        let in_image = camera().displace_px(center, normal).normalize();
        let turned = dvec3(sight.z, 0.0, -sight.x) * in_image.x + DVec3::Y * in_image.y;
        let misread = Surfel {
            normal: (-sight + turned * 2.0).normalize(),
            ..surfel
        };
        difference(&right, &SplatKernel::new(&camera(), &misread))
    });
    let worst = worst.fold(0.0, f64::max);
    assert!((1.0 / 3.0..0.35).contains(&worst), "{worst}");
}

/// Largest relative difference of radius between two centred ellipses.
fn difference(a: &SplatKernel, b: &SplatKernel) -> f64 {
    let radius = |kernel: &SplatKernel, direction: DVec2| {
        let inverse = DMat2::from_cols(kernel.axes_px[0], kernel.axes_px[1]).inverse();
        1.0 / (inverse * direction).length()
    };
    let directions = (0..180).map(|degrees| DVec2::from_angle(f64::from(degrees).to_radians()));
    directions
        .map(|d| (radius(a, d) / radius(b, d) - 1.0).abs())
        .fold(0.0, f64::max)
}

/// On the optical axis the curl is zero, but the image of a tilted surfel is not symmetric.
#[test]
fn curl_alone_does_not_explain_the_asymmetry() {
    let surfel = Surfel {
        center: DVec3::Z * 2.0,
        normal: dvec3(1.0, 0.0, -1.0).normalize(),
        radius: 0.5,
    };
    assert_eq!(surfel.keystone_from_curl(&camera()), DVec2::ZERO);
    let keystone = SplatKernel::new(&camera(), &surfel).keystone.length();
    assert_close(keystone, 0.5 * 0.5_f64.sqrt() / 2.0, 1.0, 1e-12);
}

/// A linear shear of a disk is an ellipse around the same centre.
#[test]
fn an_affine_shear_is_symmetric() {
    let kernel = SplatKernel {
        center_px: DVec2::ZERO,
        axes_px: [dvec2(3.0, 0.0), dvec2(1.0, 2.0)],
        keystone: dvec2(0.2, 0.1),
    };
    for degrees in 0..180 {
        let e = DVec2::from_angle(f64::from(degrees).to_radians());
        assert!((kernel.map_affine(e) + kernel.map_affine(-e)).length() < 1e-12);
    }
    assert!((kernel.map_exact(DVec2::X) + kernel.map_exact(DVec2::NEG_X)).length() > 1.0);
}

/// §3.2 proposes the curl as the measure of variation. It measures only variation across the sight
/// rays: on the axis it is zero, although the strength falls by 2/ρ per unit.
#[test]
fn curl_ignores_the_fall_with_distance() {
    let p = DVec3::Z * 5.0;
    assert_eq!(camera().curl_magnitude(p), 0.0);
    let relative = camera().gradient(p).length() / camera().strength(p);
    assert_close(relative, 2.0 / 5.0, 1.0, 1e-12);
}

/// §3.5: with cameras on both sides of a surface, the sum of fields is not the joint density. The
/// fields of two cameras face to face cancel out.
#[test]
fn compound_field_assumes_cameras_on_one_side() {
    let cameras = [DVec3::NEG_Z, DVec3::Z].map(|origin| posed(camera(), origin, DVec3::ZERO));
    assert!(compound_field(&cameras, DVec3::ZERO).length() < 1e-9);
    let density = compound_density(&cameras, DVec3::ZERO, DVec3::NEG_Z);
    assert_close(density, 1e6, 1e6, 1e-12);
}

/// §3.3: equal strength gives equal projected size only for equal inclination to the sight ray.
#[test]
fn equal_strength_does_not_make_equal_projected_size() {
    let p = dvec3(0.0, 0.0, 10.0);
    let strength = camera().strength(p);
    let on_level = from_spherical(camera().level_radius(strength, 1.0_f64.cos()), 1.0, 0.0);
    assert_close(camera().strength(on_level), strength, strength, 1e-12);
    // The same disk, perpendicular to the axis, is at both places.
    let sizes = [p, on_level].map(|center| camera().projection_factor(center, DVec3::NEG_Z));
    assert_close(sizes[1] / sizes[0], 1.0_f64.cos(), 1.0, 1e-9);
}

/// §4.1.4 uses the geometric mean of the filter's axes. On a floor seen at 5°, the longer axis
/// covers 3.4 times as many texels as the level assumes, which is 1.8 levels.
#[test]
fn mip_level_is_mean_of_filter_axes() {
    let grazing = 5.0_f64.to_radians();
    let p = DVec3::Z * 10.0;
    let along = dvec3(0.0, grazing.sin(), grazing.cos());
    let kernel = FilterKernel::new(&camera(), p, DVec3::X, along).unwrap();
    let axes = [kernel.texels_per_px_x, kernel.texels_per_px_y].map(DVec2::length);
    let ratio = axes[0].max(axes[1]) / kernel.area_texels().sqrt();
    assert_close(ratio, 1.0 / grazing.sin().sqrt(), 1.0, 1e-9);
    assert_close(ratio, 3.39, 1.0, 0.01);
    assert_close(ratio.log2(), 1.76, 1.0, 0.01);
}

/// Fig. 18: on a plane perpendicular to the axis of a camera, the density is f²/z² everywhere. The
/// convergent point can be better than other positions only on other surfaces, or by its focal length.
#[test]
fn perpendicular_plane_is_sampled_evenly_from_anywhere() {
    for x in [-9.0, 0.0, 7.0] {
        let p = dvec3(x, 0.3 * x, 4.0);
        let density = camera().projection_factor(p, DVec3::NEG_Z);
        assert_close(density, 1000.0 * 1000.0 / 16.0, density, 1e-12);
    }
}
