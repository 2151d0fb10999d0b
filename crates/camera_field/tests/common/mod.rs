//! Random cameras, and points up to 85° off their axes.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test binary compiles this file and uses a part of it"
)]
#![allow(
    clippy::disallowed_methods,
    reason = "tests may use angles; selection does not run here"
)]

use camera_field::double::Intrinsics;
use glam::{DVec2, DVec3, Vec3};
use proptest::prelude::*;

/// The largest angle off the axis in the tests.
pub const MAX_OFF_AXIS_DEG: f64 = 85.0;

/// A point given by its distance, its angle off the axis and its angle around the axis.
pub fn from_spherical(rho: f64, off_axis: f64, around: f64) -> DVec3 {
    let (sin_off, cos_off) = off_axis.sin_cos();
    let (sin_around, cos_around) = around.sin_cos();
    DVec3::new(sin_off * cos_around, sin_off * sin_around, cos_off) * rho
}

/// A camera whose image reaches beyond 85° on every side.
pub fn wide_camera(focal_px: DVec2) -> Intrinsics {
    Intrinsics {
        focal_px,
        slope_min: DVec2::splat(-12.0),
        slope_max: DVec2::splat(12.0),
    }
}

/// Wide cameras with oblong pixels.
pub fn wide_cameras() -> impl Strategy<Value = Intrinsics> {
    (10.0..4000.0_f64, 0.5..2.0_f64)
        .prop_map(|(fx, oblongness)| wide_camera(DVec2::new(fx, fx * oblongness)))
}

/// Cameras of any field of view up to 85° off axis, off-centre, with oblong pixels.
pub fn off_centre_cameras() -> impl Strategy<Value = Intrinsics> {
    let edge = 0.05..8.0_f64;
    let shift = -0.9..0.9_f64;
    (
        10.0..4000.0_f64,
        0.5..2.0_f64,
        (edge.clone(), edge),
        (shift.clone(), shift),
    )
        .prop_map(|(fx, oblongness, (half_x, half_y), (shift_x, shift_y))| {
            let half = DVec2::new(half_x, half_y);
            let middle = half * DVec2::new(shift_x, shift_y);
            Intrinsics {
                focal_px: DVec2::new(fx, fx * oblongness),
                slope_min: middle - half,
                slope_max: middle + half,
            }
        })
}

/// Points in front of a camera up to 85° off axis.
pub fn points() -> impl Strategy<Value = DVec3> {
    (
        0.1..100.0_f64,
        0.0..MAX_OFF_AXIS_DEG,
        0.0..core::f64::consts::TAU,
    )
        .prop_map(|(rho, off_axis_deg, around)| {
            from_spherical(rho, off_axis_deg.to_radians(), around)
        })
}

/// Unit vectors, uniform over the sphere.
pub fn unit_vectors() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0_f64, 0.0..core::f64::consts::TAU).prop_map(|(z, around)| {
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * around.cos(), across * around.sin(), z)
    })
}

/// `count` directions, spread evenly over the sphere on a golden-angle spiral.
pub fn spread_directions(count: u32) -> impl Iterator<Item = DVec3> {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    (0..count).map(move |index| {
        let z = 1.0 - 2.0 * (f64::from(index) + 0.5) / f64::from(count);
        let across = (1.0 - z * z).sqrt();
        let around = GOLDEN_ANGLE * f64::from(index);
        DVec3::new(across * around.cos(), across * around.sin(), z)
    })
}

/// Fails unless `actual` is within `tolerance` of `expected`, relative to `scale`.
#[track_caller]
pub fn assert_close(actual: f64, expected: f64, scale: f64, tolerance: f64) {
    let error = (actual - expected).abs();
    assert!(
        error <= tolerance * scale.abs(),
        "{actual} is not within {tolerance} of {expected} (scale {scale})"
    );
}

/// The `f32` camera with the same numbers.
pub fn single(camera: &Intrinsics) -> camera_field::Intrinsics {
    camera_field::Intrinsics {
        focal_px: camera.focal_px.as_vec2(),
        slope_min: camera.slope_min.as_vec2(),
        slope_max: camera.slope_max.as_vec2(),
    }
}

/// Vectors of any `f32`, including NaN and infinities.
pub fn any_vec3() -> impl Strategy<Value = Vec3> {
    let any = proptest::num::f32::ANY;
    (any, any, any).prop_map(Vec3::from)
}

/// Derivative of `quantity` along each axis, by central differences of step `step`.
pub fn central_differences<T>(p: DVec3, step: f64, quantity: impl Fn(DVec3) -> T) -> [T; 3]
where
    T: core::ops::Sub<Output = T> + core::ops::Div<f64, Output = T>,
{
    DVec3::AXES.map(|axis| (quantity(p + axis * step) - quantity(p - axis * step)) / (2.0 * step))
}

/// Counts the pixel centres whose sight rays meet a surface, within `radius_px` of `middle_px`. It is
/// the ground truth for every integral of the field.
pub fn count_samples(
    camera: &Intrinsics,
    middle_px: DVec2,
    radius_px: f64,
    hits: impl Fn(DVec3) -> bool,
) -> f64 {
    let least = (middle_px - radius_px).floor();
    let steps = (2.0 * radius_px) as u32 + 2;
    let pixels = (0..steps).flat_map(|row| (0..steps).map(move |column| (column, row)));
    let sampled = pixels.filter(|&(column, row)| {
        let pixel = least + DVec2::new(f64::from(column), f64::from(row)) + 0.5;
        hits((pixel / camera.focal_px).extend(1.0))
    });
    sampled.count() as f64
}

/// Whether a ray from the camera meets a triangle, from either side.
pub fn ray_meets_triangle(ray: DVec3, [p0, p1, p2]: [DVec3; 3]) -> bool {
    let sides = [(p0, p1), (p1, p2), (p2, p0)].map(|(a, b)| ray.dot(a.cross(b)));
    sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0)
}

/// Two unit vectors that complete `axis` to a right-handed frame.
pub fn frame(axis: DVec3) -> (DVec3, DVec3) {
    axis.normalize().any_orthonormal_pair()
}
