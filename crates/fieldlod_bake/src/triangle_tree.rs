//! The triangle of a soup that is nearest to a point, through a bounding-volume hierarchy.

use std::fmt;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::triangle::Triangle;

/// Triangles that can be asked which of them is nearest to a point.
///
/// ```
/// use fieldlod_bake::TriangleTree;
/// use glam::Vec3;
///
/// let tree = TriangleTree::new([[Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::Z, Vec3::X, Vec3::Y]]);
/// let nearest = tree.nearest(Vec3::new(0.2, 0.2, -3.0)).unwrap();
/// assert_eq!((nearest.triangle, nearest.distance_squared), (0, 9.0));
/// ```
pub struct TriangleTree {
    tree: Bvh2,
    /// In the order of the leaves.
    triangles: Vec<Triangle>,
    /// For each of `triangles`, its place in the order in which it was given.
    ids: Vec<u32>,
}

/// A triangle near a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestTriangle {
    /// Its place in the order in which the tree was given its triangles.
    pub triangle: u32,
    /// Its distance from the point, squared.
    pub distance_squared: f32,
    /// Its place in the tree.
    slot: u32,
}

impl fmt::Debug for TriangleTree {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "TriangleTree({} triangles)",
            self.triangles.len()
        )
    }
}

impl TriangleTree {
    /// Builds a tree over triangles given by their corners, which must be finite.
    #[must_use]
    pub fn new(corners: impl IntoIterator<Item = [Vec3; 3]>) -> Self {
        let mut given: Vec<(u32, Triangle)> = Vec::new();
        for (id, triangle) in (0..).zip(corners.into_iter().map(Triangle::new)) {
            // A hundred thousand copies of one would take the builder the square of that.
            if given.last().is_none_or(|(_, last)| *last != triangle) {
                given.push((id, triangle));
            }
        }
        let boxes: Vec<Aabb> = given
            .iter()
            .map(|(_, triangle)| aabb_of(triangle))
            .collect();
        let tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Minimum,
            &boxes,
            (0..boxes.len() as u32).collect(),
            SortPrecision::U64,
            0,
        );
        let leaves = tree.primitive_indices.iter();
        let (ids, triangles) = leaves.map(|&index| given[index as usize]).unzip();
        Self {
            tree,
            triangles,
            ids,
        }
    }

    /// The triangle nearest to `point`; `None` without triangles.
    #[must_use]
    pub fn nearest(&self, point: Vec3) -> Option<NearestTriangle> {
        self.near_enough(point, 0.0, None)
    }

    /// The point of all triangles that is nearest to `point`; `None` without triangles.
    #[must_use]
    pub fn nearest_point(&self, point: Vec3) -> Option<Vec3> {
        let nearest = self.nearest(point)?;
        let triangle = &self.triangles[nearest.slot as usize];
        Some(triangle.nearest_point(point.into()).into())
    }

    /// A triangle at most `enough` (squared) from `point`, or else the nearest; `None` without
    /// triangles.
    ///
    /// `start` is what was found at a point near by, in this tree. It costs little if wrong, and
    /// saves most of the search if right.
    #[must_use]
    pub fn near_enough(
        &self,
        point: Vec3,
        enough: f32,
        start: Option<NearestTriangle>,
    ) -> Option<NearestTriangle> {
        let point = Vec3A::from(point);
        let last = self.triangles.len().checked_sub(1)?;
        let slot = start.map_or(0, |start| start.slot as usize).min(last);
        let mut best = self.at(slot, self.triangles[slot].distance_squared(point));
        if best.distance_squared <= enough {
            return Some(best);
        }
        // Nodes that are still to be looked into, the nearest last, and how far their boxes are.
        let mut pending: Vec<(f32, u32)> = Vec::with_capacity(64);
        let mut next = Some(0);
        while best.distance_squared > enough
            && let Some(index) = next.take()
        {
            let node = &self.tree.nodes[index as usize];
            if node.is_leaf() {
                for slot in node.first_index..node.first_index + node.prim_count {
                    let distance_squared = self.triangles[slot as usize].distance_squared(point);
                    if distance_squared < best.distance_squared {
                        best = self.at(slot as usize, distance_squared);
                    }
                }
            } else {
                let child = |node: u32| (self.to_box(node as usize, point), node);
                let (a, b) = (child(node.first_index), child(node.first_index + 1));
                let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
                if far.0 < best.distance_squared {
                    pending.push(far);
                }
                next = (near.0 < best.distance_squared).then_some(near.1);
            }
            while next.is_none()
                && let Some((to_box, node)) = pending.pop()
            {
                next = (to_box < best.distance_squared).then_some(node);
            }
        }
        Some(best)
    }

    fn at(&self, slot: usize, distance_squared: f32) -> NearestTriangle {
        NearestTriangle {
            triangle: self.ids[slot],
            distance_squared,
            slot: slot as u32,
        }
    }

    /// The squared distance from a point to a node's box.
    fn to_box(&self, node: usize, point: Vec3A) -> f32 {
        // Another version of glam is in use there.
        let aabb = self.tree.nodes[node].aabb();
        let [min, max] = [aabb.min.to_array(), aabb.max.to_array()].map(Vec3A::from_array);
        let outside = (min - point).max(point - max).max(Vec3A::ZERO);
        outside.length_squared()
    }
}

