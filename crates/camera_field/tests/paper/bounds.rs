//! Compares the bounds over a sphere with samples of the sphere: they hold, are tight, monotone and never NaN.

use camera_field::{Camera, FieldOfView, Intrinsics, OrthographicIntrinsics, SeenSphere};
use glam::{Vec2, Vec3, vec3};

use crate::common::{
    self, DVec2, DVec3, TAU, dvec3, from_spherical, off_centre_cameras, points, single,
    unit_vectors,
};
use proptest::prelude::*;

/// Points of a ball: 600 directions on a golden-angle spiral, on three shells.
fn ball_points(center: DVec3, radius: f64) -> impl Iterator<Item = Vec3> {
    const GOLDEN_ANGLE: f64 = 0.381_966_011_250_105 * TAU;
    [1.0, 0.7, 0.0].into_iter().flat_map(move |shell| {
        (0..600).map(move |index| {
            let z = 1.0 - 2.0 * (f64::from(index) + 0.5) / 600.0;
            let unit = from_spherical(1.0, z.acos(), GOLDEN_ANGLE * f64::from(index));
            (center + unit * (radius * shell)).as_vec3()
        })
    })
}

fn bounds(camera: &Intrinsics, center: Vec3, radius: f32) -> [f32; 2] {
    let camera = Camera::Perspective(*camera);
    [
        camera.strength_over_sphere(center, radius),
        camera.pixel_scale_over_sphere(center, radius),
    ]
}

fn touches(camera: &Intrinsics, center: Vec3, radius: f32) -> bool {
    Camera::Perspective(*camera).touches_sphere(center, radius)
}

/// The strength over a sphere, with branches: secant and depth as the module's documentation has them.
fn naive_strength(camera: &Intrinsics, center: Vec3, radius: f32) -> f32 {
    const ROUNDING: f32 = 8.0 * f32::EPSILON;
    if !center.is_finite() || radius.is_nan() || radius < 0.0 {
        return f32::INFINITY;
    }
    if !touches(camera, center, radius) {
        return 0.0;
    }
    let distance = center.length();
    let gap = distance * (1.0 - ROUNDING) - radius;
    if gap <= 0.0 || gap.is_nan() {
        return f32::INFINITY;
    }
    let off_axis = (center.x * center.x + center.y * center.y).sqrt();
    let tangent_length = (gap * (distance + radius)).sqrt();
    let cosine = (center.z * tangent_length - off_axis * radius) / center.length_squared();
    let corner = camera.max_secant();
    let secant = match cosine - ROUNDING {
        cosine if cosine * corner > 1.0 => 1.0 / cosine,
        _ => corner,
    };
    let depth = (center.z - radius).max(gap / secant);
    camera.constant_px2() * secant / (depth * depth) * (1.0 + ROUNDING)
}

