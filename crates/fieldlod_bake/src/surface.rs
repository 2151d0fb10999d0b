//! A surface on which points are found by walking from triangle to triangle.

mod prism;
mod runs;

use std::sync::OnceLock;

use glam::Vec3A;

pub(crate) use self::prism::Crossing;
use self::prism::Prism;
pub(crate) use self::runs::{Hit, RunTree};
use crate::triangle::Triangle;

/// No triangle.
pub(crate) const NONE: u32 = u32::MAX;
/// A walk that is longer goes in circles, as a rule.
const LONGEST_WALK: usize = 64;
/// How many edges at one vertex are looked through for a neighbour. Fans of more are left to the
/// tree: going through each of a hundred thousand triangles for all others would never end.
const MOST_EDGES: usize = 64;

/// Triangles that share vertices, and how far points are from them.
pub(crate) struct Surface<'a> {
    positions: &'a [[f32; 3]],
    corners: Vec<[u32; 3]>,
    prisms: Vec<Prism>,
    /// Across the edge from each corner to the next.
    neighbours: Vec<[u32; 3]>,
    /// Built when a walk leads nowhere.
    tree: OnceLock<RunTree>,
}

impl<'a> Surface<'a> {
    /// Corners are indices of `positions`, and those at the same place are equal. `last_edge` has
    /// an element [`NONE`] for each position, and has so again afterwards.
    pub(crate) fn of(
        positions: &'a [[f32; 3]],
        corners: Vec<[u32; 3]>,
        last_edge: &mut [u32],
    ) -> Self {
        let at = |v: u32| Vec3A::from_array(positions[v as usize]);
        let prisms = corners.iter().map(|triangle| Prism::on(triangle.map(at)));
        Self {
            positions,
            prisms: prisms.collect(),
            neighbours: neighbours_of(&corners, last_edge),
            corners,
            tree: OnceLock::new(),
        }
    }

    pub(crate) fn corners(&self) -> &[[u32; 3]] {
        &self.corners
    }

    pub(crate) fn neighbours(&self) -> &[[u32; 3]] {
        &self.neighbours
    }

    pub(crate) fn position(&self, vertex: u32) -> Vec3A {
        Vec3A::from_array(self.positions[vertex as usize])
    }

    pub(crate) fn corner_positions(&self, triangle: u32) -> [Vec3A; 3] {
        self.corners[triangle as usize].map(|vertex| self.position(vertex))
    }

    pub(crate) fn triangle(&self, triangle: u32) -> Triangle {
        let [a, b, c] = self.corner_positions(triangle);
        Triangle::between(a, b, c)
    }

    fn distance_squared(&self, triangle: u32, point: Vec3A) -> f32 {
        self.triangle(triangle).distance_squared(point)
    }

    /// How far `point` is from the plane of a triangle, as a square.
    pub(crate) fn height_squared(&self, triangle: u32, point: Vec3A) -> f32 {
        self.prisms[triangle as usize].height_squared(point)
    }

    /// How `way` goes over the prism that stands on a triangle.
    pub(crate) fn crossing(&self, triangle: u32, way: [Vec3A; 2]) -> Crossing {
        self.prisms[triangle as usize].crossing(way)
    }

    /// The edge of a triangle that `point` is furthest outside of, if any.
    pub(crate) fn edge_facing(&self, triangle: u32, point: Vec3A) -> Option<usize> {
        self.prisms[triangle as usize].place(point).outside
    }

    /// A triangle at most `enough` (squared) from `point`, or else the nearest. `near` is what is
    /// known already.
    pub(crate) fn search(&self, point: Vec3A, enough: f32, near: Hit) -> Hit {
        let corners = |triangle: u32| self.corner_positions(triangle);
        let tree = self
            .tree
            .get_or_init(|| RunTree::of(self.corners.len(), corners));
        let distance = |triangle: u32| self.distance_squared(triangle, point);
        tree.nearest(point, enough, near, distance)
    }

    /// Walks from `start` towards `point`, to a triangle at most `enough` (squared) away, or to one
    /// that it stands above, or as far as it goes; says whether it is one of the first two.
    /// Nothing is further than the walk says.
    pub(crate) fn walk(&self, point: Vec3A, enough: f32, start: u32) -> (Hit, bool) {
        let (mut before, mut triangle) = (NONE, start);
        for _ in 0..LONGEST_WALK {
            let place = self.prisms[triangle as usize].place(point);
            if place.outside.is_none() || place.distance_squared <= enough {
                let distance_squared = place.distance_squared;
                return (
                    Hit {
                        distance_squared,
                        triangle,
                    },
                    true,
                );
            }
            let edge = place.outside.unwrap_or_default();
            let next = self.neighbours[triangle as usize][edge];
            if next == NONE || next == before {
                break;
            }
            (before, triangle) = (triangle, next);
        }
        let hit = self.nearest_around(point, enough, triangle);
        (hit, hit.distance_squared <= enough)
    }