fn aabb_of(triangle: &Triangle) -> Aabb {
    let [a, b, c] = triangle.corners();
    Aabb {
        min: a.min(b).min(c).to_array().into(),
        max: a.max(b).max(c).to_array().into(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::naive;

    /// Points on a coarse lattice now and then, so that corners, edges and planes fall together.
    fn any_point() -> impl Strategy<Value = Vec3> {
        let fine = prop::array::uniform3(-1.0f32..1.0).prop_map(Vec3::from);
        let coarse = prop::array::uniform3(-2i8..=2);
        let coarse = coarse.prop_map(|p| Vec3::from(p.map(|x| f32::from(x) * 0.5)));
        prop_oneof![fine, coarse]
    }

    fn any_soup() -> impl Strategy<Value = Vec<[Vec3; 3]>> {
        prop::collection::vec(prop::array::uniform3(any_point()), 1..80)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// Against all triangles one by one, in double precision.
        #[test]
        fn finds_what_a_plain_search_finds(
            soup in any_soup(),
            points in prop::collection::vec(any_point(), 1..30),
        ) {
            let tree = TriangleTree::new(soup.iter().copied());
            let mut start = None;
            for point in points {
                let exact = |triangle: [Vec3; 3]| {
                    naive::distance(point.as_dvec3(), triangle.map(Vec3::as_dvec3))
                };
                let expected = soup.iter().copied().map(exact).fold(f64::INFINITY, f64::min);
                let found = tree.near_enough(point, 0.0, start).unwrap();
                let distance = f64::from(found.distance_squared.sqrt());
                prop_assert!((distance - expected).abs() < 1e-3, "{distance} {expected}");
                prop_assert!((exact(soup[found.triangle as usize]) - distance).abs() < 1e-3);
                let nearest = tree.nearest_point(point).unwrap();
                let distance = f64::from(nearest.distance(point));
                prop_assert!((distance - expected).abs() < 1e-3, "{distance} {expected}");
                let enough = found.distance_squared * 2.0;
                let near = tree.near_enough(point, enough, None).unwrap();
                prop_assert!(near.distance_squared <= enough);
                start = Some(found);
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
            let tree = TriangleTree::new([corners]);
            let distance = tree.nearest(corners[0] + Vec3::Z).unwrap().distance_squared;
            assert!((distance - 1.0).abs() < 1e-5, "{corners:?}: {distance}");
        }
        assert_eq!(TriangleTree::new([]).nearest(Vec3::ZERO), None);
        assert_eq!(TriangleTree::new([]).nearest_point(Vec3::ZERO), None);
    }
}
