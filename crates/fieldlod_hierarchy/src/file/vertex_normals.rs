//! Normals as triangles lie, to predict those of vertices from.
//!
//! The normal of a vertex is the mean of those of its triangles, weighted by the angles at it (G. Thürmer,
//! C. Wüthrich: Computing Vertex Normals from Polygonal Facets, 1998), which is what most tools make.

use std::f32::consts::PI;

use glam::Vec3;

use super::coded::{Coded, Ends};

/// The normals of the vertices that `coded` holds since `from`, by the triangles since then; zero
/// where there are none. `position` is asked for vertices by the order of coding.
pub(super) fn vertex_normals(
    coded: &Coded,
    from: Ends,
    position: impl Fn(u32) -> Vec3,
) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; coded.vertex_indices.len() - from.vertices];
    let mut vertices = coded.unit_vertices[from.unit_vertices..].iter();
    let (mut indices, _) = coded.indices[from.indices..].as_chunks::<3>();
    for unit in &coded.units[from.units..] {
        // The unit's vertices, and sums of its own.
        let used = vertices.as_slice();
        let used = &used[..unit.vertex_count as usize];
        let triangles;
        (triangles, indices) = indices.split_at(unit.triangle_count as usize);
        let positions: Vec<Vec3> = used.iter().map(|&vertex| position(vertex)).collect();
        for triangle in triangles {
            let corners = triangle.map(|corner| positions[usize::from(corner)]);
            let weighted = weighted_normals(corners);
            for (&corner, normal) in triangle.iter().zip(weighted) {
                let vertex = used[usize::from(corner)] as usize;
                if let Some(vertex) = vertex.checked_sub(from.vertices) {
                    sums[vertex] += normal;
                }
            }
        }
        vertices = vertices.as_slice()[used.len()..].iter();
    }
    sums.iter().map(|sum| sum.normalize_or_zero()).collect()
}

/// The normal of a triangle times the angle at each corner; zero for one without area.
fn weighted_normals([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    let edges = [b - a, c - b, a - c].map(Vec3::normalize_or_zero);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let [ab, bc, ca] = edges;
    [-ca.dot(ab), -ab.dot(bc), -bc.dot(ca)].map(|cosine| normal * arc_cosine(cosine))
}

/// To 7e-5, with basic operations only, which are the same on all machines (M. Abramowitz, I. Stegun:
/// Handbook of Mathematical Functions, 4.4.45).
fn arc_cosine(cosine: f32) -> f32 {
    let x = cosine.abs().min(1.0);
    let series = 1.570_728_8 + x * (-0.212_114_4 + x * (0.074_261 - x * 0.018_729_3));
    let angle = (1.0 - x).sqrt() * series;
    if cosine < 0.0 { PI - angle } else { angle }
}
