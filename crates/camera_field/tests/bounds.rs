//! Compares the bounds over a sphere with samples of the sphere: they hold, are tight, monotone and never NaN.
#![expect(
    clippy::disallowed_methods,
    reason = "tests may use angles and powers; selection does not run here"
)]

mod common;

use camera_field::{Camera, Intrinsics, OrthographicIntrinsics, SphereBound, SphereExtent};
use common::{any_vec3, off_centre_cameras, points, single, spread_directions, unit_vectors};
use glam::{DVec3, Vec2, Vec3};
use proptest::prelude::*;

const SAMPLES: u32 = 600;

/// Points of a ball, on three shells.
fn ball_points(center: DVec3, radius: f64) -> impl Iterator<Item = Vec3> {
    [1.0, 0.7, 0.0].into_iter().flat_map(move |shell| {
        spread_directions(SAMPLES).map(move |unit| (center + unit * (radius * shell)).as_vec3())
    })
}

fn greatest(points: impl Iterator<Item = Vec3>, quantity: impl Fn(Vec3) -> f32) -> f32 {
    points.map(quantity).fold(0.0, f32::max)
}

fn bounds(camera: &Intrinsics, center: Vec3, radius: f32) -> [SphereBound; 2] {
    [
        camera.strength_over_sphere(center, radius),
        camera.pixel_scale_over_sphere(center, radius),
    ]
}

proptest! {
    #[test]
    fn sphere_bounds_hold_at_every_point_of_the_sphere(
        camera in off_centre_cameras(), center in points(), share in 0.0..1.5_f64,
    ) {
        let radius = share * center.length();
        let camera = single(&camera);
        // Samples are moved inwards by a rounding error, so that they are in the f32 sphere.
        let inside = ball_points(center, radius * (1.0 - 1e-6));
        let (center, radius) = (center.as_vec3(), (radius * (1.0 + 1e-6)) as f32);
        let [strength, scale] = bounds(&camera, center, radius).map(SphereBound::or_infinity);
        for p in inside {
            prop_assert!(camera.strength(p) <= strength, "strength at {p}");
            prop_assert!(camera.pixel_scale(p) <= scale, "pixel scale at {p}");
            prop_assert!(!camera.contains(p) || camera.touches_sphere(center, radius));
        }
    }

    /// The bound of the strength is at most 12 % too high, and that of the pixel scale 6 %. The
    /// spheres have an angular radius below 6° and are away from the edges of the image.
    #[test]
    fn sphere_bounds_are_tight(
        rho in 0.1..100.0_f64, off_axis_deg in 0.0..75.0_f64, around in 0.0..6.0_f64,
        share in 0.0..0.1_f64,
    ) {
        let camera = single(&common::wide_camera(glam::DVec2::splat(1000.0)));
        let center = common::from_spherical(rho, off_axis_deg.to_radians(), around);
        let radius = share * rho;
        let (c, r) = (center.as_vec3(), radius as f32);
        let strength = greatest(ball_points(center, radius), |p| camera.strength(p));
        let scale = greatest(ball_points(center, radius), |p| camera.pixel_scale(p));
        prop_assert!(camera.strength_over_sphere(c, r).or_infinity() <= 1.12 * strength);
        prop_assert!(camera.pixel_scale_over_sphere(c, r).or_infinity() <= 1.06 * scale);
    }

    /// Any sphere that contains a visible point touches the view, and its bounds hold at this point.
    #[test]
    fn spheres_that_reach_into_the_view_touch_it(
        camera in off_centre_cameras(), across in prop::array::uniform2(0.0..1.0_f64),
        depth in 0.1..50.0_f64, direction in unit_vectors(), share in 0.0..3.0_f64,
    ) {
        let range = camera.slope_max - camera.slope_min;
        let slope = camera.slope_min + range * glam::DVec2::from(across);
        let p = slope.extend(1.0) * depth;
        let radius = share * depth;
        let center = (p + direction * (radius * (1.0 - 1e-5))).as_vec3();
        let (camera, radius) = (single(&camera), (radius + 1e-6 * p.length()) as f32);
        prop_assert!(camera.touches_sphere(center, radius));
        let bound = camera.strength_over_sphere(center, radius).or_infinity();
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
        let turn = |across: f64, along: f64, z: f64| match side {
            0 | 1 => DVec3::new(across, along, z),
            _ => DVec3::new(along, across, z),
        };
        let along = if side < 2 { middle.y } else { middle.x };
        let on_edge = turn(edge, along, 1.0) * depth;
        let normal = turn(outwards, 0.0, -outwards * edge).normalize();
        let radius = share * depth;
        let camera = single(&camera);
        let touches = |distance: f64| {
            let center = on_edge + normal * distance;
            camera.touches_sphere(center.as_vec3(), radius as f32)
        };
        prop_assert!(!touches(radius * 1.001 + 1e-5 * on_edge.length()));
        prop_assert!(touches(radius * 0.999 - 1e-5 * on_edge.length()));
    }

    /// The bound of a sphere with radius zero is the value at its centre, within 2e-5.
    #[test]
    fn sphere_bounds_of_a_point_equal_its_values(camera in off_centre_cameras(), p in points()) {
        let camera = single(&camera);
        let p = p.as_vec3();
        prop_assume!(camera.contains(p));
        let [strength, scale] = bounds(&camera, p, 0.0).map(SphereBound::or_infinity);
        prop_assert!(strength <= camera.strength(p) * (1.0 + 2e-5));
        prop_assert!(scale <= camera.pixel_scale(p) * (1.0 + 2e-5));
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
                inner.or_infinity() <= outer.or_infinity() * (1.0 + 1e-4),
                "{inner:?} in {outer:?}"
            );
        }
    }

    #[test]
    fn sphere_bounds_are_never_nan_or_negative(
        camera in off_centre_cameras(), center in any_vec3(), radius in proptest::num::f32::ANY,
    ) {
        for bound in bounds(&single(&camera), center, radius) {
            if let SphereBound::Bounded(value) = bound {
                prop_assert!(value >= 0.0 && value.is_finite());
            }
        }
    }

    /// Scaling the scene scales the bound, for lengths from 1e-18 to 1e18 units.
    #[test]
    fn sphere_bounds_support_lengths_from_1e_18_to_1e18(p in points(), power in -16..16_i32) {
        let camera = single(&common::wide_camera(glam::DVec2::splat(1000.0)));
        let unit = 10.0_f64.powi(power);
        let near = camera.pixel_scale_over_sphere(p.as_vec3(), 0.0).or_infinity();
        let scaled = camera.pixel_scale_over_sphere((p * unit).as_vec3(), 0.0).or_infinity();
        common::assert_close(f64::from(scaled) * unit, near.into(), near.into(), 1e-4);
    }
}

