//! Vectors and matrices of eight lanes, in glam's order of operations.

use glam::{Mat3, Vec3};
use wide::f32x8;

pub(super) const INFINITE: f32x8 = splat(f32::INFINITY);
pub(super) const ZERO: f32x8 = splat(0.0);
pub(super) const ONE: f32x8 = splat(1.0);

pub(super) const fn splat(value: f32) -> f32x8 {
    f32x8::new([value; 8])
}

#[derive(Clone, Copy)]
pub(super) struct V3 {
    pub(super) x: f32x8,
    pub(super) y: f32x8,
    pub(super) z: f32x8,
}

impl V3 {
    pub(super) fn dot(self, other: Self) -> f32x8 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    pub(super) fn splat(v: Vec3) -> Self {
        Self {
            x: splat(v.x),
            y: splat(v.y),
            z: splat(v.z),
        }
    }
}

#[derive(Clone, Copy)]
pub(super) struct M3(pub(super) [V3; 3]);

impl M3 {
    pub(super) fn splat(m: &Mat3) -> Self {
        Self([
            V3::splat(m.x_axis),
            V3::splat(m.y_axis),
            V3::splat(m.z_axis),
        ])
    }

    pub(super) fn of(self, v: V3) -> V3 {
        let [a, b, c] = self.0;
        V3 {
            x: a.x * v.x + b.x * v.y + c.x * v.z,
            y: a.y * v.x + b.y * v.y + c.y * v.z,
            z: a.z * v.x + b.z * v.y + c.z * v.z,
        }
    }
}
