//! The ground: a height field with a level avenue through hills, and the colours of its texture.

use bevy::prelude::*;

use super::Shape;
use crate::noise::{fbm, gradient, ridges, smoothstep};

/// Side of the square of ground, centred on the origin.
pub(crate) const SIDE_IN_M: f32 = 480.0;

/// The avenue runs along Z between these points of the ground plane, and ends in the plaza.
pub(crate) const AVENUE: [Vec2; 2] = [Vec2::new(0.0, 86.0), Vec2::new(0.0, -20.0)];
/// Middle of the plaza.
pub(crate) const PLAZA: Vec2 = Vec2::new(0.0, -20.0);
/// Radius of the level plaza.
pub(crate) const PLAZA_RADIUS_IN_M: f32 = 27.0;
/// Middle of the temple's terrace.
pub(crate) const TEMPLE: Vec2 = Vec2::new(-46.0, 22.0);
/// Height of the temple's terrace.
pub(crate) const TEMPLE_HEIGHT_IN_M: f32 = 5.0;
/// Middle of the round temple's terrace in the far hills, the target of the telescope.
pub(crate) const TOMB: Vec2 = Vec2::new(150.0, -44.0);
/// Height of the round temple's terrace.
pub(crate) const TOMB_HEIGHT_IN_M: f32 = 24.0;

/// The ground as one open mesh with `squares` along each side. Squares in the middle are smaller. Texture coordinates
/// go from 0 to 1.
pub(crate) fn terrain(squares: u32) -> Shape {
    let vertices = (0..=squares).flat_map(|z| (0..=squares).map(move |x| (x, z)));
    let uvs: Vec<_> = vertices
        .map(|(x, z)| Vec2::new(x as f32, z as f32) / squares as f32)
        .collect();
    let positions = uvs.iter().map(|&uv| {
        let p = point_at(uv);
        Vec3::new(p.x, height(p), p.y)
    });
    let corner = |x: u32, z: u32| z * (squares + 1) + x;
    let lower_corners = (0..squares).flat_map(|z| (0..squares).map(move |x| (x, z)));
    let indices = lower_corners.flat_map(|(x, z)| {
        let [a, b] = [corner(x, z), corner(x + 1, z)];
        let [c, d] = [corner(x, z + 1), corner(x + 1, z + 1)];
        [a, c, b, b, c, d]
    });
    let mut shape = Shape::smooth(positions.collect(), indices.collect(), |_, _| Vec3::ONE);
    shape.uvs = uvs;
    shape.colors.clear();
    shape
}

/// Size of the squares and texels in the middle, across and along the avenue, relative to the mean. They are small,
/// because the camera is close to the ground there.
const MIDDLE_SHARE: Vec2 = Vec2::new(0.16, 0.36);

/// The point of the ground plane at a texture coordinate.
pub(crate) fn point_at(uv: Vec2) -> Vec2 {
    let s = uv * 2.0 - 1.0;
    s * (MIDDLE_SHARE + (1.0 - MIDDLE_SHARE) * s * s) * (SIDE_IN_M / 2.0)
}

/// Height of the ground above a point of the ground plane, in metres.
pub(crate) fn height(p: Vec2) -> f32 {
    let wild = 1.0 - levelled(p);
    let q = Vec3::new(p.x, 0.0, p.y);
    let bumps = 0.10 * fbm(q * 0.45, 3, 211) + 0.6 * wild * fbm(q * 0.09, 4, 223);
    broad_height(p) + f32::lerp(0.25, 1.0, wild) * bumps
}

/// Height of the ground without its bumps, in metres. The camera follows it.
pub(crate) fn broad_height(p: Vec2) -> f32 {
    let q = Vec3::new(p.x, 0.0, p.y);
    // Hills rise away from the avenue. A rim of higher hills surrounds the scene.
    let away = smoothstep(6.0, 75.0, distance_to_avenue(p));
    let hills = 9.0 + 9.0 * gradient(q * 0.021, 201) + 13.0 * (ridges(q * 0.012, 3, 205) - 0.45);
    let ground = away * hills.max(-1.0) + 0.5 * away * gradient(q * 0.05, 209);
    let rim = away
        * (8.0 * smoothstep(90.0, 150.0, p.length()) + 26.0 * smoothstep(140.0, 260.0, p.length()));
    // The temples stand on level terraces.
    let terrace = 1.0 - smoothstep(11.0, 26.0, p.distance(TEMPLE));
    let tomb = 1.0 - smoothstep(9.0, 40.0, p.distance(TOMB));
    let hills = f32::lerp(ground, TEMPLE_HEIGHT_IN_M, terrace) + rim;
    f32::lerp(hills, TOMB_HEIGHT_IN_M, tomb)
}

/// Levelling of the ground, from 0 (wild) to 1 (paved).
fn levelled(p: Vec2) -> f32 {
    let avenue = 1.0 - smoothstep(3.0, 12.0, distance_to_avenue(p));
    let terraces = p.distance(TEMPLE).min(p.distance(TOMB));
    avenue.max(1.0 - smoothstep(10.0, 18.0, terraces))
}

/// Density of trees around a point of the ground plane, from 0 to 1.
pub(crate) fn woodland(p: Vec2) -> f32 {
    let q = Vec3::new(p.x, 3.0, p.y);
    // Noise places the groves. They are denser in the hills and around the round temple, and absent near the avenue.
    let groves = fbm(q * 0.021, 3, 221) + 0.25 * gradient(q * 0.11, 227);
    let hills = smoothstep(60.0, 120.0, p.length());
    let clear = smoothstep(5.0, 32.0, distance_to_avenue(p));
    let grove = 0.95 * (1.0 - smoothstep(30.0, 130.0, p.distance(TOMB)));
    clear * smoothstep(-0.25, 0.30, groves + 0.42 * hills + grove - 0.22)
}

