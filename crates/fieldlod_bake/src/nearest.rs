//! The nearest triangle to a point, through a bounding-volume hierarchy that obvhs builds.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Triangles that can be asked how far a point is from them.
#[derive(Default)]
pub(crate) struct TriangleTree {
    nodes: Vec<Node>,
    /// In the order of the leaves.
    triangles: Vec<Triangle>,
    /// For each of `triangles`, its place in the order in which it was given.
    ids: Vec<u32>,
}

/// A triangle and how far it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub(crate) distance_squared: f32,
    /// See [`TriangleTree::triangle`].
    pub(crate) slot: u32,
}

#[derive(Clone, Copy)]
struct Node {
    min: Vec3A,
    max: Vec3A,
    /// The first of two children, or of `triangle_count` triangles.
    first: u32,
    triangle_count: u32,
}

impl Node {
    fn distance_squared(&self, point: Vec3A) -> f32 {
        let outside = (self.min - point).max(point - self.max).max(Vec3A::ZERO);
        outside.length_squared()
    }
}

/// What is looked at later, if it is still near enough then.
struct Pending {
    distance_squared: f32,
    node: u32,
}

impl TriangleTree {
    /// Coordinates must be finite.
    pub(crate) fn of(corners: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let mut given: Vec<Triangle> = Vec::with_capacity(corners.size_hint().0);
        let mut given_ids: Vec<u32> = Vec::with_capacity(corners.size_hint().0);
        for (id, triangle) in (0..).zip(corners.map(Triangle::new)) {
            // A hundred thousand copies of one would take the builder the square of that.
            if given.last() != Some(&triangle) {
                given.push(triangle);
                given_ids.push(id);
            }
        }
        let boxes: Vec<Aabb> = given.iter().map(Triangle::aabb).collect();
        let ids = (0..given.len() as u32).collect();
        let tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Minimum,
            &boxes,
            ids,
            SortPrecision::U64,
            0,
        );
        Self::from_bvh(&given, &given_ids, &tree)
    }

    fn from_bvh(given: &[Triangle], given_ids: &[u32], tree: &Bvh2) -> Self {
        let node = |node: &obvhs::bvh2::node::Bvh2Node| Node {
            min: Vec3A::from_array(node.aabb().min.to_array()),
            max: Vec3A::from_array(node.aabb().max.to_array()),
            first: node.first_index,
            triangle_count: node.prim_count,
        };
        let order = || tree.primitive_indices.iter().map(|&index| index as usize);
        Self {
            nodes: tree.nodes.iter().map(node).collect(),
            triangles: order().map(|index| given[index]).collect(),
            ids: order().map(|index| given_ids[index]).collect(),
        }
    }

    /// A triangle at most `enough` (squared) from `point`, or else the nearest. `guess` is a slot
    /// to try first; it costs little if wrong. `None` without triangles.
    pub(crate) fn nearest(&self, point: Vec3A, enough: f32, guess: u32) -> Option<Hit> {
        let mut best = self.hit(point, guess)?;
        if best.distance_squared <= enough {
            return Some(best);
        }
        let mut pending: Vec<Pending> = Vec::with_capacity(64);
        let mut index = 0;
        loop {
            let node = &self.nodes[index as usize];
            if node.triangle_count > 0 {
                for slot in node.first..node.first + node.triangle_count {
                    let distance_squared = self.triangles[slot as usize].distance_squared(point);
                    if distance_squared < best.distance_squared {
                        best = Hit {
                            distance_squared,
                            slot,
                        };
                    }
                }
                if best.distance_squared <= enough {
                    return Some(best);
                }
            } else if let Some(near) = self.descend(node.first, point, best, &mut pending) {
                index = near;
                continue;
            }
            loop {
                let Some(next) = pending.pop() else {
                    return Some(best);
                };
                if next.distance_squared < best.distance_squared {
                    index = next.node;
                    break;
                }
            }
        }
    }

    /// The nearer of two nodes if it is near enough, leaving the other for later.
    fn descend(
        &self,
        first: u32,
        point: Vec3A,
        best: Hit,
        pending: &mut Vec<Pending>,
    ) -> Option<u32> {
        let distance = |node: u32| self.nodes[node as usize].distance_squared(point);
        let (mut near, mut far) = (first, first + 1);
        let (mut to_near, mut to_far) = (distance(near), distance(far));
        if to_far < to_near {
            (near, far) = (far, near);
            (to_near, to_far) = (to_far, to_near);
        }
        if to_far < best.distance_squared {
            pending.push(Pending {
                distance_squared: to_far,
                node: far,
            });
        }
        (to_near < best.distance_squared).then_some(near)
    }

    fn hit(&self, point: Vec3A, slot: u32) -> Option<Hit> {
        let triangle = self.triangles.get(slot as usize)?;
        let distance_squared = triangle.distance_squared(point);
        Some(Hit {
            distance_squared,
            slot,
        })
    }

    /// Which of the triangles given lies in `slot`.
    pub(crate) fn id(&self, slot: u32) -> u32 {
        self.ids[slot as usize]
    }
}

