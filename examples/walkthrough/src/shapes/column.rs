//! Fluted columns. A profile is revolved around the Y axis and worn by noise. Plinth and abacus are square.

use std::f32::consts::TAU;

use bevy::prelude::*;

use super::Shape;
use crate::noise::{fbm, gradient, smoothstep};

/// Number of vertices around a column: eleven for each of the twenty flutes.
const SECTORS: u32 = 220;
const FLUTES: f32 = 20.0;
const FLUTE_DEPTH_IN_M: f32 = 0.055;
/// Height of one drum of the shaft.
const DRUM_IN_M: f32 = 0.93;

const MARBLE: Vec3 = Vec3::new(0.47, 0.41, 0.32);
const STAIN: Vec3 = Vec3::new(0.20, 0.16, 0.115);

/// A corner of the profile of a column.
#[derive(Clone, Copy, Debug)]
struct Station {
    height: f32,
    radius: f32,
    /// Shape of the cross-section, from 0 (round) to 1 (square).
    square: f32,
    /// Depth of the flutes, as a share of the full depth.
    fluted: f32,
    /// Number of rows of vertices from this station to the next.
    rows: u32,
}

const fn station(height: f32, radius: f32, square: f32, fluted: f32, rows: u32) -> Station {
    Station {
        height,
        radius,
        square,
        fluted,
        rows,
    }
}

const FOOT: [Station; 7] = [
    station(-0.30, 0.0, 1.0, 0.0, 4),
    station(-0.30, 0.80, 1.0, 0.0, 10),
    station(0.25, 0.80, 1.0, 0.0, 4),
    station(0.25, 0.74, 0.0, 0.0, 3),
    station(0.33, 0.79, 0.0, 0.0, 4),
    station(0.45, 0.72, 0.0, 0.0, 3),
    station(0.48, 0.60, 0.0, 0.0, 4),
];

const SHAFT_AND_CAPITAL: [Station; 8] = [
    station(0.60, 0.56, 0.0, 1.0, 84),
    station(5.25, 0.46, 0.0, 1.0, 4),
    station(5.35, 0.47, 0.0, 0.0, 8),
    station(5.62, 0.70, 0.0, 0.0, 3),
    station(5.68, 0.70, 0.0, 0.0, 3),
    station(5.68, 0.74, 1.0, 0.0, 8),
    station(6.00, 0.76, 1.0, 0.0, 8),
    station(6.00, 0.0, 1.0, 0.0, 0),
];

const STUMP: [Station; 4] = [
    station(0.60, 0.56, 0.0, 1.0, 70),
    station(2.75, 0.52, 0.0, 1.0, 3),
    station(2.80, 0.46, 0.0, 0.6, 24),
    station(2.80, 0.0, 0.0, 0.0, 0),
];

/// A whole column. It is 6 m high above the ground and reaches 0.3 m into it.
pub(crate) fn column() -> Shape {
    let profile: Vec<_> = FOOT.into_iter().chain(SHAFT_AND_CAPITAL).collect();
    revolve(&profile, |p| p)
}

/// A column that is broken at a height of about 2.8 m. The break is slanted and jagged.
pub(crate) fn broken_column() -> Shape {
    let profile: Vec<_> = FOOT.into_iter().chain(STUMP).collect();
    revolve(&profile, |p| {
        let near_the_break = smoothstep(1.3, 2.6, p.y);
        let slant = 0.9 * p.x + 0.35 * p.z;
        let jags = 0.35 * fbm(p * Vec3::new(2.3, 0.3, 2.3), 5, 77);
        p + Vec3::Y * near_the_break * (slant + jags)
    })
}

