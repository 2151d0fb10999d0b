//! A bounding-volume hierarchy, built by obvhs, over short runs of triangles.
//!
//! Triangles come in the order of clusters, where neighbours follow each other: boxes around a few
//! at a time are hardly larger than boxes around each, and the tree is a fraction of the size.

use std::ops::Range;

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Triangles in a run.
const RUN: u32 = 4;
/// What a search may put off before it has to allocate.
const PENDING: usize = 64;

/// Some triangle and how far it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub(crate) distance_squared: f32,
    pub(crate) triangle: u32,
}

/// Boxes around runs of triangles that are kept elsewhere.
pub(crate) struct RunTree {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy)]
struct Node {
    min: [f32; 3],
    /// The first of two children, or the first triangle of a run.
    first: u32,
    max: [f32; 3],
    /// Triangles of the run; 0 for a node with children.
    count: u32,
}

impl Node {
    fn distance_squared(&self, point: Vec3A) -> f32 {
        let (min, max) = (Vec3A::from_array(self.min), Vec3A::from_array(self.max));
        let outside = (min - point).max(point - max).max(Vec3A::ZERO);
        outside.length_squared()
    }
}

/// What is looked at later, if it is still near enough then.
#[derive(Clone, Copy, Default)]
struct Pending {
    distance_squared: f32,
    node: u32,
}

/// A stack that allocates only where a tree is uncommonly deep.
struct Stack {
    few: [Pending; PENDING],
    count: usize,
    more: Vec<Pending>,
}

impl Stack {
    fn push(&mut self, pending: Pending) {
        if self.count < PENDING {
            self.few[self.count] = pending;
            self.count += 1;
        } else {
            self.more.push(pending);
        }
    }

    fn pop(&mut self) -> Option<Pending> {
        if let Some(pending) = self.more.pop() {
            return Some(pending);
        }
        self.count = self.count.checked_sub(1)?;
        Some(self.few[self.count])
    }
}

impl RunTree {
    /// Around triangles that are given by their corners, which must be finite.
    pub(crate) fn of(triangle_count: usize, corners: impl Fn(u32) -> [Vec3A; 3]) -> Self {
        let triangle_count = triangle_count as u32;
        let around = |first: u32| {
            let run = (first..triangle_count.min(first + RUN)).flat_map(&corners);
            let (min, max) = run.fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(min, max), p| {
                (min.min(p), max.max(p))
            });
            Aabb {
                min: min.to_array().into(),
                max: max.to_array().into(),
            }
        };
        let (mut boxes, mut runs): (Vec<Aabb>, Vec<Range<u32>>) = (Vec::new(), Vec::new());
        for first in (0..triangle_count).step_by(RUN as usize) {
            let (run, bounds) = (first..triangle_count.min(first + RUN), around(first));
            match runs.last_mut() {
                // A hundred thousand copies of one would take the builder the square of that.
                Some(last) if boxes.last() == Some(&bounds) => last.end = run.end,
                _ => {
                    boxes.push(bounds);
                    runs.push(run);
                }
            }
        }
        let tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Minimum,
            &boxes,
            (0..boxes.len() as u32).collect(),
            SortPrecision::U64,
            0,
        );
        Self {
            nodes: nodes_of(&tree, &runs),
        }
    }

    /// A triangle at most `enough` (squared) away, or else the nearest, if it is nearer than
    /// `best`. `distance_squared` measures a triangle.
    pub(crate) fn nearest(
        &self,
        point: Vec3A,
        enough: f32,
        mut best: Hit,
        distance_squared: impl Fn(u32) -> f32,
    ) -> Hit {
        let mut pending = Stack {
            few: [Pending::default(); PENDING],
            count: 0,
            more: Vec::new(),
        };
        let mut next = (!self.nodes.is_empty()).then_some(0);
        while let Some(index) = next {
            let node = &self.nodes[index as usize];
            next = if node.count > 0 {
                for triangle in node.first..node.first + node.count {
                    let distance_squared = distance_squared(triangle);
                    if distance_squared < best.distance_squared {
                        best = Hit {
                            distance_squared,
                            triangle,
                        };
                    }
                }
                if best.distance_squared <= enough {
                    return best;
                }
                None
            } else {
                self.descend(node.first, point, best, &mut pending)
            };
            while next.is_none()
                && let Some(later) = pending.pop()
            {
                next = (later.distance_squared < best.distance_squared).then_some(later.node);
            }
        }
        best
    }

    /// The nearer of two nodes if it is near enough, leaving the other for later.
    fn descend(&self, first: u32, point: Vec3A, best: Hit, pending: &mut Stack) -> Option<u32> {
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
}

fn nodes_of(tree: &Bvh2, runs: &[Range<u32>]) -> Vec<Node> {
    let node = |node: &obvhs::bvh2::node::Bvh2Node| {
        let run = match node.prim_count {
            0 => node.first_index..node.first_index,
            _ => runs[tree.primitive_indices[node.first_index as usize] as usize].clone(),
        };
        Node {
            min: node.aabb().min.to_array(),
            first: run.start,
            max: node.aabb().max.to_array(),
            count: run.end - run.start,
        }
    };
    tree.nodes.iter().map(node).collect()
}
