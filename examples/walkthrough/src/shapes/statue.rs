//! Statues and the gate: weathered meshes of signed distance functions.

use bevy::prelude::*;

use super::mesh::{Shape, smooth_normals};
use super::sdf::{drum, ellipsoid, limb, polygonise, rounded_box, smooth_union};
use crate::noise::{fbm, gradient, smoothstep};

const SANDSTONE: Vec3 = Vec3::new(0.50, 0.36, 0.22);
const SANDSTONE_DARK: Vec3 = Vec3::new(0.22, 0.15, 0.10);
const BASALT: Vec3 = Vec3::new(0.13, 0.14, 0.15);
const VERDIGRIS: Vec3 = Vec3::new(0.12, 0.27, 0.22);

/// A king on his throne, hands on the knees, facing +Z.
pub(crate) fn seated_figure() -> Shape {
    let (min, max) = (Vec3::new(-1.0, -0.32, -1.15), Vec3::new(1.0, 3.15, 1.2));
    let stone = polygonise(min, max, 0.0165, king_and_throne);
    weathered(stone, 0.018, 3.0, |_| (SANDSTONE, SANDSTONE_DARK))
}

/// Distance from the king on his throne.
fn king_and_throne(p: Vec3) -> f32 {
    // The figure is symmetric, so both sides use the right half.
    let q = Vec3::new(p.x.abs(), p.y, p.z);
    smooth_union(throne(q), king(q), 0.06)
}

/// Distance from the right half of the throne.
fn throne(q: Vec3) -> f32 {
    let at = Vec3::new;
    let plinth = rounded_box(q, at(0.0, 0.08, 0.0), at(0.9, 0.37, 1.05), 0.04);
    let seat = rounded_box(q, at(0.0, 0.8, -0.3), at(0.56, 0.44, 0.52), 0.05);
    let back = rounded_box(q, at(0.0, 1.3, -0.72), at(0.56, 0.75, 0.14), 0.05);
    let arm_rest = rounded_box(q, at(0.6, 1.08, -0.2), at(0.09, 0.3, 0.6), 0.05);
    plinth.min(smooth_union(seat.min(back), arm_rest, 0.04))
}

/// Distance from the right half of the king.
fn king(q: Vec3) -> f32 {
    let at = Vec3::new;
    let torso = limb(q, at(0.0, 1.3, -0.3), at(0.0, 1.92, -0.36), 0.27, 0.30);
    let shoulders = limb(q, at(0.0, 2.12, -0.36), at(0.38, 2.08, -0.36), 0.16, 0.13);
    let upper_arm = limb(q, at(0.44, 2.05, -0.36), at(0.50, 1.55, -0.2), 0.115, 0.10);
    let forearm = limb(q, at(0.50, 1.54, -0.2), at(0.26, 1.47, 0.36), 0.10, 0.07);
    let hand = ellipsoid(q, at(0.25, 1.46, 0.47), at(0.085, 0.05, 0.15));
    let thigh = limb(q, at(0.2, 1.25, -0.25), at(0.24, 1.28, 0.5), 0.21, 0.155);
    let shin = limb(q, at(0.24, 1.24, 0.52), at(0.23, 0.58, 0.5), 0.15, 0.095);
    let foot = limb(q, at(0.23, 0.51, 0.5), at(0.26, 0.49, 0.8), 0.09, 0.07);
    let skirt = rounded_box(q, at(0.0, 1.0, 0.42), at(0.16, 0.36, 0.14), 0.05);

    // The blend of a joint is about as wide as the thinner of its limbs.
    let legs = smooth_union(smooth_union(thigh, shin, 0.08), foot, 0.05);
    let arms = smooth_union(smooth_union(upper_arm, forearm, 0.06), hand, 0.05);
    let trunk = smooth_union(smooth_union(torso, shoulders, 0.16), legs, 0.10);
    let body = smooth_union(trunk, skirt, 0.08);
    smooth_union(smooth_union(body, arms, 0.05), head(q), 0.06)
}

