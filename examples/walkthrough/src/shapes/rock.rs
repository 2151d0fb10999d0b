//! Boulders: spheres that are cut by planes and worn by noise.

use bevy::mesh::{Indices, VertexAttributeValues};
use bevy::prelude::*;

use super::Shape;
use crate::noise::{fbm, gradient, random, ridges, smoothstep};

/// Parts of each edge of the icosahedron for a boulder, which gives 20 · 64² = 81 920 triangles.
const BOULDER_EDGE_PARTS: u32 = 64;
/// Parts of each edge of the icosahedron for a stone, which gives 20 · 8² = 1280 triangles.
const STONE_EDGE_PARTS: u32 = 8;

const GRANITE: Vec3 = Vec3::new(0.23, 0.21, 0.18);
const GRANITE_DARK: Vec3 = Vec3::new(0.10, 0.09, 0.08);
const LICHEN: Vec3 = Vec3::new(0.16, 0.19, 0.06);

/// A boulder of about 1 m radius around the origin; each `variant` differs.
pub(crate) fn rock(variant: u32) -> Shape {
    worn(icosphere(BOULDER_EDGE_PARTS), variant)
}

/// A small stone, modelled at the size of a boulder.
pub(crate) fn stone() -> Shape {
    worn(icosphere(STONE_EDGE_PARTS), 3)
}

fn worn((mut positions, indices): (Vec<Vec3>, Vec<u32>), variant: u32) -> Shape {
    let seed = 100 + 50 * variant;
    let cuts = cutting_planes(seed);
    let squash = Vec3::new(1.1, 0.72 + 0.12 * (variant % 4) as f32, 0.9);
    for position in &mut positions {
        *position *= radius(*position, &cuts, seed) * squash;
    }
    Shape::smooth(positions, indices, |p, n| color(p, n, seed))
}

/// Planes around the origin, as (unit normal, distance).
fn cutting_planes(seed: u32) -> Vec<(Vec3, f32)> {
    let plane = |i: u32| {
        let part = |k: u32| random(i * 4 + k, seed) * 2.0 - 1.0;
        let normal = Vec3::new(part(0), part(1), part(2)).normalize_or(Vec3::Y);
        (normal, 0.72 + 0.2 * part(3).abs())
    };
    (0..11).map(plane).collect()
}

/// Distance of the surface from the origin in a direction.
fn radius(direction: Vec3, cuts: &[(Vec3, f32)], seed: u32) -> f32 {
    let warp = Vec3::splat(0.06) * fbm(direction * 3.0, 3, seed + 20);
    let to_plane = |(normal, distance): &(Vec3, f32)| {
        let along = normal.dot(direction + warp);
        // A plane that the direction hardly meets would be too far away to cut.
        if along > 0.05 { distance / along } else { 2.0 }
    };
    // The nearest plane cuts the sphere. Noise wears the surface.
    let cut = cuts.iter().map(to_plane).fold(1.15, f32::min);
    let worn = 0.10 * fbm(direction * 2.2, 3, seed) + 0.07 * ridges(direction * 4.5, 4, seed + 7);
    let grain = 0.006 * fbm(direction * 34.0, 2, seed + 13);
    cut + worn + grain - 0.04
}

fn color(position: Vec3, normal: Vec3, seed: u32) -> Vec3 {
    let blotch = smoothstep(-0.5, 0.6, fbm(position * 2.5, 4, seed + 31));
    let stone = GRANITE_DARK.lerp(GRANITE, 0.35 + 0.65 * blotch);
    let upward = normal.y + 0.5 * gradient(position * 4.0, seed + 40);
    stone.lerp(LICHEN, 0.7 * smoothstep(0.25, 0.8, upward))
}

/// A unit sphere from an icosahedron, with welded vertices. Each edge has n = `edge_parts` parts: 20 · n² triangles.
fn icosphere(edge_parts: u32) -> (Vec<Vec3>, Vec<u32>) {
    // Bevy counts the vertices between the ends of an edge.
    let sphere = Sphere::new(1.0).mesh().ico(edge_parts - 1);
    let sphere = sphere.expect("spheres this coarse have few enough vertices");
    let positions = sphere.attribute(Mesh::ATTRIBUTE_POSITION);
    let positions = positions.and_then(VertexAttributeValues::as_float3);
    let positions = positions.unwrap_or_default().iter();
    let indices = sphere.indices().map(Indices::iter);
    (
        positions.map(|&position| Vec3::from(position)).collect(),
        indices.into_iter().flatten().map(|i| i as u32).collect(),
    )
}