proptest! {
    #[test]
    fn branch_free_strength_equals_naive(
        camera in off_centre_cameras(), center in points(), share in -0.1..1.5_f64,
    ) {
        let camera = single(&camera);
        let (center, radius) = (center.as_vec3(), (share * center.length()) as f32);
        let [strength, _] = bounds(&camera, center, radius);
        let naive = naive_strength(&camera, center, radius);
        prop_assert_eq!(strength.to_bits(), naive.to_bits());
    }

    /// No visible point of a sphere has a larger aspect ratio than its bound, nor a strength that differs from the
    /// centre's by more than the change over the sphere.
    #[test]
    fn aspect_ratio_and_change_hold_at_every_point(
        camera in off_centre_cameras(), center in points(), share in 0.0..0.2_f64,
    ) {
        let camera = single(&camera);
        let radius = share * center.length();
        let inside = ball_points(center, radius * (1.0 - 1e-6));
        let view = FieldOfView::of(&Camera::Perspective(camera));
        let sphere = SeenSphere::new(center.as_vec3(), (radius * (1.0 + 1e-6)) as f32);
        let aspect_ratio = view.aspect_ratio(&sphere);
        let over = view.over_sphere(&sphere, view.excludes(&sphere));
        let bound = over.bound(view.strength(&over), 0.0);
        for p in inside.filter(|p| camera.contains(*p)) {
            prop_assert!(Intrinsics::aspect_ratio(p) <= aspect_ratio, "{p}");
            // To first order, the gradient bounds the change; 20 % of the distance is not small.
            for max_change in [0.01, 0.1] {
                let sample = view.sampled_where_flat(&sphere, &over, max_change, bound);
                let is_sampled = sample < bound;
                let most = sample * (1.0 + max_change + 3.0 * max_change * max_change) * (1.0 + 1e-5);
                prop_assert!(!is_sampled || camera.strength(p) <= most, "{p}");
            }
        }
    }

    #[test]
    fn sphere_bounds_hold_at_every_point(
        camera in off_centre_cameras(), center in points(), share in 0.0..1.5_f64,
    ) {
        let radius = share * center.length();
        let camera = single(&camera);
        // Samples are moved inwards by a rounding error, so that they are in the f32 sphere.
        let inside = ball_points(center, radius * (1.0 - 1e-6));
        let (center, radius) = (center.as_vec3(), (radius * (1.0 + 1e-6)) as f32);
        let [strength, scale] = bounds(&camera, center, radius);
        for p in inside {
            prop_assert!(camera.strength(p) <= strength, "strength at {p}");
            prop_assert!(camera.pixel_scale(p) <= scale, "pixel scale at {p}");
            prop_assert!(!camera.contains(p) || touches(&camera, center, radius));
        }
    }

    /// The bound of the strength is at most 12 % too high, and that of the pixel scale 6 %. The
    /// spheres have an angular radius below 6° and are away from the edges of the image.
    #[test]
    fn sphere_bounds_are_tight(
        rho in 0.1..100.0_f64, off_axis_deg in 0.0..75.0_f64, around in 0.0..6.0_f64,
        share in 0.0..0.1_f64,
    ) {
        let camera = single(&common::square_camera(1000.0));
        let center = from_spherical(rho, off_axis_deg.to_radians(), around);
        let found = bounds(&camera, center.as_vec3(), (share * rho) as f32);
        let greatest = |quantity: &dyn Fn(Vec3) -> f32| {
            ball_points(center, share * rho).map(quantity).fold(0.0, f32::max)
        };
        prop_assert!(found[0] <= 1.12 * greatest(&|p| camera.strength(p)));
        prop_assert!(found[1] <= 1.06 * greatest(&|p| camera.pixel_scale(p)));
    }

    /// Any sphere that contains a visible point touches the view, and its bounds hold at this point.
    #[test]
    fn spheres_that_reach_into_the_view_touch_it(
        camera in off_centre_cameras(), across in prop::array::uniform2(0.0..1.0_f64),
        depth in 0.1..50.0_f64, direction in unit_vectors(), share in 0.0..3.0_f64,
    ) {
        let range = camera.slope_max - camera.slope_min;
        let slope = camera.slope_min + range * DVec2::from(across);
        let p = slope.extend(1.0) * depth;
        let radius = share * depth;
        let center = (p + direction * (radius * (1.0 - 1e-5))).as_vec3();
        let (camera, radius) = (single(&camera), (radius + 1e-6 * p.length()) as f32);
        prop_assert!(touches(&camera, center, radius));
        let [bound, _] = bounds(&camera, center, radius);
        prop_assert!(camera.strength(p.as_vec3()) <= bound * (1.0 + 1e-5));
    }

    /// A sphere touches the view exactly if its distance from the nearest side of the frustum is below
    /// its radius. The other sides must be far away.
    #[test]
    fn spheres_beside_the_view_do_not_touch_it(
        camera in off_centre_cameras(), depth in 0.1..50.0_f64, share in 0.001..2.0_f64,
        side in 0..4_usize,
    ) {
        let (min, max) = (camera.slope_min, camera.slope_max);
        let edge = [min.x, max.x, min.y, max.y][side];
        let outwards = if side % 2 == 0 { -1.0 } else { 1.0 };
        let middle = (min + max) * 0.5;
        let (along, is_x) = if side < 2 { (middle.y, true) } else { (middle.x, false) };
        let turn = |across: f64, along: f64, z: f64| {
            if is_x { dvec3(across, along, z) } else { dvec3(along, across, z) }
        };
        let on_edge = turn(edge, along, 1.0) * depth;
        let normal = turn(outwards, 0.0, -outwards * edge).normalize();
        let radius = share * depth;
        let camera = single(&camera);
        let is_in_view = |distance: f64| {
            let center = on_edge + normal * distance;
            touches(&camera, center.as_vec3(), radius as f32)
        };
        prop_assert!(!is_in_view(radius * 1.001 + 1e-5 * on_edge.length()));
        prop_assert!(is_in_view(radius * 0.999 - 1e-5 * on_edge.length()));
    }

    #[test]
    fn sphere_bounds_are_monotone_under_inclusion(
        camera in off_centre_cameras(), center in points(), share in 0.0..1.2_f64,
        inner_share in 0.0..1.0_f64, direction in unit_vectors(), along in 0.0..1.0_f64,
    ) {
        let camera = single(&camera);
        let radius = share * center.length();
        let inner_radius = inner_share * radius;
        let inner_center = center + direction * (along * (radius - inner_radius));
        let outer = bounds(&camera, center.as_vec3(), (radius * (1.0 + 1e-6)) as f32);
        let inner = bounds(&camera, inner_center.as_vec3(), inner_radius as f32);
        for (outer, inner) in outer.into_iter().zip(inner) {
            prop_assert!(
                inner <= outer * (1.0 + 1e-4),
                "{inner:?} in {outer:?}"
            );
        }
    }

    #[test]
    fn sphere_bounds_are_never_nan_or_negative(
        camera in off_centre_cameras(), center in prop::array::uniform3(proptest::num::f32::ANY),
        radius in proptest::num::f32::ANY,
    ) {
        for bound in bounds(&single(&camera), Vec3::from(center), radius) {
            prop_assert!(bound >= 0.0);
        }
    }

    /// Scaling the scene scales the bound, for lengths from 1e-18 to 1e18 units.
    #[test]
    fn sphere_bounds_support_very_small_and_large_lengths(p in points(), power in -16..16_i32) {
        let camera = single(&common::square_camera(1000.0));
        let unit = 10.0_f64.powi(power);
        let [_, near] = bounds(&camera, p.as_vec3(), 0.0);
        let [_, scaled] = bounds(&camera, (p * unit).as_vec3(), 0.0);
        common::assert_close(f64::from(scaled) * unit, near.into(), near.into(), 1e-4);
    }
}

