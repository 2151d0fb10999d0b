//! Nearest-triangle queries with a bounding volume hierarchy.

pub(crate) mod triangle;
mod triangles_4;

use std::fmt;

use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::mesh::adapter;
use crate::mesh::triangle_tree::triangles_4::{Boxes4, Triangles4};

/// Triangles in a bounding volume hierarchy, for nearest-triangle queries.
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
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
}

/// Up to four bounding boxes and their children: nodes, or leaves if [`IS_LEAF`] is set.
struct Node {
    boxes: Boxes4,
    inside: [u32; 4],
}

const IS_LEAF: u32 = 1 << 31;

/// Four triangles. If there are fewer, the last triangle is repeated.
struct Leaf {
    triangles: Triangles4,
    /// Index of each triangle in the input of the tree.
    ids: [u32; 4],
}

/// A triangle near a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestTriangle {
    /// Index of the triangle in the input of the tree.
    pub triangle: u32,
    /// Squared distance of the triangle from the point.
    pub distance_squared: f32,
    leaf: u32,
}

impl fmt::Debug for TriangleTree {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "TriangleTree({} leaves)", self.leaves.len())
    }
}

impl TriangleTree {
    /// Builds a tree over triangles. Corners must be finite.
    #[must_use]
    pub fn new(corners: impl IntoIterator<Item = [Vec3; 3]>) -> Self {
        let given: Vec<[Vec3; 3]> = corners.into_iter().collect();
        // Sort triangles along a space-filling curve, so that leaves hold neighbours.
        let middles = given.iter().map(|[a, b, c]| (*a + *b + *c).to_array());
        let ranks = meshopt::spatial_sort_remap(&adapter(&middles.collect::<Vec<_>>()));
        let mut order = vec![0; given.len()];
        for (id, rank) in (0..).zip(ranks) {
            order[rank as usize] = id;
        }
        // Remove duplicates: the builder needs quadratic time for equal triangles.
        order.dedup_by_key(|id: &mut u32| given[*id as usize].map(|corner| corner.to_array()));
        let leaf_of = |ids: &[u32]| {
            let ids = std::array::from_fn(|k| *ids.get(k).unwrap_or(&ids[ids.len() - 1]));
            Leaf {
                triangles: Triangles4::of(ids.map(|id: u32| given[id as usize])),
                ids,
            }
        };
        let leaves: Vec<Leaf> = order.chunks(4).map(leaf_of).collect();
        let boxes: Vec<Aabb> = order
            .chunks(4)
            .map(|ids| aabb_of(ids.iter().flat_map(|&id| given[id as usize])))
            .collect();
        Self {
            nodes: nodes_over(&boxes),
            leaves,
        }
    }

    /// Moves the triangles to new `corners`, which a function returns by index. The tree keeps its structure, so
    /// searches get slower the more the triangles have moved relative to each other.
    pub(crate) fn refit(&mut self, corners: impl Fn(u32) -> [Vec3; 3]) {
        for leaf in &mut self.leaves {
            leaf.triangles = Triangles4::of(leaf.ids.map(&corners));
        }
        // Children follow their parent.
        let mut boxes = vec![[Vec3::ZERO; 2]; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            let node = &self.nodes[index];
            let inside = &node.inside[..node.boxes.count()];
            let of_inside = inside.iter().map(|&inside| match inside & IS_LEAF {
                0 => boxes[inside as usize],
                _ => {
                    let ids = self.leaves[(inside & !IS_LEAF) as usize].ids;
                    let aabb = aabb_of(ids.into_iter().flat_map(&corners));
                    [aabb.min.to_array(), aabb.max.to_array()].map(Vec3::from_array)
                }
            });
            let of_inside: Vec<[Vec3; 2]> = of_inside.collect();
            let both = |a: [Vec3; 2], b: &[Vec3; 2]| [a[0].min(b[0]), a[1].max(b[1])];
            let empty = [Vec3::INFINITY, Vec3::NEG_INFINITY];
            boxes[index] = of_inside.iter().fold(empty, both);
            self.nodes[index].boxes = Boxes4::of(of_inside.into_iter());
        }
    }

    /// The triangle nearest to `point`. `None` if there are no triangles.
    #[must_use]
    pub fn nearest(&self, point: Vec3) -> Option<NearestTriangle> {
        self.near_enough(point, 0.0, None)
    }

    /// The point on any triangle that is nearest to `point`. `None` if there are no triangles.
    #[cfg(any(test, feature = "test-support"))]
    #[must_use]
    pub fn nearest_point(&self, point: Vec3) -> Option<Vec3> {
        let nearest = self.nearest(point)?;
        let leaf = &self.leaves[nearest.leaf as usize];
        let slot = leaf.ids.iter().position(|&id| id == nearest.triangle)?;
        let corners = leaf.triangles.corners(slot);
        Some(triangle::nearest_point(point, corners))
    }

