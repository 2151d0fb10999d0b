//! The prism that stands on a triangle: where a point lies in it, for the price of four products.

use glam::{Vec3A, Vec4};

/// A triangle's plane and the three planes that stand on its edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prism {
    /// The first corner, and how far the second edge is from it: infinite for a triangle without a
    /// plane.
    origin: Vec4,
    /// Rows: the unit normal, and the inward normals of the edges from each corner to the next.
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

/// Where a point lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// From the triangle where the point stands above it, or else from its first corner.
    pub(super) distance_squared: f32,
    /// The edge that the point is furthest outside of, if any.
    pub(super) outside: Option<usize>,
}

/// How a way goes over the prism that stands on a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Crossing {
    StartsOutside,
    EndsInside,
    /// It leaves the prism at `above`; `below` is on the triangle's edge.
    At {
        above: Vec3A,
        below: Vec3A,
    },
}

impl Prism {
    pub(super) fn on([a, b, c]: [Vec3A; 3]) -> Self {
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let normal_squared = normal.length_squared();
        // The normal of a needle is noise.
        let is_flat = normal_squared <= 1e-9 * ab.length_squared() * ac.length_squared();
        let unit = normal * normal_squared.sqrt().recip();
        let inward = [unit.cross(ab), unit.cross(ac - ab), ac.cross(unit)];
        let row = |k: usize| Vec4::new(unit[k], inward[0][k], inward[1][k], inward[2][k]);
        if is_flat {
            return Self {
                origin: a.extend(f32::INFINITY),
                x: Vec4::ZERO,
                y: Vec4::ZERO,
                z: Vec4::ZERO,
            };
        }
        Self {
            origin: a.extend(inward[1].dot(ab)),
            x: row(0),
            y: row(1),
            z: row(2),
        }
    }

    fn at(&self, p: Vec3A) -> Vec4 {
        let mut place = self.x * p.x + self.y * p.y + self.z * p.z;
        place.z -= self.origin.w;
        place
    }

    /// How far the point lies above the plane, as a square; infinite without a plane.
    pub(super) fn height_squared(&self, point: Vec3A) -> f32 {
        let p = point - Vec3A::from_vec4(self.origin);
        let height = self.x.x * p.x + self.y.x * p.y + self.z.x * p.z;
        if self.origin.w == f32::INFINITY {
            f32::INFINITY
        } else {
            height * height
        }
    }

    pub(super) fn place(&self, point: Vec3A) -> Place {
        let p = point - Vec3A::from_vec4(self.origin);
        let [height, edges @ ..] = self.at(p).to_array();
        let mut edge = 0;
        for other in 1..3 {
            if edges[other] < edges[edge] {
                edge = other;
            }
        }
        let outside = edges[edge] < 0.0;
        Place {
            distance_squared: if outside {
                p.length_squared()
            } else {
                height * height
            },
            outside: outside.then_some(edge),
        }
    }

    /// Where the way from `from` to `to` leaves the prism, and the point of the triangle's edge
    /// below (or above). All starts outside of a triangle without a plane.
    pub(super) fn crossing(&self, [from, to]: [Vec3A; 2]) -> Crossing {
        let origin = Vec3A::from_vec4(self.origin);
        let [_, before @ ..] = self.at(from - origin).to_array();
        let [_, after @ ..] = self.at(to - origin).to_array();
        let mut exit = f32::INFINITY;
        for (before, after) in before.into_iter().zip(after) {
            if before < 0.0 {
                return Crossing::StartsOutside;
            }
            if after < 0.0 {
                exit = exit.min(before / (before - after));
            }
        }
        if exit == f32::INFINITY {
            return Crossing::EndsInside;
        }
        let above = from.lerp(to, exit);
        let normal = Vec3A::new(self.x.x, self.y.x, self.z.x);
        let below = above - normal * normal.dot(above - origin);
        Crossing::At { above, below }
    }
}