#[test]
fn degenerate_spheres_have_safe_bounds() {
    let camera = Intrinsics::centered(1000.0, Vec2::new(1920.0, 1080.0));
    let (outside, unbounded) = (0.0, f32::INFINITY);
    for (center, radius, expected, touches) in [
        // The sphere contains the camera.
        (Vec3::ZERO, 1.5, unbounded, true),
        (Vec3::NEG_Z, 1.5, unbounded, true),
        (Vec3::X, 1.5, unbounded, true),
        // The numbers are not usable.
        (Vec3::NAN, 1.0, unbounded, true),
        (vec3(0.0, f32::INFINITY, 5.0), 1.0, unbounded, true),
        (Vec3::Z * 5.0, f32::NAN, unbounded, true),
        (Vec3::Z * 5.0, f32::INFINITY, unbounded, true),
        (Vec3::Z * 5.0, -1.0, unbounded, true),
        // The sphere is outside of the view.
        (Vec3::NEG_Z * 5.0, 1.0, outside, false),
        (vec3(50.0, 0.0, 5.0), 1.0, outside, false),
        (vec3(0.0, -50.0, 5.0), 1.0, outside, false),
    ] {
        assert_eq!(
            bounds(&camera, center, radius),
            [expected; 2],
            "{center} {radius}"
        );
        assert_eq!(
            self::touches(&camera, center, radius),
            touches,
            "{center} {radius}"
        );
    }
    assert!(!camera.contains(Vec3::NAN));
    // A sphere that crosses the camera plane beside the view has a finite bound.
    let [beside, _] = bounds(&camera, vec3(3.0, 0.0, 0.5), 2.5);
    assert!(beside > 0.0 && beside.is_finite());
}

#[test]
fn orthographic_bounds_are_the_constant_or_zero() {
    let camera = Camera::Orthographic(OrthographicIntrinsics {
        pixels_per_unit: Vec2::new(20.0, 10.0),
        min: Vec2::splat(-5.0),
        max: Vec2::splat(5.0),
    });
    let beside = vec3(5.5, 0.0, -3.0);
    for (center, radius, strength, scale) in [
        (beside, 1.0, 200.0, 20.0),
        (beside, 0.1, 0.0, 0.0),
        (Vec3::NAN, 1.0, f32::INFINITY, f32::INFINITY),
    ] {
        assert_eq!(camera.strength_over_sphere(center, radius), strength);
        assert_eq!(camera.pixel_scale_over_sphere(center, radius), scale);
    }
}
