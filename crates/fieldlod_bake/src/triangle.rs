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

    pub(crate) fn corners(&self) -> [Vec3A; 3] {
        [self.a, self.a + self.ab, self.a + self.ac]
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
        // Where b is at the same place as a, the edge to c is looked at instead.
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
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

    /// The point of the triangle that is nearest to `point`.
    pub(crate) fn nearest_point(&self, point: Vec3A) -> Vec3A {
        let [a, b, c] = self.corners();
        let normal = self.ab.cross(self.ac);
        let normal_squared = normal.length_squared();
        // Below a point that stands above the triangle.
        if normal_squared > 0.0 {
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
