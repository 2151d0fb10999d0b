//! How far a point is from a triangle.

use glam::{Vec3, Vec3A};

/// A triangle as a corner and the two edges from it.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Triangle {
    a: Vec3A,
    ab: Vec3A,
    ac: Vec3A,
}

impl Triangle {
    pub(crate) fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners.map(Vec3A::from);
        Self::between(a, b, c)
    }

    pub(crate) fn between(a: Vec3A, b: Vec3A, c: Vec3A) -> Self {
        let (ab, ac) = (b - a, c - a);
        Self { a, ab, ac }
    }

    fn corners(&self) -> [Vec3A; 3] {
        [self.a, self.a + self.ab, self.a + self.ac]
    }

    /// The point of the triangle that is nearest to `point`.
    pub(crate) fn nearest_point(&self, point: Vec3A) -> Vec3A {
        let [a, b, c] = self.corners();
        let normal = self.ab.cross(self.ac);
        let normal_squared = normal.length_squared();
        // Below a point that stands above the triangle. The normal of a needle is noise.
        if normal_squared > 1e-9 * self.ab.length_squared() * self.ac.length_squared() {
            let foot = point - normal * (normal.dot(point - a) / normal_squared);
            let inside = |p: Vec3A, q: Vec3A| normal.dot((q - p).cross(foot - p)) >= 0.0;
            if inside(a, b) && inside(b, c) && inside(c, a) {
                return foot;
            }
        }
        // Or else on the nearest edge.
        let nearer = |best: Vec3A, other: Vec3A| {
            let is_nearer = other.distance_squared(point) < best.distance_squared(point);
            if is_nearer { other } else { best }
        };
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| nearest_on_edge(p, q, point));
        nearer(nearer(ab, bc), ca)
    }
}

fn nearest_on_edge(p: Vec3A, q: Vec3A, point: Vec3A) -> Vec3A {
    let along = q - p;
    p + along * share((point - p).dot(along), along.length_squared()).clamp(0.0, 1.0)
}

/// `part / whole`, and 0 of nothing.
fn share(part: f32, whole: f32) -> f32 {
    if whole > 0.0 { part / whole } else { 0.0 }
}
