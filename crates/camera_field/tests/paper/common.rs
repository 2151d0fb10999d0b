//! Random cameras and points, counted samples and comparisons.

pub(crate) use std::f64::consts::{PI, TAU};

pub(crate) use camera_field::double::*;
pub(crate) use glam::{DMat2, DMat4, DVec2, DVec3, dvec2, dvec3};
pub(crate) use proptest::prelude::*;

/// A point given by its distance, its angle off the axis and its angle around the axis.
pub(crate) fn from_spherical(rho: f64, off_axis: f64, around: f64) -> DVec3 {
    let (sin_off, cos_off) = off_axis.sin_cos();
    (DVec2::from_angle(around) * sin_off).extend(cos_off) * rho
}

/// A camera whose image reaches beyond 85° on every side.
pub(crate) fn wide_camera(focal_px: DVec2) -> Intrinsics {
    Intrinsics {
        focal_px,
        slope_min: DVec2::splat(-12.0),
        slope_max: DVec2::splat(12.0),
    }
}

/// A wide camera with square pixels.
pub(crate) fn square_camera(focal_px: f64) -> Intrinsics {
    wide_camera(DVec2::splat(focal_px))
}

/// Focal lengths of oblong pixels.
fn focal_lengths() -> impl Strategy<Value = DVec2> {
    (10.0..4000.0_f64, 0.5..2.0_f64).prop_map(|(fx, oblongness)| dvec2(fx, fx * oblongness))
}

/// Wide cameras with oblong pixels.
pub(crate) fn wide_cameras() -> impl Strategy<Value = Intrinsics> {
    focal_lengths().prop_map(wide_camera)
}

/// Cameras of any field of view up to 85° off axis, off-centre, with oblong pixels.
pub(crate) fn off_centre_cameras() -> impl Strategy<Value = Intrinsics> {
    let edges = (0.05..8.0_f64, 0.05..8.0_f64).prop_map(DVec2::from);
    let shifts = (-0.9..0.9_f64, -0.9..0.9_f64).prop_map(DVec2::from);
    (focal_lengths(), edges, shifts).prop_map(|(focal_px, half, shift)| Intrinsics {
        focal_px,
        slope_min: half * (shift - 1.0),
        slope_max: half * (shift + 1.0),
    })
}

/// Points in front of a camera up to 85° off axis.
pub(crate) fn points() -> impl Strategy<Value = DVec3> {
    (0.1..100.0_f64, 0.0..85.0_f64, 0.0..TAU).prop_map(|(rho, off_axis_deg, around)| {
        from_spherical(rho, off_axis_deg.to_radians(), around)
    })
}

/// Unit vectors, uniform over the sphere.
pub(crate) fn unit_vectors() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0_f64, 0.0..TAU).prop_map(|(z, around)| from_spherical(1.0, z.acos(), around))
}

/// A point and a unit normal that faces the camera. The angle between the surface and the sight ray has a sine above
/// `min_facing`.
pub(crate) fn facing(min_facing: f64) -> impl Strategy<Value = (DVec3, DVec3)> {
    (points(), unit_vectors())
        .prop_map(|(p, n)| (p, if n.dot(p) > 0.0 { -n } else { n }))
        .prop_filter("edge-on", move |(p, n)| -n.dot(p.normalize()) > min_facing)
}

/// Fails unless `actual` is within `tolerance` of `expected`, relative to `scale`.
#[track_caller]
pub(crate) fn assert_close(actual: f64, expected: f64, scale: f64, tolerance: f64) {
    let error = (actual - expected).abs();
    assert!(
        error <= tolerance * scale.abs(),
        "{actual} is not within {tolerance} of {expected} (scale {scale})"
    );
}

/// Fails unless two vectors differ by at most `tolerance`, relative to `scale`.
#[track_caller]
pub(crate) fn assert_near(actual: DVec3, expected: DVec3, scale: f64, tolerance: f64) {
    assert_close((actual - expected).length(), 0.0, scale, tolerance);
}

/// The `f32` camera with the same numbers.
pub(crate) fn single(camera: &Intrinsics) -> camera_field::Intrinsics {
    camera_field::Intrinsics {
        focal_px: camera.focal_px.as_vec2(),
        slope_min: camera.slope_min.as_vec2(),
        slope_max: camera.slope_max.as_vec2(),
    }
}

/// Counts the pixel centres whose sight rays meet a surface, within `radius_px` of `middle_px`. It is
/// the ground truth for every integral of the field.
pub(crate) fn count_samples(
    camera: &Intrinsics,
    middle_px: DVec2,
    radius_px: f64,
    hits: impl Fn(DVec3) -> bool,
) -> f64 {
    let least = (middle_px - radius_px).floor();
    let steps = (2.0 * radius_px) as u32 + 2;
    let pixels = (0..steps).flat_map(|row| (0..steps).map(move |column| (column, row)));
    let sampled = pixels.filter(|&(column, row)| {
        let pixel = least + dvec2(column.into(), row.into()) + 0.5;
        hits((pixel / camera.focal_px).extend(1.0))
    });
    sampled.count() as f64
}

/// Two unit vectors that complete `axis` to a right-handed frame.
pub(crate) fn frame(axis: DVec3) -> (DVec3, DVec3) {
    axis.normalize().any_orthonormal_pair()
}

/// A camera at `origin` that looks at `target`, with y upwards.
pub(crate) fn posed(intrinsics: Intrinsics, origin: DVec3, target: DVec3) -> PosedCamera {
    let pose = Pose::looking_at(origin, target, DVec3::NEG_Y);
    PosedCamera { intrinsics, pose }
}
