//! An object of the scene: a shape and its transform.

use std::f32::consts::TAU;

use bevy::prelude::*;

use crate::shapes::ShapeId;
use crate::shapes::terrain;

/// One instance of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) shape: ShapeId,
    /// The transform to the world, with the same scale along all axes.
    pub(crate) transform: Transform,
}

impl Placed {
    /// An upright shape with its foot at a point of the ground plane and at a height, turned around +Y.
    pub(crate) fn at_height(
        shape: ShapeId,
        at: Vec2,
        height_in_m: f32,
        yaw_in_rad: f32,
        scale: f32,
    ) -> Self {
        let transform = Transform::from_xyz(at.x, height_in_m, at.y)
            .with_rotation(Quat::from_rotation_y(yaw_in_rad))
            .with_scale(Vec3::splat(scale));
        Self { shape, transform }
    }

    /// An upright shape on the ground.
    pub(crate) fn on_ground(shape: ShapeId, at: Vec2, yaw_in_rad: f32, scale: f32) -> Self {
        Self::at_height(shape, at, terrain::height(at), yaw_in_rad, scale)
    }

    /// Replaces the rotation around the foot.
    pub(crate) fn turned(mut self, rotation: Quat) -> Self {
        self.transform.rotation = rotation;
        self
    }

    /// Lifts the shape.
    pub(crate) fn raised(mut self, by_in_m: f32) -> Self {
        self.transform.translation.y += by_in_m;
        self
    }

    /// The point of the ground plane below the foot.
    pub(crate) fn at(&self) -> Vec2 {
        self.transform.translation.xz()
    }

    pub(crate) fn scale(&self) -> f32 {
        self.transform.scale.y
    }
}

/// Numbered points on a circle of the ground plane. `phase` shifts them, in steps between two points.
pub(crate) fn ring(
    center: Vec2,
    radius_in_m: f32,
    count: u32,
    phase: f32,
) -> impl Iterator<Item = (u32, Vec2)> {
    (0..count).map(move |i| {
        let angle = TAU * (i as f32 + phase) / count as f32;
        (i, center + Vec2::from_angle(angle) * radius_in_m)
    })
}
