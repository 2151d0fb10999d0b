//! Distances between points and triangles.

use glam::{DVec3, Vec3, Vec3A};

/// A triangle as a corner and two edges.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Triangle {
    a: Vec3A,
    ab: Vec3A,
    ac: Vec3A,
}

impl Triangle {
    pub(crate) fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners.map(Vec3A::from);
        let (ab, ac) = (b - a, c - a);
        Self { a, ab, ac }
    }

    fn corners(&self) -> [Vec3A; 3] {
        [self.a, self.a + self.ab, self.a + self.ac]
    }

    /// Nearest point of the triangle.
    pub(crate) fn nearest_point(&self, point: Vec3A) -> Vec3A {
        let [a, b, c] = self.corners();
        let normal = self.ab.cross(self.ac);
        let normal_squared = normal.length_squared();
        // The projection onto the plane, if it is inside. Very thin triangles are skipped, because their normal is
        // noise.
        if normal_squared > 1e-9 * self.ab.length_squared() * self.ac.length_squared() {
            let foot = point - normal * (normal.dot(point - a) / normal_squared);
            let inside = |p: Vec3A, q: Vec3A| normal.dot((q - p).cross(foot - p)) >= 0.0;
            if inside(a, b) && inside(b, c) && inside(c, a) {
                return foot;
            }
        }
        // Otherwise the nearest point of an edge.
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

/// `part / whole`, or 0 if `whole` is 0.
fn share(part: f32, whole: f32) -> f32 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

/// Distance between a point and a triangle in double precision: to the plane if the projection is inside, otherwise to
/// the nearest edge.
pub(crate) fn exact_distance(place: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let is_inside = |from: DVec3, to: DVec3| normal.cross(to - from).dot(place - from) >= 0.0;
    if normal != DVec3::ZERO && is_inside(a, b) && is_inside(b, c) && is_inside(c, a) {
        return (place - a).dot(normal.normalize()).abs();
    }
    let edges = [(a, b), (b, c), (c, a)];
    let distances = edges.map(|(from, to)| distance_to_edge(place, from, to));
    distances.into_iter().fold(f64::INFINITY, f64::min)
}

fn distance_to_edge(place: DVec3, from: DVec3, to: DVec3) -> f64 {
    let edge = to - from;
    let along = (place - from).dot(edge) / edge.length_squared();
    // NaN for an edge without length.
    let along = if along > 0.0 { along.min(1.0) } else { 0.0 };
    place.distance(from + edge * along)
}
