//! The nearest point of a triangle soup, through a bounding-volume hierarchy that obvhs builds.

use std::fmt;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Triangles that can be asked for their point nearest to another.
pub(crate) struct NearestSurface {
    tree: Bvh2,
    triangles: Vec<[Vec3A; 3]>,
}

impl fmt::Debug for NearestSurface {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let triangles = self.triangles.len();
        write!(formatter, "NearestSurface({triangles} triangles)")
    }
}

impl NearestSurface {
    pub(crate) fn new(triangles: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let triangles: Vec<[Vec3A; 3]> = triangles.map(|t| t.map(Vec3A::from)).collect();
        let boxes: Vec<Aabb> = triangles.iter().map(bounds).collect();
        let ids = (0..triangles.len() as u32).collect();
        let tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Minimum,
            &boxes,
            ids,
            SortPrecision::U64,
            0,
        );
        Self { tree, triangles }
    }

    /// The nearest point; `None` without triangles.
    pub(crate) fn nearest(&self, point: Vec3) -> Option<Vec3> {
        if self.triangles.is_empty() {
            return None;
        }
        let point = Vec3A::from(point);
        let mut best = (f32::INFINITY, Vec3A::ZERO);
        let mut pending = vec![(0.0, 0u32)];
        while let Some((distance, node)) = pending.pop() {
            if distance < best.0 {
                self.visit(
                    &self.tree.nodes[node as usize],
                    point,
                    &mut best,
                    &mut pending,
                );
            }
        }
        Some(best.1.into())
    }

    fn visit(
        &self,
        node: &Bvh2Node,
        point: Vec3A,
        best: &mut (f32, Vec3A),
        pending: &mut Vec<(f32, u32)>,
    ) {
        if node.prim_count > 0 {
            for slot in node.first_index..node.first_index + node.prim_count {
                let id = self.tree.primitive_indices[slot as usize];
                let nearest = nearest_on_triangle(&self.triangles[id as usize], point);
                let distance = nearest.distance_squared(point);
                if distance < best.0 {
                    *best = (distance, nearest);
                }
            }
            return;
        }
        let child = |node: u32| (outside(&self.tree.nodes[node as usize], point), node);
        let (a, b) = (child(node.first_index), child(node.first_index + 1));
        // The nearer one is looked at first.
        let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
        pending.extend([far, near]);
    }
}

fn bounds(triangle: &[Vec3A; 3]) -> Aabb {
    let [a, b, c] = triangle;
    Aabb {
        min: a.min(*b).min(*c).to_array().into(),
        max: a.max(*b).max(*c).to_array().into(),
    }
}

/// Squared distance from a point to a node's box.
fn outside(node: &Bvh2Node, point: Vec3A) -> f32 {
    let aabb = node.aabb();
    let min = Vec3A::from_array(aabb.min.to_array());
    let max = Vec3A::from_array(aabb.max.to_array());
    (min - point)
        .max(point - max)
        .max(Vec3A::ZERO)
        .length_squared()
}

/// The corners, edges and inside of the triangle, whichever is nearest.
fn nearest_on_triangle(&[a, b, c]: &[Vec3A; 3], point: Vec3A) -> Vec3A {
    let normal = (b - a).cross(c - a);
    let normal_squared = normal.length_squared();
    if normal_squared > 0.0 {
        let foot = point - normal * (normal.dot(point - a) / normal_squared);
        let inside = |p: Vec3A, q: Vec3A| normal.dot((q - p).cross(foot - p)) >= 0.0;
        if inside(a, b) && inside(b, c) && inside(c, a) {
            return foot;
        }
    }
    let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| nearest_on_segment(p, q, point));
    let [first, second, third] = edges.map(|edge| edge.distance_squared(point));
    if first <= second && first <= third {
        edges[0]
    } else if second <= third {
        edges[1]
    } else {
        edges[2]
    }
}

fn nearest_on_segment(p: Vec3A, q: Vec3A, point: Vec3A) -> Vec3A {
    let along = q - p;
    let length_squared = along.length_squared();
    if length_squared > 0.0 {
        p + along * (along.dot(point - p) / length_squared).clamp(0.0, 1.0)
    } else {
        p
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldlod_bake::fixtures;

    #[test]
    fn nearest_matches_trying_all_triangles() {
        let mesh = fixtures::rock(2, 1);
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let corners = || {
            triangles
                .iter()
                .map(|t| t.map(|v| mesh.positions[v as usize]))
        };
        let surface = NearestSurface::new(corners());
        for i in 0..200u16 {
            let t = f32::from(i);
            let point = Vec3::new(t.sin(), (t * 1.7).cos(), (t * 0.3).sin()) * 1.3;
            let all = corners().map(|triangle| {
                let nearest = nearest_on_triangle(&triangle.map(Vec3A::from), point.into());
                nearest.distance(point.into())
            });
            let least = all.fold(f32::INFINITY, f32::min);
            let found = surface.nearest(point).unwrap().distance(point);
            assert!((found - least).abs() < 1e-6, "{found} {least}");
        }
    }
}
