//! Compares the field (eq. 1–7) with counted samples, and its forms with each other.

use crate::common::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Definition 1: counts samples per area on a small disk perpendicular to the sight ray. The disk
    /// is so small that the field is nearly constant on it. It contains at least 10,000 samples.
    #[test]
    fn strength_is_the_number_of_samples_per_area(p in points()) {
        let radius = 1e-3 * p.z;
        let area = PI * radius * radius;
        let camera = square_camera((20_000.0 / (square_camera(1.0).strength(p) * area)).sqrt());
        let on_disk = |ray: DVec3| {
            let hit = ray * (p.length_squared() / ray.dot(p));
            hit.distance(p) <= radius
        };
        let reach_px = camera.pixel_scale(p) * radius * 1.01;
        let count = count_samples(&camera, camera.project_px(p), reach_px, on_disk);
        assert_close(count, camera.strength(p) * area, count, 0.02);
    }
}

proptest! {
    /// Eq. 1–4: the number of samples on a segment is its projected length.
    #[test]
    fn planar_strength_counts_samples_per_length(
        y in 0.1..100.0_f64, slope in -11.0..11.0_f64,
    ) {
        let camera = PlanarCamera { focal_px: 1e7, slope_min: -12.0, slope_max: 12.0 };
        let p = dvec2(slope * y, y);
        let half = p.perp().normalize() * (1e-3 * y);
        let pixel = |p: DVec2| camera.focal_px * p.x / p.y;
        let count = (pixel(p + half).floor() - pixel(p - half).floor()).abs();
        assert_close(count, camera.strength(p) * 2.0 * half.length(), count, 1e-3);
        // Eq. 4 is eq. 3 with a direction.
        let strength = camera.focal_px * p.length() / (y * y);
        assert_close(camera.field(p).dot(-p.normalize()), strength, strength, 1e-12);
    }

    /// Eq. 2: the image has the given resolution.
    #[test]
    fn planar_focal_length_follows_resolution_and_view_angle(
        resolution_px in 1.0..8000.0_f64, fov in 0.1..2.9_f64,
    ) {
        let camera = PlanarCamera::centered(resolution_px, (0.5 * fov).tan());
        let edge = camera.focal_px * camera.slope_max;
        assert_close(edge, 0.5 * resolution_px, resolution_px, 1e-12);
        assert_close(camera.strength(dvec2(0.0, camera.focal_px)), 1.0, 1.0, 1e-12);
    }

    /// Eq. 5 from the two planar fields of appendix ii and the angle of appendix iii.
    #[test]
    fn strength_is_product_of_planar_fields_over_sine(p in points()) {
        let on_plane = |across: f64| 700.0 * p.length() / (p.z * across.hypot(p.z));
        let (n1, n2) = (dvec3(p.z, 0.0, -p.x), dvec3(0.0, p.z, -p.y));
        let sine = n1.normalize().cross(n2.normalize()).length();
        let strength = square_camera(700.0).strength(p);
        assert_close(strength, on_plane(p.x) * on_plane(p.y) / sine, strength, 1e-9);
    }

    /// Eq. 5, 6 and 7 describe the same field.
    #[test]
    fn cartesian_and_spherical_forms_agree(camera in wide_cameras(), p in points()) {
        let at = Spherical::from_cartesian(p);
        let basis = at.basis();
        let strength = camera.strength(p);
        assert_near(at.to_cartesian(), p, p.length(), 1e-12);
        assert_near(camera.field(p), basis.u_rho * camera.spherical_field(at), strength, 1e-9);
        assert_close(camera.field(p).length(), strength, strength, 1e-12);
        let curl = camera.curl(p);
        let curl_scale = curl.length() + strength / p.length();
        assert_near(curl, basis.u_theta * camera.spherical_curl(at), curl_scale, 1e-9);
        let (along, across) = camera.spherical_gradient(at);
        let gradient = basis.u_rho * along + basis.u_phi * across;
        assert_near(gradient, camera.gradient(p), gradient.length(), 1e-9);
        assert_near(basis.u_rho.cross(basis.u_phi), basis.u_theta, 1.0, 1e-12);
    }

    /// On the image plane, there is one sample per square pixel.
    #[test]
    fn density_on_the_image_plane_is_one(slope_x in -11.0..11.0_f64, slope_y in -11.0..11.0_f64) {
        let p = dvec3(slope_x, slope_y, 1.0) * 700.0;
        assert_close(square_camera(700.0).projection_factor(p, DVec3::NEG_Z), 1.0, 1.0, 1e-12);
    }

    #[test]
    fn everything_is_zero_outside_the_field_of_view(
        camera in off_centre_cameras(), p in points(), n in unit_vectors(), sign in prop::bool::ANY,
    ) {
        let p = if sign { p } else { -p };
        let px = camera.project_px(p);
        let (low, high) = (camera.slope_min * camera.focal_px, camera.slope_max * camera.focal_px);
        let seen = p.z > 0.0 && px.cmpge(low).all() && px.cmple(high).all();
        prop_assert_eq!(camera.contains(p), seen);
        if !seen {
            let vectors = [camera.field(p), camera.curl(p), camera.gradient(p)];
            prop_assert_eq!(vectors, [DVec3::ZERO; 3]);
            let factor = camera.projection_factor(p, n);
            let spherical = camera.spherical_field(Spherical::from_cartesian(p));
            let numbers = [camera.strength(p), camera.pixel_scale(p), factor, spherical];
            prop_assert_eq!(numbers, [0.0; 4]);
        }
    }

    /// §3.4: compares distances between the rays of neighbouring pixels on a plane perpendicular to
    /// the sight ray. The ratio of distances along and across the radius of the image is cos φ.
    #[test]
    fn aspect_ratio_is_the_ratio_of_sample_distances(p in points()) {
        let camera = square_camera(1e7);
        let radial = dvec2(p.x, p.y).try_normalize().unwrap_or(DVec2::X);
        let distance = |step: DVec2| {
            let pixel = camera.project_px(p) + step;
            let ray = (pixel / camera.focal_px).extend(1.0);
            (ray * (p.length_squared() / ray.dot(p))).distance(p)
        };
        let ratio = distance(radial) / distance(radial.perp());
        assert_close(ratio, Intrinsics::aspect_ratio(p), ratio, 1e-4);
        assert_close(camera.pattern_aspect_ratio(p), ratio, ratio, 1e-4);
    }

    /// Compares with the smallest and largest radius of the ellipse of one sample, for oblong pixels.
    #[test]
    fn pattern_aspect_ratio_holds_for_oblong_pixels(camera in wide_cameras(), p in points()) {
        let (a, b) = frame(p);
        let (ja, jb) = (camera.displace_px(p, a), camera.displace_px(p, b));
        let scale = |turn: f64| (ja * turn.cos() + jb * turn.sin()).length();
        let scales = (0..20_000).map(|i| scale(f64::from(i) / 20_000.0 * TAU));
        let (least, greatest) =
            scales.fold((f64::INFINITY, 0.0_f64), |(l, g), s| (l.min(s), g.max(s)));
        assert_close(camera.pattern_aspect_ratio(p), least / greatest, least / greatest, 1e-3);
        // The pixel scale bounds the largest radius, and equals it for square pixels.
        prop_assert!(greatest <= camera.pixel_scale(p) * (1.0 + 1e-12));
        let square = square_camera(camera.focal_px.x);
        let ratio = square.strength(p) / Intrinsics::aspect_ratio(p);
        assert_close(square.pixel_scale(p), ratio.sqrt(), ratio.sqrt(), 1e-12);
    }

    /// The orthographic field is the limit of a perspective camera that moves back.
    #[test]
    fn orthographic_field_is_limit_of_distant_perspective(
        p in prop::array::uniform3(-4.0..4.0_f64), n in unit_vectors(),
    ) {
        let (p, away, pixels_per_unit) = (DVec3::from(p), 1e7, dvec2(20.0, 30.0));
        let (min, max) = (DVec2::splat(-5.0), DVec2::splat(5.0));
        let near = OrthographicIntrinsics { pixels_per_unit, min, max };
        let far = Intrinsics {
            focal_px: pixels_per_unit * away,
            slope_min: min / away,
            slope_max: max / away,
        };
        let distant = p + DVec3::Z * away;
        assert_close(far.strength(distant), near.strength(p), 600.0, 1e-5);
        assert_close(far.projection_factor(distant, n), near.field(p).dot(n), 600.0, 1e-5);
        assert_close(far.curl_magnitude(distant), 0.0, 600.0, 1e-5);
    }

    /// The field of a camera in the world is that in camera space, rotated to world space.
    #[test]
    fn posed_fields_are_turned_with_the_camera(
        camera in wide_cameras(), p in points(), origin in unit_vectors(), axis in unit_vectors(),
        n in unit_vectors(),
    ) {
        prop_assume!(axis.cross(DVec3::Y).length() > 1e-3);
        let pose = Pose::looking_at(origin, origin + axis, DVec3::Y);
        let posed = PosedCamera { intrinsics: camera, pose };
        assert_near(pose.axis(), axis, 1.0, 1e-12);
        assert_close(pose.world_from_camera.determinant(), 1.0, 1.0, 1e-12);
        prop_assert!(pose.world_from_camera.y_axis.dot(DVec3::Y) < 0.0, "y points down");
        let p_world = pose.to_world(p);
        assert_near(pose.to_camera(p_world), p, 1.0 + p.length(), 1e-12);
        let expected = pose.world_from_camera * camera.field(p);
        assert_near(posed.field(p_world), expected, expected.length(), 1e-9);
        let factor = posed.projection_factor(p_world, pose.world_from_camera * n);
        assert_close(factor, camera.projection_factor(p, n), expected.length(), 1e-9);
    }

    /// §3.5: if all cameras are in front of the surface, the compound field gives the joint density.
    #[test]
    fn compound_field_gives_joint_density_from_the_front(
        focal_a in 10.0..100.0_f64, focal_b in 10.0..100.0_f64, apart in 0.0..3.0_f64,
        n in unit_vectors(),
    ) {
        let cameras = [(focal_a, -apart), (focal_b, apart)];
        let cameras = cameras.map(|(focal_px, x)| {
            posed(square_camera(focal_px), DVec3::X * x, DVec3::Z * 9.0)
        });
        let p = dvec3(0.3, 0.2, 8.0);
        let joint = compound_density(&cameras, p, n);
        let by_field = compound_field(&cameras, p).dot(n);
        let all_in_front = cameras.iter().all(|camera| camera.projection_factor(p, n) > 0.0);
        if all_in_front {
            assert_close(by_field, joint, joint, 1e-12);
        } else {
            prop_assert!(by_field <= joint + 1e-12);
        }
    }

    /// The `f32` version of each formula is within 2e-5 of the `f64` version.
    #[test]
    fn single_precision_is_close(camera in wide_cameras(), p in points(), n in unit_vectors()) {
        let (single, p32, n32) = (single(&camera), p.as_vec3(), n.as_vec3());
        let (p, n) = (p32.as_dvec3(), n32.as_dvec3());
        let (strength, scale) = (camera.strength(p), camera.pixel_scale(p));
        let factor = camera.projection_factor(p, n);
        assert_close(single.strength(p32).into(), strength, strength, 2e-5);
        assert_close(single.projection_factor(p32, n32).into(), factor, strength, 2e-5);
        assert_close(single.pixel_scale(p32).into(), scale, scale, 2e-5);
        assert_near(single.curl(p32).as_dvec3(), camera.curl(p), strength / p.z, 2e-5);
        assert_near(single.gradient(p32).as_dvec3(), camera.gradient(p), strength / p.z, 2e-5);
    }
}