    /// The nearest of a triangle and its neighbours, or one of them that is near enough.
    fn nearest_around(&self, point: Vec3A, enough: f32, triangle: u32) -> Hit {
        let mut best = Hit {
            distance_squared: self.distance_squared(triangle, point),
            triangle,
        };
        for neighbour in self.neighbours[triangle as usize] {
            if best.distance_squared <= enough {
                break;
            }
            if neighbour != NONE {
                let distance_squared = self.distance_squared(neighbour, point);
                if distance_squared < best.distance_squared {
                    best = Hit {
                        distance_squared,
                        triangle: neighbour,
                    };
                }
            }
        }
        best
    }
}

/// For each triangle, those across its edges; one of them where there are several. Edges are found
/// in chains, one for each vertex that they start from.
fn neighbours_of(corners: &[[u32; 3]], last_edge: &mut [u32]) -> Vec<[u32; 3]> {
    let mut earlier: Vec<[u32; 3]> = vec![[NONE; 3]; corners.len()];
    for (triangle, corners) in corners.iter().enumerate() {
        for (k, &from) in corners.iter().enumerate() {
            let last = &mut last_edge[from as usize];
            earlier[triangle][k] = std::mem::replace(last, triangle as u32 * 3 + k as u32);
        }
    }
    let opposite = |from: u32, to: u32| {
        let mut edge = last_edge[to as usize];
        for _ in 0..MOST_EDGES {
            if edge == NONE {
                break;
            }
            let (triangle, k) = ((edge / 3) as usize, (edge % 3) as usize);
            if corners[triangle][(k + 1) % 3] == from {
                return triangle as u32;
            }
            edge = earlier[triangle][k];
        }
        NONE
    };
    let across = |&[a, b, c]: &[u32; 3]| [opposite(a, b), opposite(b, c), opposite(c, a)];
    let neighbours = corners.iter().map(across).collect();
    for &vertex in corners.iter().flatten() {
        last_edge[vertex as usize] = NONE;
    }
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;

    fn check(mesh: &crate::SourceMesh, scales: &[f32]) {
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(glam::Vec3::to_array).collect();
        let (corners, _) = mesh.indices.as_chunks::<3>();
        let mut last_edge = vec![NONE; positions.len()];
        let surface = Surface::of(&positions, corners.to_vec(), &mut last_edge);
        assert!(last_edge.iter().all(|&edge| edge == NONE));
        let triangles = corners.len() as u32;
        for (index, point) in mesh.positions.iter().enumerate() {
            for &scale in scales {
                let point = Vec3A::from(*point * scale);
                let each = (0..triangles).map(|t| surface.distance_squared(t, point));
                let expected = each.fold(f32::INFINITY, f32::min);
                let start = (index * 7) as u32 % triangles;
                // Squares of coordinates of about 1, in single precision.
                let rounding = 1e-5 * (1.0 + expected);
                let (near, _) = surface.walk(point, 0.0, start);
                assert!(near.distance_squared >= expected - rounding);
                let found = surface.search(point, 0.0, near).distance_squared;
                assert!(
                    (found - expected).abs() <= rounding,
                    "{found} for {expected}"
                );
                let (near, _) = surface.walk(point, 1e-3, start);
                let own = surface.distance_squared(near.triangle, point);
                assert!(
                    own <= near.distance_squared + rounding,
                    "{own} is walked as {near:?}"
                );
            }
        }
    }

    /// Against all triangles one by one.
    #[test]
    fn walks_and_searches_match_naive() {
        let scales = [0.3, 0.9, 1.0, 1.02, 3.0];
        check(&fixtures::rock(3, 5), &scales);
        check(&fixtures::torus_knot(60, 8), &scales);
        check(&fixtures::doubled(fixtures::rock(2, 5)), &scales);
        check(&fixtures::non_manifold_fan(300), &scales);
        check(&fixtures::coincident_points(300), &scales);
        check(&fixtures::islands(100), &scales);
    }
}
