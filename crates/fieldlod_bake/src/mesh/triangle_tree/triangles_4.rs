//! SIMD distances to four triangles or four boxes, with one vector per coordinate.

use glam::{Vec3, Vec4};

/// Four vectors.
#[derive(Clone, Copy)]
struct Vec3x4 {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

impl Vec3x4 {
    fn of(vectors: [Vec3; 4]) -> Self {
        Self {
            x: Vec4::from_array(vectors.map(|v| v.x)),
            y: Vec4::from_array(vectors.map(|v| v.y)),
            z: Vec4::from_array(vectors.map(|v| v.z)),
        }
    }

    fn get(self, k: usize) -> Vec3 {
        Vec3::new(self.x[k], self.y[k], self.z[k])
    }

    #[inline(always)]
    fn minus(self, o: Self) -> Self {
        Self {
            x: self.x - o.x,
            y: self.y - o.y,
            z: self.z - o.z,
        }
    }

    #[inline(always)]
    fn times(self, s: Vec4) -> Self {
        Self {
            x: self.x * s,
            y: self.y * s,
            z: self.z * s,
        }
    }

    #[inline(always)]
    fn dot(self, o: Self) -> Vec4 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    fn cross(self, o: Self) -> Self {
        Self {
            x: self.y * o.z - self.z * o.y,
            y: self.z * o.x - self.x * o.z,
            z: self.x * o.y - self.y * o.x,
        }
    }

    #[inline(always)]
    fn splat(v: Vec3) -> Self {
        Self {
            x: Vec4::splat(v.x),
            y: Vec4::splat(v.y),
            z: Vec4::splat(v.z),
        }
    }
}

/// Four triangles: a corner of each, and two edges.
pub(crate) struct Triangles4 {
    a: Vec3x4,
    ab: Vec3x4,
    ac: Vec3x4,
}

impl Triangles4 {
    pub(crate) fn of(corners: [[Vec3; 3]; 4]) -> Self {
        Self {
            a: Vec3x4::of(corners.map(|[a, _, _]| a)),
            ab: Vec3x4::of(corners.map(|[a, b, _]| b - a)),
            ac: Vec3x4::of(corners.map(|[a, _, c]| c - a)),
        }
    }

    /// Corners of triangle `k`.
    pub(crate) fn corners(&self, k: usize) -> [Vec3; 3] {
        let [a, ab, ac] = [self.a, self.ab, self.ac].map(|v| v.get(k));
        [a, a + ab, a + ac]
    }

    /// Squared distances from a point: to the plane if the projection is inside, otherwise to the nearest edge.
    #[inline]
    pub(crate) fn distances_squared(&self, point: Vec3) -> Vec4 {
        let (ab, ac) = (self.ab, self.ac);
        let bc = ac.minus(ab);
        let ap = Vec3x4::splat(point).minus(self.a);
        let bp = ap.minus(ab);
        // Distances to the edges.
        let to_ab = to_edge(ap, ab);
        let to_ac = to_edge(ap, ac);
        let to_bc = to_edge(bp, bc);
        let to_edges = to_ab.min(to_ac).min(to_bc);
        // Distances to the planes.
        let normal = ab.cross(ac);
        let normal_squared = normal.dot(normal);
        let height = normal.dot(ap);
        let to_plane = height * height / normal_squared;
        let inside = normal.dot(ab.cross(ap)).cmpge(Vec4::ZERO)
            & normal.dot(bc.cross(bp)).cmpge(Vec4::ZERO)
            & normal.dot(ap.cross(ac)).cmpge(Vec4::ZERO);
        // The normal of a very thin triangle is noise, which could make its distance too short.
        let is_flat = normal_squared.cmpgt(ab.dot(ab) * ac.dot(ac) * 1e-9);
        Vec4::select(inside & is_flat, to_plane, to_edges)
    }
}

/// Squared distances from points to edges that start at the origin.
#[inline(always)]
fn to_edge(point: Vec3x4, edge: Vec3x4) -> Vec4 {
    let length_squared = edge.dot(edge).max(Vec4::splat(f32::MIN_POSITIVE));
    let along = point.dot(edge) / length_squared;
    let along = along.max(Vec4::ZERO).min(Vec4::ONE);
    let off = point.minus(edge.times(along));
    off.dot(off)
}

/// Up to four boxes.
pub(crate) struct Boxes4 {
    min: Vec3x4,
    max: Vec3x4,
}

impl Boxes4 {
    /// Boxes by their minimum and maximum. Empty slots are at infinite distance.
    pub(crate) fn of(boxes: impl Iterator<Item = [Vec3; 2]>) -> Self {
        let (mut min, mut max) = ([Vec3::INFINITY; 4], [Vec3::INFINITY; 4]);
        for (k, [from, to]) in boxes.take(4).enumerate() {
            (min[k], max[k]) = (from, to);
        }
        Self {
            min: Vec3x4::of(min),
            max: Vec3x4::of(max),
        }
    }

    /// The number of boxes.
    pub(crate) fn count(&self) -> usize {
        (0..4).filter(|&k| self.min.x[k].is_finite()).count()
    }

    /// Squared distances from a point; 0 inside.
    #[inline]
    pub(crate) fn distances_squared(&self, point: Vec3) -> Vec4 {
        let points = Vec3x4::splat(point);
        let outside = |min: Vec4, max: Vec4, p: Vec4| (min - p).max(p - max).max(Vec4::ZERO);
        let x = outside(self.min.x, self.max.x, points.x);
        let y = outside(self.min.y, self.max.y, points.y);
        let z = outside(self.min.z, self.max.z, points.z);
        x * x + y * y + z * z
    }
}