/// Revolves a profile around the Y axis. `bend` moves each vertex.
fn revolve(profile: &[Station], bend: impl Fn(Vec3) -> Vec3) -> Shape {
    // The first and the last vertex are on the axis; rings of vertices are between them.
    let rows = rows(profile);
    let ring_count = rows.len() as u32 - 2;
    let mut positions = vec![bend(Vec3::Y * rows[0].height)];
    for row in &rows[1..=ring_count as usize] {
        positions.extend((0..SECTORS).map(|sector| bend(surface_point(row, sector))));
    }
    positions.push(bend(Vec3::Y * rows[rows.len() - 1].height));
    Shape::smooth(positions, revolved_triangles(ring_count), color)
}

/// Interpolates the rows between the stations.
fn rows(profile: &[Station]) -> Vec<Station> {
    let between = |pair: &[Station]| {
        let [from, to] = [pair[0], pair[1]];
        (0..from.rows).map(move |row| {
            let t = row as f32 / from.rows as f32;
            let mix = |value: fn(&Station) -> f32| f32::lerp(value(&from), value(&to), t);
            let (height, radius) = (mix(|s| s.height), mix(|s| s.radius));
            station(height, radius, mix(|s| s.square), mix(|s| s.fluted), 1)
        })
    };
    let last = profile.last().copied();
    profile.windows(2).flat_map(between).chain(last).collect()
}

fn surface_point(row: &Station, sector: u32) -> Vec3 {
    let angle = TAU * sector as f32 / SECTORS as f32;
    let (sin, cos) = angle.sin_cos();
    // The outline blends a circle and a square, which is a superellipse. Flutes are cut into it.
    let square = 1.0 / (cos.powi(12) + sin.powi(12)).powf(1.0 / 12.0);
    let outline = row.radius * f32::lerp(1.0, square, row.square);
    let flute = FLUTE_DEPTH_IN_M * row.fluted * (angle * FLUTES / 2.0).sin().abs();

    let smooth = Vec3::new(cos * (outline - flute), row.height, sin * (outline - flute));
    // Near the axis, the full depth would turn the surface inside out.
    let depth = wear_in_m(smooth, row) * (row.radius / 0.4).min(1.0);
    smooth - Vec3::new(cos, 0.0, sin) * depth
}

/// Depth of the removed stone at a point.
fn wear_in_m(p: Vec3, row: &Station) -> f32 {
    // Stone is missing at chips and at the joint between two drums. The grain is fine noise.
    let chips = (fbm(p * 2.1, 4, 5) - 0.28).max(0.0);
    let to_joint = (p.y / DRUM_IN_M - (p.y / DRUM_IN_M).round()).abs() * DRUM_IN_M;
    let joint = row.fluted * (1.0 - smoothstep(0.01, 0.05, to_joint));
    0.22 * chips + 0.025 * joint + 0.012 * fbm(p * 7.0, 3, 9) + 0.004 * gradient(p * 31.0, 11)
}

fn revolved_triangles(ring_count: u32) -> Vec<u32> {
    let top = 1 + ring_count * SECTORS;
    let at = |ring: u32, sector: u32| 1 + ring * SECTORS + sector % SECTORS;
    let mut triangles = Vec::with_capacity((ring_count * SECTORS * 2) as usize);
    for sector in 0..SECTORS {
        triangles.push([0, at(0, sector), at(0, sector + 1)]);
        for ring in 1..ring_count {
            let [a, b] = [at(ring - 1, sector), at(ring - 1, sector + 1)];
            let [c, d] = [at(ring, sector), at(ring, sector + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
        let last = ring_count - 1;
        triangles.push([at(last, sector), top, at(last, sector + 1)]);
    }
    triangles.into_flattened()
}

fn color(position: Vec3, normal: Vec3) -> Vec3 {
    let weathering = fbm(position * Vec3::new(3.0, 0.8, 3.0), 4, 21);
    let rain = smoothstep(-0.1, 0.7, weathering) * (1.0 - 0.5 * normal.y.max(0.0));
    let base = 1.0 - smoothstep(0.0, 0.9, position.y);
    MARBLE.lerp(STAIN, (0.65 * rain + 0.35 * base).min(1.0))
}
