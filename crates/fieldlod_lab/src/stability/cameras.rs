//! Cameras of the cases.

use glam::{Affine3A, Vec2, Vec3};

use super::case::Shot;
use crate::eye::{Eye, Instance};
use crate::object::LodObject;

/// The window of most cases, in pixels.
pub(super) const HD: Vec2 = Vec2::new(1920.0, 1080.0);

/// A small window, in pixels, in which the cut of a near fixture has several levels. In a large window, the cut would
/// be the source.
pub(super) const SMALL: Vec2 = Vec2::new(640.0, 360.0);

/// A perspective camera with a near plane that suits the object.
pub(super) fn eye(fovy_deg: f32, window_px: Vec2, object: &LodObject) -> Eye {
    Eye::perspective(fovy_deg, window_px, object.radius * 1e-3)
}

/// Distances just beyond the starts of levels, where a level of the whole object has an error of 1 px on the axis. A
/// criterion that underestimates the error fails there first.
pub(super) fn distances(object: &LodObject, eye: &Eye) -> Vec<f32> {
    // A start inside of the object cannot be used.
    let errors = object.level_errors_in_local.iter().skip(1);
    let starts = errors.map(|error| (error * eye.focal_px() + object.radius) * 1.02);
    let outside = starts.filter(|start| *start > object.radius * 1.2);
    let found: Vec<f32> = outside.take(4).collect();
    assert!(!found.is_empty(), "no level starts outside of the object");
    found
}

/// A shot from each of the [`distances`].
pub(super) fn at_distances(object: &LodObject, eye: &Eye, shot: impl Fn(f32) -> Shot) -> Vec<Shot> {
    distances(object, eye).into_iter().map(shot).collect()
}

/// An eye at `distance` from the center of the object and slightly above, which looks at the center.
pub(super) fn from_front(eye: Eye, object: &LodObject, distance: f32) -> Eye {
    around(eye, object, distance, 0.0)
}

/// The same eye, rotated by `angle_deg` around the object.
pub(super) fn around(eye: Eye, object: &LodObject, distance: f32, angle_deg: f32) -> Eye {
    let (sin, cos) = (angle_deg.to_radians() + 0.4).sin_cos();
    let direction = Vec3::new(sin, 0.35, cos).normalize();
    eye.looking_at(object.center + direction * distance, object.center)
}

/// A point above the ground at `x` and `z`, both from 0 to 1 across the object's box. `height` is in radii of the object.
pub(super) fn ground(object: &LodObject, x: f32, z: f32, height: f32) -> Vec3 {
    object.vertex_below(x, z) + Vec3::Y * (height * object.radius)
}

/// An instance scaled around the center of the object.
pub(super) fn scaled(object: &LodObject, scale: Vec3) -> Instance {
    let center = Affine3A::from_translation(object.center);
    Instance::at(center * Affine3A::from_scale(scale) * center.inverse())
}
