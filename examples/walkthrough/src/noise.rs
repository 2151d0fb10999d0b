//! Deterministic noise: the same numbers on every machine, without state or tables.

use bevy::prelude::*;

/// A well-mixed hash of a lattice point and a seed, with the multipliers of MurmurHash3.
fn hash(cell: IVec3, seed: u32) -> u32 {
    let mut h = seed.wrapping_mul(0x9e37_79b9);
    for component in cell.to_array() {
        h = (h ^ component as u32).wrapping_mul(0x85eb_ca6b);
        h ^= h >> 15;
    }
    h = h.wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 13)
}

/// The number at `index` in a random sequence, from 0 to 1. Each `seed` has its own sequence.
pub(crate) fn random(index: u32, seed: u32) -> f32 {
    // 24 bits are as many as an `f32` holds exactly.
    let bits = hash(IVec3::new(index as i32, 17, 59), seed) >> 8;
    bits as f32 / 16_777_215.0
}

/// Smooth gradient noise at `p`, about −1 to 1. Its features are about one unit apart.
pub(crate) fn gradient(p: Vec3, seed: u32) -> f32 {
    let floor = p.floor();
    let cell = floor.as_ivec3();
    let f = p - floor;
    // The smoothed weights of the upper corners.
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    // The noise blends the gradients of the eight corners.
    let corner = |x: i32, y: i32, z: i32| {
        let offset = f - Vec3::new(x as f32, y as f32, z as f32);
        lattice_gradient(hash(cell + IVec3::new(x, y, z), seed)).dot(offset)
    };
    let along_x = |y, z| f32::lerp(corner(0, y, z), corner(1, y, z), w.x);
    let along_y = |z| f32::lerp(along_x(0, z), along_x(1, z), w.y);
    1.4 * f32::lerp(along_y(0), along_y(1), w.z)
}

fn lattice_gradient(hash: u32) -> Vec3 {
    let part = |shift: u32| ((hash >> shift) & 0x3ff) as f32 / 511.5 - 1.0;
    Vec3::new(part(0), part(10), part(20))
}

/// The sum of octaves of [`gradient`]. Each octave is twice as fine and half as strong as the one before.
pub(crate) fn fbm(p: Vec3, octaves: u32, seed: u32) -> f32 {
    let octave = |i: u32| gradient(p * (1 << i) as f32, seed + i) / (1 << i) as f32;
    (0..octaves).map(octave).sum()
}

/// The sum of octaves of creases, 0 to about 1, with sharp ridges near 1.
pub(crate) fn ridges(p: Vec3, octaves: u32, seed: u32) -> f32 {
    let octave = |i: u32| {
        let crease = 1.0 - gradient(p * (1 << i) as f32, seed + i).abs();
        crease * crease / (2 << i) as f32
    };
    (0..octaves).map(octave).sum()
}

/// Distance from `p` to the nearest of random points, one in each unit cube: 0 to about 1.
pub(crate) fn cells(p: Vec3, seed: u32) -> f32 {
    let floor = p.floor();
    let f = p - floor;
    // The nearest point is usually in this cube or in one of its neighbours.
    let distances_squared = (0..27).map(|i| {
        let offset = IVec3::new(i / 9, i / 3 % 3, i % 3) - 1;
        let bits = hash(floor.as_ivec3() + offset, seed);
        let part = |shift: u32| ((bits >> shift) & 0x3ff) as f32 / 1023.0;
        let point = offset.as_vec3() + Vec3::new(part(0), part(10), part(20));
        point.distance_squared(f)
    });
    distances_squared.fold(f32::MAX, f32::min).sqrt()
}

/// A smooth step from 0 below `low` to 1 above `high`.
pub(crate) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