/// A triangle as a corner and the two edges from it.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Triangle {
    a: Vec3A,
    ab: Vec3A,
    ac: Vec3A,
}

impl Triangle {
    pub(crate) fn new([a, b, c]: [Vec3; 3]) -> Self {
        let (a, b, c) = (Vec3A::from(a), Vec3A::from(b), Vec3A::from(c));
        Self {
            a,
            ab: b - a,
            ac: c - a,
        }
    }

    pub(crate) fn between(a: Vec3A, b: Vec3A, c: Vec3A) -> Self {
        let (ab, ac) = (b - a, c - a);
        Self { a, ab, ac }
    }

    fn aabb(&self) -> Aabb {
        let (b, c) = (self.a + self.ab, self.a + self.ac);
        Aabb {
            min: self.a.min(b).min(c).to_array().into(),
            max: self.a.max(b).max(c).to_array().into(),
        }
    }

    /// Squared distance from `point` to the nearest point of the triangle.
    ///
    /// Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
    pub(crate) fn distance_squared(&self, point: Vec3A) -> f32 {
        let ap = point - self.a;
        let (d1, d2) = (self.ab.dot(ap), self.ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return ap.length_squared();
        }
        let bp = ap - self.ab;
        let (d3, d4) = (self.ab.dot(bp), self.ac.dot(bp));
        if d3 >= 0.0 && d4 <= d3 {
            return bp.length_squared();
        }
        let cp = ap - self.ac;
        let (d5, d6) = (self.ab.dot(cp), self.ac.dot(cp));
        if d6 >= 0.0 && d5 <= d6 {
            return cp.length_squared();
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (ap - self.ab * share(d1, d1 - d3)).length_squared();
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (ap - self.ac * share(d2, d2 - d6)).length_squared();
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
            let along = share(d4 - d3, (d4 - d3) + (d5 - d6));
            return (bp - (self.ac - self.ab) * along).length_squared();
        }
        let normal = self.ab.cross(self.ac);
        let normal_squared = normal.length_squared();
        // The normal of a needle is noise, and noise must not make a distance shorter.
        if normal_squared > 1e-9 * self.ab.length_squared() * self.ac.length_squared() {
            let height = normal.dot(ap);
            return height * height / normal_squared;
        }
        ap.length_squared()
            .min(bp.length_squared())
            .min(cp.length_squared())
    }
}

/// `part / whole`, and 0 of nothing.
fn share(part: f32, whole: f32) -> f32 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against all triangles one by one.
    #[test]
    fn finds_what_a_plain_search_finds() {
        let mesh = crate::fixtures::rock(3, 5);
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let corners = |triangle: &[u32; 3]| triangle.map(|v| mesh.positions[v as usize]);
        let tree = TriangleTree::of(triangles.iter().map(corners));
        for point in &mesh.positions {
            for scale in [0.3, 0.9, 1.0, 1.02, 3.0] {
                let point = Vec3A::from(*point * scale);
                let each = tree.triangles.iter().map(|t| t.distance_squared(point));
                let expected = each.fold(f32::INFINITY, f32::min);
                let found = tree.nearest(point, 0.0, 7).unwrap();
                assert_eq!(found.distance_squared, expected);
                let near = tree.nearest(point, expected * 2.0, 7).unwrap();
                assert!(near.distance_squared <= expected * 2.0);
            }
        }
    }

    #[test]
    fn needles_and_points_are_as_far_as_their_corners() {
        for corners in [
            [Vec3::ONE; 3],
            [Vec3::ZERO, Vec3::X, Vec3::X * 0.5],
            [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1e-8, 0.0)],
        ] {
            let tree = TriangleTree::of([corners].into_iter());
            let above = Vec3A::from(corners[0]) + Vec3A::Z;
            let distance = tree.nearest(above, 0.0, 0).unwrap().distance_squared;
            assert!((distance - 1.0).abs() < 1e-5, "{corners:?}: {distance}");
        }
        assert!(
            TriangleTree::of(std::iter::empty())
                .nearest(Vec3A::ZERO, 0.0, 0)
                .is_none()
        );
    }
}