    /// A triangle with a squared distance of at most `enough` from `point`, or else the nearest triangle. `None` if
    /// there are no triangles.
    ///
    /// `start` is the result for a nearby point in this tree. A good start saves most of the search; a bad start costs
    /// little.
    #[must_use]
    pub fn near_enough(
        &self,
        point: Vec3,
        enough: f32,
        start: Option<NearestTriangle>,
    ) -> Option<NearestTriangle> {
        let last = (self.leaves.len() as u32).checked_sub(1)?;
        let mut best = self.nearest_in(start.map_or(0, |start| start.leaf).min(last), point);
        if best.distance_squared <= enough {
            return Some(best);
        }
        // Boxes to visit, the nearest last. Most searches need less than this capacity.
        let mut pending: Vec<Pending> = Vec::with_capacity(64);
        pending.push((0.0, 0));
        while best.distance_squared > enough
            && let Some((distance, inside)) = pending.pop()
        {
            if distance >= best.distance_squared {
                continue;
            }
            if inside & IS_LEAF != 0 {
                let found = self.nearest_in(inside & !IS_LEAF, point);
                if found.distance_squared < best.distance_squared {
                    best = found;
                }
                continue;
            }
            let Node { boxes, inside } = &self.nodes[inside as usize];
            let distances = boxes.distances_squared(point).to_array();
            push_nearest_last(&mut pending, distances, *inside, best.distance_squared);
        }
        Some(best)
    }

    /// Largest squared distance of points from the plane of a triangle; infinite for a degenerate triangle.
    pub(crate) fn height_squared(&self, found: NearestTriangle, points: [Vec3; 3]) -> f32 {
        let leaf = &self.leaves[found.leaf as usize];
        let slot = leaf.ids.iter().position(|&id| id == found.triangle);
        let [a, b, c] = leaf.triangles.corners(slot.unwrap_or(0));
        let normal = (b - a).cross(c - a);
        let heights = points.map(|point| normal.dot(point - a));
        let height_squared = heights.iter().fold(0.0f32, |most, h| most.max(h * h));
        let normal_squared = normal.length_squared();
        if normal_squared > 0.0 {
            height_squared / normal_squared
        } else {
            f32::INFINITY
        }
    }

    /// Upper bound of the squared distance for all points between `corners`. The distance to a triangle is convex, so
    /// its maximum is at a corner. All triangles of the leaf are tried.
    pub(crate) fn bound_squared(&self, found: NearestTriangle, corners: [Vec3; 3]) -> f32 {
        let triangles = &self.leaves[found.leaf as usize].triangles;
        let [a, b, c] = corners.map(|corner| triangles.distances_squared(corner));
        a.max(b).max(c).min_element()
    }

    /// Whether no triangle within `distance` of `point` satisfies `wanted`, which gets its index and corners.
    pub(crate) fn none_within(
        &self,
        point: Vec3,
        distance: f32,
        mut wanted: impl FnMut(u32, [Vec3; 3]) -> bool,
    ) -> bool {
        let enough = distance * distance;
        let mut pending: Vec<u32> = vec![0; usize::from(!self.leaves.is_empty())];
        while let Some(inside) = pending.pop() {
            if inside & IS_LEAF == 0 {
                let Node {
                    boxes,
                    inside: children,
                } = &self.nodes[inside as usize];
                let distances = boxes.distances_squared(point);
                // Empty slots have infinite distances.
                let near = (0..4).filter(|&k| distances[k] <= enough.min(f32::MAX));
                pending.extend(near.map(|k| children[k]));
                continue;
            }
            let leaf = &self.leaves[(inside & !IS_LEAF) as usize];
            let distances = leaf.triangles.distances_squared(point).to_array();
            let mut is_wanted = |k: usize| wanted(leaf.ids[k], leaf.triangles.corners(k));
            if (0..4).any(|k| distances[k] <= enough && is_wanted(k)) {
                return false;
            }
        }
        true
    }

    fn nearest_in(&self, leaf: u32, point: Vec3) -> NearestTriangle {
        let Leaf { triangles, ids } = &self.leaves[leaf as usize];
        let distances = triangles.distances_squared(point);
        let nearest = distances.min_position();
        NearestTriangle {
            triangle: ids[nearest],
            distance_squared: distances[nearest],
            leaf,
        }
    }
}

/// Squared distance of a box, and its child.
type Pending = (f32, u32);

/// Pushes children that are nearer than `limit`, the nearest last.
fn push_nearest_last(
    pending: &mut Vec<Pending>,
    distances: [f32; 4],
    inside: [u32; 4],
    limit: f32,
) {
    let mut nearest: Option<Pending> = None;
    let near = distances.into_iter().zip(inside);
    for next in near.filter(|&(distance, _)| distance < limit) {
        if nearest.is_some_and(|nearest| nearest.0 <= next.0) {
            pending.push(next);
        } else {
            pending.extend(nearest.replace(next));
        }
    }
    pending.extend(nearest);
}

