//! Small hierarchies and repeatable random numbers for doc examples, tests and benches. The feature
//! `test-support` enables this module.

mod pyramid;

use glam::Vec3;

pub use crate::random::Random;
pub use pyramid::grid_pyramid;

use crate::bounds::{Aabb, Sphere};
use crate::hierarchy::{Group, Hierarchy, NO_GROUP};
use crate::vertices::Vertices;

/// A flat strip of four triangles in the plane z = 0 that simplifies to two.
///
/// Group 0 consumes the source unit 0 (4 triangles) and has an error and a deviation of 0.1. It produces
/// unit 1 (2 triangles). Group 1 is terminal and consumes unit 1.
#[must_use]
pub fn two_level_strip() -> Hierarchy {
    let positions: Vec<Vec3> = (0..6u8)
        .map(|i| Vec3::new(f32::from(i / 2), f32::from(i % 2), 0.0))
        .collect();
    let fine = [0u16, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5];
    let coarse = [0u16, 2, 1, 1, 2, 3];
    let bounds = Sphere::around(positions.iter().copied());
    let aabb = Aabb::around(positions.iter().copied()).unwrap_or_default();
    let group = |error_in_local| Group {
        bounds,
        error_in_local,
        deviation_in_local: error_in_local,
        mean_normal: Vec3::Z,
        ..Group::default()
    };
    let vertices = Vertices {
        normals: vec![Vec3::Z; positions.len()],
        positions,
        ..Vertices::default()
    };
    let mut strip = Hierarchy {
        source: vertices.source_hash(&fine.map(u32::from)),
        vertices,
        source_vertex_count: 6,
        ..Hierarchy::default()
    };
    strip.push_unit(NO_GROUP, aabb, 0..6, fine);
    strip.push_group(group(0.1), []);
    strip.push_unit(0, aabb, [0, 1, 4, 5], coarse);
    strip.push_group(group(f32::INFINITY), [0]);
    strip
}
