//! Boulders: spheres cut by planes and worn by noise.

use std::collections::HashMap;

use glam::Vec3;

use super::Shape;
use crate::noise::{fbm, gradient, random, ridges, smoothstep};

/// Halvings of the icosahedron's edges for a boulder: 20 · 4⁶ = 81 920 triangles.
const BOULDER_SUBDIVISIONS: u32 = 6;
/// For a stone: 20 · 4³ = 1280 triangles.
const STONE_SUBDIVISIONS: u32 = 3;

const GRANITE: Vec3 = Vec3::new(0.23, 0.21, 0.18);
const GRANITE_DARK: Vec3 = Vec3::new(0.10, 0.09, 0.08);
const LICHEN: Vec3 = Vec3::new(0.16, 0.19, 0.06);

/// A boulder of about 1 m radius around the origin; each `variant` another one.
pub(crate) fn rock(variant: u32) -> Shape {
    worn_sphere(variant, BOULDER_SUBDIVISIONS)
}

/// A small stone, modelled at the size of a boulder.
pub(crate) fn stone() -> Shape {
    worn_sphere(3, STONE_SUBDIVISIONS)
}

fn worn_sphere(variant: u32, subdivisions: u32) -> Shape {
    let (mut positions, indices) = icosphere(subdivisions);
    let seed = 100 + 50 * variant;
    let cuts = cutting_planes(seed);
    let squash = Vec3::new(1.1, 0.72 + 0.12 * variant as f32, 0.9);
    for position in &mut positions {
        *position *= radius(*position, &cuts, seed) * squash;
    }
    Shape::smooth(positions, indices, |p, n| color(p, n, seed))
}

/// Planes as (unit normal, distance).
fn cutting_planes(seed: u32) -> Vec<(Vec3, f32)> {
    let plane = |i: u32| {
        let part = |k: u32| random(i * 4 + k, seed) * 2.0 - 1.0;
        let normal = Vec3::new(part(0), part(1), part(2)).normalize_or(Vec3::Y);
        (normal, 0.72 + 0.2 * part(3).abs())
    };
    (0..11).map(plane).collect()
}

fn radius(direction: Vec3, cuts: &[(Vec3, f32)], seed: u32) -> f32 {
    let warp = Vec3::splat(0.06) * fbm(direction * 3.0, 3, seed + 20);
    let to_plane = |(normal, distance): &(Vec3, f32)| {
        let along = normal.dot(direction + warp);
        if along > 0.05 { distance / along } else { 2.0 }
    };
    let cut = cuts.iter().map(to_plane).fold(1.15, f32::min);
    let worn = 0.10 * fbm(direction * 2.2, 3, seed) + 0.07 * ridges(direction * 4.5, 4, seed + 7);
    let grain = 0.006 * fbm(direction * 34.0, 2, seed + 13);
    cut + worn + grain - 0.04
}

fn color(position: Vec3, normal: Vec3, seed: u32) -> Vec3 {
    let blotch = smoothstep(-0.5, 0.6, fbm(position * 2.5, 4, seed + 31));
    let stone = GRANITE_DARK.lerp(GRANITE, 0.35 + 0.65 * blotch);
    let growth = smoothstep(
        0.25,
        0.8,
        normal.y + 0.5 * gradient(position * 4.0, seed + 40),
    );
    stone.lerp(LICHEN, 0.7 * growth)
}

/// A unit sphere with welded vertices.
pub(super) fn icosphere(subdivisions: u32) -> (Vec<Vec3>, Vec<u32>) {
    let (mut positions, mut triangles) = icosahedron();
    for _ in 0..subdivisions {
        let mut middles = HashMap::with_capacity(triangles.len() * 3 / 2);
        let mut finer = Vec::with_capacity(triangles.len() * 4);
        for [a, b, c] in triangles {
            let mut middle = |from: u32, to: u32| {
                *middles
                    .entry((from.min(to), from.max(to)))
                    .or_insert_with(|| {
                        let sum = positions[from as usize] + positions[to as usize];
                        positions.push(sum.normalize());
                        positions.len() as u32 - 1
                    })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (positions, triangles.into_flattened())
}

fn icosahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5.0_f32.sqrt()) / 2.0;
    let mut positions = Vec::with_capacity(12);
    for (long, short) in [
        (golden, 1.0),
        (golden, -1.0),
        (-golden, 1.0),
        (-golden, -1.0),
    ] {
        positions.push(Vec3::new(0.0, short, long).normalize());
        positions.push(Vec3::new(short, long, 0.0).normalize());
        positions.push(Vec3::new(long, 0.0, short).normalize());
    }
    // The faces are the triples of vertices that are all neighbours.
    let edge = 2.0 / (1.0 + golden * golden).sqrt() * 1.01;
    let near = |a: u32, b: u32| positions[a as usize].distance(positions[b as usize]) < edge;
    let mut triangles = Vec::with_capacity(20);
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let [pa, pb, pc] = [a, b, c].map(|i| positions[i as usize]);
                    let outward = (pb - pa).cross(pc - pa).dot(pa) > 0.0;
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    (positions, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_icosphere_has_its_triangles_and_euler_characteristic() {
        let (positions, indices) = icosphere(3);
        let triangles = indices.len() / 3;
        assert_eq!(triangles, 20 * 64);
        assert_eq!(positions.len() + triangles, triangles * 3 / 2 + 2);
    }
}
