//! Points spread evenly over the surface of a mesh.
//!
//! The first points of a list are spread as evenly as all of them, so that a small instance uses few points.

use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::lanes::{Eight, LANES};
use glam::Vec3;

/// Points of a mesh, a power of two. They are enough for occluders of up to 4,096 texels; larger occluders have fewer points per texel.
pub(crate) const MESH_SAMPLES: u32 = 2048;

/// Points of a mesh, eight to an element.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfaceSamples(Vec<Eight<3>>);

impl SurfaceSamples {
    /// Empty if the hierarchy has no geometry.
    pub(crate) fn new(hierarchy: &Hierarchy) -> Self {
        if hierarchy.unit_vertices.is_empty() {
            return Self::default();
        }
        let points = samples_of(hierarchy);
        let in_lanes = points.iter().map(Vec3::to_array);
        Self(Eight::list(in_lanes, points.len() / LANES))
    }

    /// The first `count` points, rounded up to full elements.
    pub(crate) fn first(&self, count: usize) -> &[Eight<3>] {
        &self.0[..count.div_ceil(LANES).min(self.0.len())]
    }
}

/// [`MESH_SAMPLES`] points, one in each equal part of the area; none without area.
fn samples_of(hierarchy: &Hierarchy) -> Vec<Vec3> {
    let count = MESH_SAMPLES;
    let corner = |vertex: u32| hierarchy.vertices.positions[vertex as usize];
    let units = hierarchy.source_units();
    let triangles: Vec<[Vec3; 3]> = units
        .flat_map(|unit| hierarchy.triangles_of(&hierarchy.units[unit]))
        .map(|triangle| triangle.map(corner))
        .collect();
    let area_of = |[a, b, c]: &[Vec3; 3]| (*b - *a).cross(*c - *a).length();
    let total: f32 = triangles
        .iter()
        .map(area_of)
        .filter(|area| area.is_finite())
        .sum();
    if !(total > 0.0 && total < f32::INFINITY) {
        return Vec::new();
    }
    // Finds the triangle at the middle of each part, along the list of triangles.
    let mut points = Vec::with_capacity(count as usize);
    let (mut index, mut until) = (0, area_of(&triangles[0]));
    for sample in 0..count {
        let wanted = total * ((sample as f32 + 0.5) / count as f32);
        while until < wanted && index + 1 < triangles.len() {
            index += 1;
            until += area_of(&triangles[index]);
        }
        points.push(point_in(&triangles[index], sample));
    }
    // In bit-reversed order, so that the first points are far apart.
    let bits = count.trailing_zeros();
    let order = (0..count).map(|place| place.reverse_bits() >> (u32::BITS - bits));
    order.map(|place| points[place as usize]).collect()
}

/// A point of a triangle, by the number of the sample.
fn point_in([a, b, c]: &[Vec3; 3], sample: u32) -> Vec3 {
    // The additive recurrence of the plastic number, folded into the triangle.
    let along = |step: f32| (step * sample as f32 + 0.5) % 1.0;
    let (u, v) = (along(0.754_877_7), along(0.569_840_3));
    let (u, v) = if u + v > 1.0 {
        (1.0 - u, 1.0 - v)
    } else {
        (u, v)
    };
    *a + (*b - *a) * u + (*c - *a) * v
}