/// Distance from the edge of the avenue or the plaza; negative on both.
pub(crate) fn distance_to_avenue(p: Vec2) -> f32 {
    let [from, to] = AVENUE;
    let along = ((p - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
    let to_avenue = p.distance(from.lerp(to, along)) - 7.0;
    to_avenue.min(p.distance(PLAZA) - PLAZA_RADIUS_IN_M)
}

const GRASS: Vec3 = Vec3::new(0.115, 0.135, 0.035);
const DRY_GRASS: Vec3 = Vec3::new(0.27, 0.215, 0.085);
/// Leaf litter below trees.
const LITTER: Vec3 = Vec3::new(0.095, 0.085, 0.035);
const SOIL: Vec3 = Vec3::new(0.22, 0.145, 0.085);
const CLIFF: Vec3 = Vec3::new(0.20, 0.175, 0.145);
const PAVING: Vec3 = Vec3::new(0.36, 0.305, 0.225);
const JOINT: Vec3 = Vec3::new(0.13, 0.115, 0.06);

/// Linear RGB of the ground at a point of the ground plane with this slope.
pub(crate) fn color(p: Vec2, slope: f32) -> Vec3 {
    let q = Vec3::new(p.x, 0.0, p.y);
    // The meadow has green and dry grass, and litter below trees.
    let patches = fbm(q * 0.11, 4, 301);
    let tufts = gradient(q * 1.9, 311) + 0.6 * gradient(q * 5.1, 313);
    let open = GRASS.lerp(DRY_GRASS, smoothstep(-0.5, 0.7, patches + 0.35 * tufts));
    let shaded = 0.85 * smoothstep(0.1, 0.9, woodland(p) + 0.15 * tufts);
    let meadow = open.lerp(LITTER * (1.0 + 0.3 * tufts), shaded);
    // Slopes show soil, steep slopes show cliffs.
    let rough_slope = slope + 0.06 * tufts;
    let earth = meadow.lerp(SOIL, smoothstep(0.28, 0.45, rough_slope));
    let cliff = CLIFF * f32::lerp(0.8, 1.2, 0.5 + 0.5 * tufts);
    let wild = earth.lerp(cliff, smoothstep(0.5, 0.75, rough_slope));
    // The edge of the paving is overgrown.
    let ragged_distance = distance_to_paving(p) + 2.2 * patches + 0.5 * tufts;
    paving(p, tufts).lerp(wild, smoothstep(-1.5, 2.5, ragged_distance))
}

/// The slope (rise over run) of the ground without its bumps, on a grid of 1 m.
pub(crate) struct Slopes(Vec<f32>);

impl Slopes {
    pub(crate) fn new() -> Self {
        let side = SIDE_IN_M as u32 + 1;
        let corner = |i: u32| Vec2::new((i % side) as f32, (i / side) as f32) - SIDE_IN_M / 2.0;
        let heights: Vec<_> = (0..side * side).map(|i| broad_height(corner(i))).collect();
        let at = |x: u32, z: u32| heights[(z.min(side - 1) * side + x.min(side - 1)) as usize];
        let slope = |i: u32| {
            let (x, z) = (i % side, i / side);
            let (left, above) = (x.saturating_sub(1), z.saturating_sub(1));
            Vec2::new(at(x + 1, z) - at(left, z), at(x, z + 1) - at(x, above)).length() / 2.0
        };
        Self((0..side * side).map(slope).collect())
    }

    /// The slope at a point of the ground plane.
    pub(crate) fn at(&self, p: Vec2) -> f32 {
        let side = SIDE_IN_M as usize + 1;
        let q = (p + SIDE_IN_M / 2.0).clamp(Vec2::ZERO, Vec2::splat(SIDE_IN_M - 0.001));
        let t = q - q.floor();
        let corner = q.y as usize * side + q.x as usize;
        let above = f32::lerp(self.0[corner], self.0[corner + 1], t.x);
        let below = f32::lerp(self.0[corner + side], self.0[corner + side + 1], t.x);
        f32::lerp(above, below, t.y)
    }
}

/// Distance from the paved ground; negative on the paving.
pub(crate) fn distance_to_paving(p: Vec2) -> f32 {
    let [from, to] = AVENUE;
    let aside = (p.x - from.x).abs().max(p.y - from.y).max(to.y - p.y);
    let plaza = p.distance(PLAZA) - 21.0;
    let terrace = (p - TEMPLE).abs().max_element() - 8.5;
    let tomb = p.distance(TOMB) - 7.0;
    (aside - 3.6).min(plaza).min(terrace).min(tomb)
}

/// Linear RGB of slabs of 1.9 × 1.25 m. Every other row is shifted by half a slab.
fn paving(p: Vec2, tufts: f32) -> Vec3 {
    let row = (p.y / 1.25).floor();
    let shifted = Vec2::new(p.x / 1.9 + 0.5 * (row.rem_euclid(2.0)), p.y / 1.25);
    let cell = shifted.floor();
    let inside = shifted - cell;
    let to_edge = inside.min(1.0 - inside) * Vec2::new(1.9, 1.25);
    let worn = 0.03 * tufts;
    let joint = 1.0 - smoothstep(0.02, 0.11, to_edge.min_element() + worn);
    let tint = 1.0 + 0.3 * gradient(Vec3::new(cell.x, 0.37, cell.y) * 0.77, 331);
    (PAVING * tint * (1.0 + 0.08 * tufts)).lerp(JOINT, 0.8 * joint)
}
