//! Samples along open edges. If a border is simplified within its plane, vertices and triangle centres stay on the
//! source. Edges may still cross a hole or leave the rim.

use glam::Vec3;

use crate::mesh::edges::{Edge, is_unbalanced, sorted_edges};
use crate::mesh::triangle_tree::TriangleTree;
use crate::mesh::weld;

/// Samples per edge. For polygons and curves, points between samples are at most about 2 % farther away.
/// With 3 and 15, deviations of six meshes do not differ.
const SAMPLES_PER_EDGE: u32 = 7;

/// Raises the largest squared distance by samples along the open edges of a simplified surface.
pub(super) fn sample_borders(source: &TriangleTree, triangles: &[[Vec3; 3]], farthest: &mut f32) {
    let mut start = None;
    for [from, to] in open_edges(triangles) {
        for place in 1..=SAMPLES_PER_EDGE {
            let point = from.lerp(to, place as f32 / (SAMPLES_PER_EDGE + 1) as f32);
            start = source.near_enough(point, *farthest, start);
            if let Some(near) = start {
                *farthest = farthest.max(near.distance_squared);
            }
        }
    }
}

/// Edges that triangles use more often in one direction than in the other. The outer edges of two-sided sheets also
/// count, although their directions cancel.
fn open_edges(triangles: &[[Vec3; 3]]) -> Vec<[Vec3; 2]> {
    let corners = triangles.as_flattened();
    let welded = weld(corners.iter().copied());
    let edges = sorted_edges(welded.as_chunks().0.iter().copied());
    // Both sides of a two-sided triangle have the same third vertex.
    let has_one_third = |same: &[Edge]| same.iter().all(|edge| edge.3 == same[0].3);
    let same = edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1));
    same.filter(|same| is_unbalanced(same) || has_one_third(same))
        .map(|same| [same[0].0, same[0].1].map(|corner| corners[corner as usize]))
        .collect()
}
