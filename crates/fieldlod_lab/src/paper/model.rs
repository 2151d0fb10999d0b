//! A generated model: a striped torus knot, as triangles and as surfels.

use core::f64::consts::TAU;

use fieldlod_hierarchy::fixtures::Random;
use glam::{DVec3, dvec3};

/// A point of the model's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
    /// Colour before light.
    pub(super) albedo: DVec3,
}

impl Vertex {
    /// Colour under a fixed light.
    pub(super) fn color(&self) -> DVec3 {
        let light = dvec3(-0.4, -0.7, -0.6).normalize();
        self.albedo * (0.25 + 0.75 * self.normal.normalize().dot(light).max(0.0))
    }

    /// The point with these weights on a triangle.
    pub(super) fn mix(triangle: &[Self; 3], weights: [f64; 3]) -> Self {
        let sum = |part: fn(&Self) -> DVec3| {
            let parts = triangle.iter().zip(weights);
            parts.map(|(vertex, weight)| part(vertex) * weight).sum()
        };
        Self {
            position: sum(|vertex| vertex.position),
            normal: sum(|vertex| vertex.normal),
            albedo: sum(|vertex| vertex.albedo),
        }
    }
}

const ALONG: u32 = 720;
const AROUND: u32 = 80;
const TUBE_RADIUS: f64 = 0.3;

/// The model's triangles; their fronts are outside.
pub(super) fn torus_knot() -> Vec<[Vertex; 3]> {
    let at = |along: u32, around: u32| {
        let share = |step: u32, count: u32| f64::from(step % count) / f64::from(count);
        vertex(share(along, ALONG), share(around, AROUND))
    };
    (0..ALONG)
        .flat_map(|along| (0..AROUND).map(move |around| (along, around)))
        .flat_map(|(along, around)| {
            // Two triangles of each quad.
            let here = at(along, around);
            let across = at(along + 1, around + 1);
            [
                [here, at(along + 1, around), across],
                [here, across, at(along, around + 1)],
            ]
        })
        .collect()
}

fn knot(turn: f64) -> DVec3 {
    let radius = 1.0 + 0.45 * (3.0 * turn).cos();
    dvec3(
        radius * (2.0 * turn).cos(),
        radius * (2.0 * turn).sin(),
        0.6 * (3.0 * turn).sin(),
    )
}

fn vertex(along: f64, around: f64) -> Vertex {
    // A frame around the knot's line.
    let turn = along * TAU;
    let center = knot(turn);
    let tangent = (knot(turn + 1e-4) - knot(turn - 1e-4)).normalize();
    let side = tangent.cross(DVec3::Z).normalize();
    let up = side.cross(tangent);
    let angle = around * TAU;
    let normal = side * angle.cos() + up * angle.sin();
    // Stripes that wind around the tube.
    let stripe = (20.0 * turn + 3.0 * angle).sin();
    let base = dvec3(0.86, 0.55, 0.28);
    let band = dvec3(0.20, 0.42, 0.62);
    let share = (0.5 + 2.0 * stripe).clamp(0.0, 1.0);
    Vertex {
        position: center + normal * TUBE_RADIUS,
        normal,
        albedo: base.lerp(band, share),
    }
}

fn area(triangle: &[Vertex; 3]) -> f64 {
    let [a, b, c] = triangle.map(|vertex| vertex.position);
    0.5 * (b - a).cross(c - a).length()
}

/// Points spread evenly over the surface, one in each of `count` strata of equal area, and the area
/// of a stratum.
pub(super) fn sample_surface(
    triangles: &[[Vertex; 3]],
    count: u32,
    random: &mut Random,
) -> (Vec<Vertex>, f64) {
    let total: f64 = triangles.iter().map(area).sum();
    let stratum = total / f64::from(count);
    let mut next = stratum * f64::from(random.unit());
    let mut index = 0;
    let mut samples = Vec::new();
    let mut passed = 0.0;
    for triangle in triangles {
        // All strata that begin within this triangle.
        passed += area(triangle);
        while next < passed {
            // Evenly over a triangle: fold the unit square.
            let (u, v) = (f64::from(random.unit()), f64::from(random.unit()));
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            samples.push(Vertex::mix(triangle, [1.0 - u - v, u, v]));
            index += 1;
            next = stratum * (f64::from(index) + f64::from(random.unit()));
        }
    }
    (samples, stratum)
}
