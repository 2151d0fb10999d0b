//! Hierarchies made without a baker, and repeatable numbers, for doc examples, tests and benches.

mod pyramid;
mod random;

use glam::Vec3;

pub use pyramid::grid_pyramid;
pub use random::Random;

use crate::{Aabb, Cluster, Group, Hierarchy, NO_GROUP, SourceHash, Sphere, Unit, Vertices};

/// A flat strip of four triangles in the plane z = 0 that simplifies to two.
///
/// Two groups: group 0 consumes the source unit 0 (4 triangles) with an error and a deviation of
/// 0.1, group 1 is terminal and consumes unit 1 (2 triangles), which group 0 produced.
#[must_use]
pub fn two_level_strip() -> Hierarchy {
    let positions: Vec<Vec3> = (0..6u8)
        .map(|i| Vec3::new(f32::from(i / 2), f32::from(i % 2), 0.0))
        .collect();
    let fine = [0u16, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5];
    let coarse = [0u16, 2, 1, 1, 2, 3];
    let source = SourceHash::of(&positions, fine.iter().map(|&i| u32::from(i)));
    let bounds = Sphere::around(positions.iter().copied());
    let aabb = Aabb::around(positions.iter().copied()).unwrap_or_default();
    let group = |level, error_in_local, first_finer, finer_count| Group {
        bounds,
        error_in_local,
        deviation_in_local: error_in_local,
        normal_error: 0.0,
        uv_error: 0.0,
        mean_normal: Vec3::Z,
        level,
        first_finer,
        finer_count,
        first_unit: level,
        unit_count: 1,
    };
    let unit =
        |index, produced_by, first_vertex, vertex_count, first_triangle, triangle_count| Unit {
            aabb,
            consumed_by: index,
            produced_by,
            first_vertex,
            vertex_count,
            first_triangle,
            triangle_count,
            first_cluster: index,
            cluster_count: 1,
        };
    let cluster = |first_triangle, triangle_count| Cluster {
        bounds,
        first_triangle,
        triangle_count,
    };
    Hierarchy {
        source,
        vertices: Vertices {
            normals: vec![Vec3::Z; positions.len()],
            positions,
            ..Vertices::default()
        },
        groups: vec![group(0, 0.1, 0, 0), group(1, f32::INFINITY, 0, 1)],
        finer: vec![0],
        units: vec![unit(0, NO_GROUP, 0, 6, 0, 4), unit(1, 0, 6, 4, 4, 2)],
        clusters: vec![cluster(0, 4), cluster(4, 2)],
        unit_vertices: vec![0, 1, 2, 3, 4, 5, 0, 1, 4, 5],
        indices: fine.into_iter().chain(coarse).collect(),
    }
}