/// Collapses a binary tree over `boxes` into nodes of four boxes.
fn nodes_over(boxes: &[Aabb]) -> Vec<Node> {
    let tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Minimum,
        boxes,
        (0..boxes.len() as u32).collect(),
        SortPrecision::U64,
        0,
    );
    let mut nodes = Vec::with_capacity(boxes.len() / 2 + 1);
    if !boxes.is_empty() {
        let mut pending = vec![(0usize, None)];
        while let Some((of_two, slot)) = pending.pop() {
            let node = nodes.len();
            let inside = inside_of(&tree, of_two);
            let boxes = inside.iter().map(|&index| &tree.nodes[index]);
            let mut made = Node {
                boxes: Boxes4::of(boxes.map(|node| {
                    // `obvhs` uses another version of glam.
                    let aabb = node.aabb();
                    [aabb.min.to_array(), aabb.max.to_array()].map(Vec3::from_array)
                })),
                inside: [0; 4],
            };
            for (k, &index) in inside.iter().enumerate() {
                let child = &tree.nodes[index];
                if child.is_leaf() {
                    made.inside[k] = tree.primitive_indices[child.first_index as usize] | IS_LEAF;
                } else {
                    pending.push((index, Some((node, k))));
                }
            }
            nodes.push(made);
            if let Some((parent, k)) = slot {
                let parent: &mut Node = &mut nodes[parent];
                parent.inside[k] = node as u32;
            }
        }
    }
    nodes
}

/// Grandchildren of a binary node, or its children if these are leaves; the node itself if it is a leaf.
fn inside_of(tree: &Bvh2, node: usize) -> Vec<usize> {
    let both = |node: usize| {
        let first = tree.nodes[node].first_index as usize;
        [first, first + 1]
    };
    if tree.nodes[node].is_leaf() {
        return vec![node];
    }
    let inside = both(node).into_iter().flat_map(|child| {
        let is_leaf = tree.nodes[child].is_leaf();
        if is_leaf {
            vec![child]
        } else {
            both(child).to_vec()
        }
    });
    inside.collect()
}

fn aabb_of(points: impl Iterator<Item = Vec3>) -> Aabb {
    let aabb = fieldlod_hierarchy::Aabb::around(points).unwrap_or_default();
    Aabb {
        min: aabb.min.to_array().into(),
        max: aabb.max.to_array().into(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::triangle_tree::triangle::exact_distance;

    /// Random points, some on a coarse lattice: corners, edges and planes then coincide.
    fn any_point() -> impl Strategy<Value = Vec3> {
        let fine = prop::array::uniform3(-1.0f32..1.0).prop_map(Vec3::from);
        let coarse = prop::array::uniform3(-2i8..=2);
        let coarse = coarse.prop_map(|p| Vec3::from(p.map(|x| f32::from(x) * 0.5)));
        prop_oneof![fine, coarse]
    }

    fn any_triangle() -> impl Strategy<Value = [Vec3; 3]> {
        let triangle = || prop::array::uniform3(any_point());
        let needle = triangle().prop_map(|[a, b, c]| [a, b, b + c * 1e-3]);
        prop_oneof![triangle(), needle]
    }

    /// Triangles, or needles with a common tip.
    fn any_soup() -> impl Strategy<Value = Vec<[Vec3; 3]>> {
        let points = prop::collection::vec(any_point(), 1..80);
        let fan = (points, any::<bool>()).prop_map(|(points, is_flat)| {
            let beside = |p: Vec3| {
                if is_flat {
                    p.cross(Vec3::Y)
                } else {
                    p.any_orthogonal_vector()
                }
            };
            let flat = |p: Vec3| if is_flat { p.with_y(0.0) } else { p };
            let needle = |p: Vec3| [Vec3::ZERO, p, p + beside(p) * 1e-3];
            points.into_iter().map(flat).map(needle).collect()
        });
        prop_oneof![prop::collection::vec(any_triangle(), 1..80), fan]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// Compares with a search over all triangles in double precision.
        #[test]
        fn nearest_triangle_matches_plain_search(
            soup in any_soup(),
            points in prop::collection::vec(any_point(), 1..30),
        ) {
            let tree = TriangleTree::new(soup.iter().copied());
            let mut start = None;
            for point in points {
                let exact = |triangle: [Vec3; 3]| {
                    exact_distance(point.as_dvec3(), triangle.map(Vec3::as_dvec3))
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

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]

        /// Compares a refitted tree with a new tree over the moved triangles.
        #[test]
        fn refitted_tree_matches_a_new_one(
            (soup, moved) in (1usize..80).prop_flat_map(|count| {
                let triangles = || prop::collection::vec(prop::array::uniform3(any_point()), count);
                (triangles(), triangles())
            }),
            points in prop::collection::vec(any_point(), 1..30),
        ) {
            let mut refitted = TriangleTree::new(soup.iter().copied());
            // The tree keeps one of several equal triangles, so copies must not move apart.
            prop_assume!((0..soup.len()).all(|k| !soup[..k].contains(&soup[k])));
            refitted.refit(|id| moved[id as usize]);
            let new = TriangleTree::new(moved.iter().copied());
            for point in points {
                let [a, b] = [&refitted, &new].map(|tree| tree.nearest(point).unwrap());
                let distance = |found: NearestTriangle| found.distance_squared.sqrt();
                prop_assert!((distance(a) - distance(b)).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn degenerate_triangles_have_distances() {
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