fn camera() -> Intrinsics {
    Intrinsics::centered(1000.0, Vec2::new(1920.0, 1080.0))
}

#[test]
fn a_sphere_around_the_camera_is_unbounded() {
    for center in [Vec3::ZERO, Vec3::Z, Vec3::NEG_Z, Vec3::X] {
        let found = bounds(&camera(), center, 1.5);
        assert_eq!(found, [SphereBound::Unbounded; 2], "{center}");
    }
}

#[test]
fn nan_infinite_and_negative_inputs_are_unbounded() {
    let camera = camera();
    for center in [Vec3::splat(f32::NAN), Vec3::new(0.0, f32::INFINITY, 5.0)] {
        assert_eq!(camera.sphere_extent(center, 1.0), SphereExtent::Unbounded);
    }
    for radius in [f32::NAN, -1.0, f32::INFINITY] {
        let extent = camera.sphere_extent(Vec3::new(0.0, 0.0, 5.0), radius);
        assert_eq!(extent, SphereExtent::Unbounded);
    }
}

#[test]
fn nan_touches_every_view() {
    let camera = camera();
    assert!(camera.touches_sphere(Vec3::splat(f32::NAN), 1.0));
    assert!(camera.touches_sphere(Vec3::Z, f32::NAN));
    assert!(!camera.contains(Vec3::splat(f32::NAN)));
}

#[test]
fn spheres_outside_the_view_have_bound_zero() {
    for center in [
        Vec3::NEG_Z * 5.0,
        Vec3::new(50.0, 0.0, 5.0),
        Vec3::new(0.0, -50.0, 5.0),
    ] {
        assert!(!camera().touches_sphere(center, 1.0));
        assert_eq!(
            bounds(&camera(), center, 1.0),
            [SphereBound::Bounded(0.0); 2]
        );
    }
}

/// A sphere that crosses the camera plane beside the view still has a finite bound.
#[test]
fn crossing_the_camera_plane_outside_the_view_stays_bounded() {
    let beside = Vec3::new(3.0, 0.0, 0.5);
    let SphereBound::Bounded(value) = camera().strength_over_sphere(beside, 2.5) else {
        panic!("unbounded");
    };
    assert!(value > 0.0);
}

#[test]
fn orthographic_bounds_are_the_constant_or_zero() {
    let camera = Camera::Orthographic(OrthographicIntrinsics {
        pixels_per_unit: Vec2::new(20.0, 10.0),
        min: Vec2::splat(-5.0),
        max: Vec2::splat(5.0),
    });
    let inside = Vec3::new(5.5, 0.0, -3.0);
    assert_eq!(
        camera.strength_over_sphere(inside, 1.0),
        SphereBound::Bounded(200.0)
    );
    assert_eq!(
        camera.pixel_scale_over_sphere(inside, 1.0),
        SphereBound::Bounded(20.0)
    );
    assert_eq!(
        camera.strength_over_sphere(inside, 0.1),
        SphereBound::Bounded(0.0)
    );
    let unusable = camera.strength_over_sphere(Vec3::NAN, 1.0);
    assert_eq!(unusable, SphereBound::Unbounded);
}
