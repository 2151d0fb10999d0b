//! Points spread evenly over the surface of a mesh, and over the surface of each group.
//!
//! The first points of a list are spread as evenly as all of them, so that a small instance uses few points.

use fieldlod_hierarchy::{Hierarchy, Unit};
use glam::Vec3;

use crate::lanes::Eight;
use crate::lanes::bits::LANES;

/// Points of a mesh and of a group. Points of a mesh are enough for occluders of up to 4,096 texels; larger occluders
/// have fewer points per texel. Points of a group are one element of lanes.
pub(crate) const MESH_SAMPLES: u32 = 2048;
pub(crate) const GROUP_SAMPLES: usize = 8;

/// Points of a mesh and of its groups, eight to an element.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfaceSamples {
    mesh: Vec<Eight<3>>,
    /// One element for each group.
    groups: Vec<Eight<3>>,
}

impl SurfaceSamples {
    /// Empty if the hierarchy has no geometry.
    pub(crate) fn new(hierarchy: &Hierarchy) -> Self {
        if hierarchy.unit_vertices.is_empty() {
            return Self::default();
        }
        let source: Vec<&Unit> = hierarchy
            .source_units()
            .map(|unit| &hierarchy.units[unit])
            .collect();
        let groups = hierarchy.groups.iter().map(|group| {
            let units: Vec<&Unit> = hierarchy.units[group.units()].iter().collect();
            // One element for each group; NaN for a group without area.
            let samples = in_lanes(&samples_of(hierarchy, &units, GROUP_SAMPLES as u32));
            samples
                .first()
                .copied()
                .unwrap_or(Eight::splat([f32::NAN; 3]))
        });
        Self {
            groups: groups.collect(),
            mesh: in_lanes(&samples_of(hierarchy, &source, MESH_SAMPLES)),
        }
    }

    /// The first `count` points of the mesh, rounded up to full elements.
    pub(crate) fn of_mesh(&self, count: usize) -> &[Eight<3>] {
        &self.mesh[..count.div_ceil(LANES).min(self.mesh.len())]
    }

    pub(crate) fn of_group(&self, group: usize) -> &[Eight<3>] {
        self.groups.get(group..=group).unwrap_or(&[])
    }
}

/// `count` points, one in each equal part of the area; none without area. `count` is a power of two.
fn samples_of(hierarchy: &Hierarchy, units: &[&Unit], count: u32) -> Vec<Vec3> {
    let corner = |vertex: u32| hierarchy.vertices.positions[vertex as usize];
    let triangles: Vec<[Vec3; 3]> = units
        .iter()
        .flat_map(|unit| hierarchy.triangles_of(unit))
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

fn in_lanes(points: &[Vec3]) -> Vec<Eight<3>> {
    Eight::list(points.iter().map(Vec3::to_array), points.len() / LANES)
}
