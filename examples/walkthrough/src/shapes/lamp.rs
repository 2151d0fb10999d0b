//! Lamps: a fire bowl on a tall bronze stand, and its flame.

use bevy::prelude::*;

use super::Shape;
use super::rock::icosphere;
use super::sdf::{drum, limb, polygonise, smooth_union};
use crate::noise::{fbm, smoothstep};

const BRONZE: Vec3 = Vec3::new(0.19, 0.12, 0.06);
const PATINA: Vec3 = Vec3::new(0.08, 0.15, 0.12);

/// Height of the middle of the flame above the foot of the lamp.
pub(crate) const FLAME_HEIGHT_IN_M: f32 = 2.42;

/// A lamp, 2.3 m tall.
pub(crate) fn lamp() -> Shape {
    let (min, max) = (Vec3::new(-0.6, -0.3, -0.6), Vec3::new(0.6, 2.45, 0.6));
    let (positions, indices) = polygonise(min, max, 0.017, distance);
    Shape::smooth(positions, indices, |p, n| {
        let rain = fbm(p * Vec3::new(7.0, 2.0, 7.0), 3, 1301) + 0.4 * n.y;
        BRONZE.lerp(PATINA, 0.85 * smoothstep(-0.1, 0.6, rain))
    })
}

fn distance(p: Vec3) -> f32 {
    let base = drum(p, 0.40, -0.25, 0.10, 0.03);
    let step = drum(p, 0.26, 0.05, 0.22, 0.03);
    let flutes = 0.012 * (p.z.atan2(p.x) * 12.0).cos();
    let shaft = limb(p, Vec3::Y * 0.2, Vec3::Y * 1.9, 0.105, 0.07) + flutes;
    let ring = drum(p, 0.14, 1.22, 1.32, 0.04);
    let stand = smooth_union(base.min(step), shaft.min(ring), 0.05);
    smooth_union(stand, bowl(p), 0.08)
}

/// Distance from the bowl: the lower half of a spherical shell.
fn bowl(p: Vec3) -> f32 {
    let from_middle = (p - Vec3::Y * 2.28).length();
    let shell = (from_middle - 0.36).abs() - 0.032;
    shell.max(p.y - 2.26)
}

/// A flame, about 0.5 m tall. The origin is in its middle.
pub(crate) fn flame() -> Shape {
    let (mut positions, indices) = icosphere(16);
    for p in &mut positions {
        let thin = 1.0 - 0.55 * smoothstep(-0.2, 1.0, p.y);
        let tongue = 1.0 + 0.35 * fbm(*p * Vec3::new(2.2, 1.2, 2.2), 2, 1311) * (0.5 + 0.5 * p.y);
        *p *= tongue * Vec3::new(0.21 * thin, 0.26 + 0.08 * p.y, 0.21 * thin);
    }
    Shape::smooth(positions, indices, |_, _| Vec3::ONE)
}