/// Distance from the right half of the head, with beard and headdress.
fn head(q: Vec3) -> f32 {
    let at = Vec3::new;
    let neck = limb(q, at(0.0, 2.15, -0.34), at(0.0, 2.42, -0.3), 0.12, 0.10);
    let skull = ellipsoid(q, at(0.0, 2.58, -0.27), at(0.165, 0.235, 0.195));
    let brow = ellipsoid(q, at(0.07, 2.64, -0.10), at(0.08, 0.028, 0.04));
    let (root, tip) = (at(0.0, 2.62, -0.085), at(0.0, 2.54, -0.045));
    let nose = limb(q, root, tip, 0.018, 0.032);
    let mouth = ellipsoid(q, at(0.0, 2.465, -0.095), at(0.06, 0.018, 0.035));
    let beard = limb(q, at(0.0, 2.38, -0.12), at(0.0, 2.16, -0.1), 0.06, 0.045);
    let ear = ellipsoid(q, at(0.175, 2.57, -0.24), at(0.03, 0.065, 0.045));
    let cloth = limb(q, at(0.0, 2.66, -0.33), at(0.0, 2.62, -0.33), 0.215, 0.22);
    let lappet = limb(q, at(0.19, 2.58, -0.3), at(0.22, 2.05, -0.14), 0.09, 0.07);
    let crown = limb(q, at(0.0, 2.75, -0.33), at(0.0, 2.98, -0.36), 0.16, 0.09);
    let pleats = 0.006 * (q.y * 90.0).sin();

    // The blends are narrow where one part lies on another.
    let face = smooth_union(smooth_union(skull, brow, 0.04), nose.min(mouth), 0.03);
    let headdress = smooth_union(smooth_union(cloth, lappet, 0.09) + pleats, crown, 0.05);
    let head = smooth_union(face.min(ear), headdress, 0.02);
    smooth_union(smooth_union(head, beard, 0.02), neck, 0.08)
}

/// A torus knot with a twisted rope surface on a round pedestal.
pub(crate) fn knot() -> Shape {
    let (min, max) = (Vec3::new(-1.45, -0.32, -1.45), Vec3::new(1.45, 3.7, 1.45));
    let stone = polygonise(min, max, 0.021, knot_on_pedestal);
    weathered(stone, 0.008, 4.0, |p| {
        if p.y > 1.02 {
            (VERDIGRIS, BASALT)
        } else {
            (SANDSTONE, SANDSTONE_DARK)
        }
    })
}

fn knot_on_pedestal(p: Vec3) -> f32 {
    let foot = drum(p, 1.05, -0.3, 0.25, 0.03);
    let shaft = drum(p, 0.8, 0.2, 0.9, 0.02);
    let slab = drum(p, 0.98, 0.85, 1.05, 0.03);
    let pedestal = smooth_union(smooth_union(foot, shaft, 0.12), slab, 0.12);
    // The knot stands upright: its axis points along Z.
    let upright = p - Vec3::Y * 2.25;
    smooth_union(pedestal, rope(upright.xzy()), 0.08)
}

/// Distance from the knot. Its strand winds three times around a ring while it goes twice around the Y axis.
fn rope(p: Vec3) -> f32 {
    const RING_RADIUS: f32 = 0.80;
    const WINDING_RADIUS: f32 = 0.33;
    let around = p.z.atan2(p.x);
    let section = Vec2::new(p.xz().length() - RING_RADIUS, p.y);
    let strand = |turn: f32| {
        let angle = 1.5 * around + turn;
        let offset = section - Vec2::from_angle(angle) * WINDING_RADIUS;
        let groove = 0.022 * (offset.to_angle() * 5.0 + around * 18.0).sin();
        offset.length() - 0.165 + groove
    };
    // The strands cross the section at a slant, so distances in it are too long. The factor compensates for that.
    0.7 * strand(0.0).min(strand(std::f32::consts::PI))
}

