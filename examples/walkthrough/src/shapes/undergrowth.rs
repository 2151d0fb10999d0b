//! Bushes and tufts of grass.

use std::f32::consts::TAU;

use bevy::prelude::*;

use super::Shape;
use super::leaves::Foliage;
use super::sdf::{ellipsoid, polygonise};
use crate::noise::{cells, fbm, random, smoothstep};

const BUSH: [Vec3; 2] = [Vec3::new(0.018, 0.024, 0.009), Vec3::new(0.145, 0.15, 0.06)];
const BLADE: [Vec3; 2] = [Vec3::new(0.10, 0.11, 0.032), Vec3::new(0.36, 0.31, 0.115)];

/// A round bush, about 1.3 m wide and 0.9 m tall.
pub(crate) fn bush() -> Shape {
    let tuft = |p: Vec3| 1.0 - cells(p / 0.21, 1201).powi(2);
    let distance = |p: Vec3| {
        let bare = ellipsoid(p, Vec3::new(0.0, 0.28, 0.0), Vec3::new(0.6, 0.5, 0.55));
        0.6 * (bare + 0.1 * fbm(p * 2.4, 2, 1203) - 0.13 * (tuft(p) - 0.35))
    };
    let (min, max) = (Vec3::new(-0.95, -0.5, -0.95), Vec3::new(0.95, 1.1, 0.95));
    let (positions, indices) = polygonise(min, max, 0.075, distance);
    let mut shape = Shape::smooth(positions, indices, |p, n| {
        let lit = smoothstep(0.0, 0.9, tuft(p)) * f32::lerp(0.5, 1.0, 0.5 + 0.5 * n.y);
        BUSH[0].lerp(BUSH[1], lit * smoothstep(-0.3, 0.5, p.y))
    });
    let mut foliage = Foliage::new(0.13, 0.06, 0.3);
    foliage.seed = 1207;
    foliage.sprout(&mut shape, 700, |p| p.y > 0.0);
    shape
}

const BLADES: u32 = 56;
/// Number of rings of three corners along a blade, without its tip.
const RINGS: u32 = 4;

/// A tuft of grass, about 0.5 m tall: bent blades with three sides each.
pub(crate) fn tuft() -> Shape {
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for blade in 0..BLADES {
        let first = positions.len() as u32;
        positions.extend(blade_corners(blade));
        indices.extend(blade_triangles().map(|corner| first + corner));
    }
    Shape::smooth(positions, indices, |p, _| {
        let dry = fbm(p * 3.0, 2, 1231);
        BLADE[0].lerp(BLADE[1], smoothstep(0.0, 0.5, p.y + 0.12 * dry))
    })
}

/// The corners of a blade: its rings from the foot up, then its tip.
fn blade_corners(blade: u32) -> impl Iterator<Item = Vec3> {
    let draw = move |k: u32| random(blade * 6 + k, 1211);
    // The foot of the blade, the side to which it bends, its length and its lean.
    let turn = |angle: f32| Vec3::new(angle.cos(), 0.0, angle.sin());
    let out = turn(TAU * draw(0));
    let side = Vec3::Y.cross(out);
    let foot = turn(TAU * draw(1)) * 0.13 * draw(2).sqrt() - Vec3::Y * 0.06;
    let (length, lean) = (
        f32::lerp(0.28, 0.62, draw(3)),
        f32::lerp(0.1, 0.75, draw(4)),
    );
    let along =
        move |t: f32| foot + length * (out * lean * t * t + Vec3::Y * t * (1.0 - 0.3 * lean * t));
    // Rings of three corners around the middle line get smaller towards the tip.
    let ring = move |ring: u32| {
        let t = ring as f32 / RINGS as f32;
        let half = 0.014 * (1.0 - 0.7 * t);
        let middle = along(t);
        [
            middle - side * half,
            middle + side * half,
            middle + out * 0.5 * half,
        ]
    };
    (0..RINGS).flat_map(ring).chain([along(1.0)])
}

/// The corners of a blade's triangles: its walls, its tip, and the triangle that closes its foot.
fn blade_triangles() -> impl Iterator<Item = u32> {
    let wall = (0..RINGS - 1).flat_map(|ring| {
        (0..3).flat_map(move |corner| {
            let next = (corner + 1) % 3;
            let [a, b] = [3 * ring + corner, 3 * ring + next];
            [a, a + 3, b, b, a + 3, b + 3]
        })
    });
    let top = 3 * (RINGS - 1);
    let tip = (0..3).flat_map(move |corner| [top + corner, top + 3, top + (corner + 1) % 3]);
    wall.chain(tip).chain([0, 1, 2])
}