/// Two piers and an arch between them, with a passage along Z.
pub(crate) fn gate() -> Shape {
    let (min, max) = (Vec3::new(-4.3, -0.55, -1.35), Vec3::new(4.3, 7.7, 1.35));
    let stone = polygonise(min, max, 0.046, arch);
    weathered(stone, 0.05, 1.3, |_| (SANDSTONE, SANDSTONE_DARK))
}

/// Distance from the gate.
fn arch(p: Vec3) -> f32 {
    const SPRING_HEIGHT: f32 = 3.3;
    const OPENING_RADIUS: f32 = 2.15;
    let at = Vec3::new;
    let wall = rounded_box(p, at(0.0, 3.2, 0.0), at(3.6, 3.7, 0.85), 0.08);
    let cornice = rounded_box(p, at(0.0, 6.2, 0.0), at(3.95, 0.22, 1.15), 0.06);
    let attic = rounded_box(p, at(0.0, 6.9, 0.0), at(3.3, 0.55, 0.8), 0.06);

    // The parts that are symmetric in X and Z.
    let q = Vec3::new(p.x.abs(), p.y, p.z.abs());
    let base = rounded_box(q, at(2.9, 0.1, 0.0), at(0.95, 0.55, 1.12), 0.05);
    let impost = rounded_box(q, at(2.9, SPRING_HEIGHT, 0.0), at(0.86, 0.16, 1.0), 0.05);
    let half_column = limb(q, at(2.95, 0.5, 0.9), at(2.95, 6.0, 0.9), 0.30, 0.26);

    // The opening, and a rim around it above the imposts.
    let from_axis = Vec2::new(p.x, (p.y - SPRING_HEIGHT).max(0.0)).length();
    let opening = from_axis - OPENING_RADIUS;
    let rim = if p.y > SPRING_HEIGHT {
        ((from_axis - 2.4).abs() - 0.2).max(q.z - 0.97)
    } else {
        f32::MAX
    };

    let trimmed = wall.min(cornice).min(attic).min(rim).max(-opening);
    smooth_union(trimmed.min(base), impost.min(half_column), 0.05).max(-opening)
}

/// Moves the vertices of a surface along their normals by noise, and colours them. `colors_at` returns the colours of
/// the stone and of its stains at a point.
fn weathered(
    (mut positions, indices): (Vec<Vec3>, Vec<u32>),
    depth_in_m: f32,
    per_m: f32,
    colors_at: impl Fn(Vec3) -> (Vec3, Vec3),
) -> Shape {
    let normals = smooth_normals(&positions, &indices);
    for (p, normal) in positions.iter_mut().zip(normals) {
        let pits = 1.5 * (fbm(*p * per_m, 4, 61) - 0.25).max(0.0);
        let grain = 0.25 * gradient(*p * per_m * 9.0, 67);
        *p -= normal * depth_in_m * (pits + grain);
    }
    Shape::smooth(positions, indices, |p, normal| {
        let (stone, stain) = colors_at(p);
        weathered_color(p, normal, stone, stain)
    })
}

/// Linear RGB of stone and its stains at a point of the surface.
fn weathered_color(p: Vec3, normal: Vec3, stone: Vec3, stain: Vec3) -> Vec3 {
    // Rain stains the stone in streaks. Undersides and the foot are stained too, and upper sides are bleached.
    let streaks = fbm(p * Vec3::new(4.0, 1.0, 4.0), 4, 71);
    let under = 0.35 * (-normal.y).max(0.0);
    let foot = 0.5 * (1.0 - smoothstep(0.0, 0.7, p.y));
    let share = 0.7 * smoothstep(0.0, 0.8, streaks) + under + foot;
    let bleached = f32::lerp(0.9, 1.15, smoothstep(-0.2, 0.9, normal.y));
    (stone * bleached).lerp(stain, share.min(1.0))
}
