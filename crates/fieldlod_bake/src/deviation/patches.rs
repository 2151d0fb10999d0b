//! Source triangles, followed over a simplified surface.

use glam::Vec3A;

use super::Ruler;
use super::faces::{Face, FaceWalk};
use crate::nearest::{Crossing, Hit, TriangleTree};
use crate::patch::Patch;

/// A source triangle whose corners are all nearer than this share of the largest distance so far
/// does not count as beside the simplified surface.
const LEAST_BESIDE: f32 = 0.5;
/// Rows of samples on a source triangle that lies beside the simplified surface.
const ROWS_BESIDE: u32 = 2;

/// Goes over source triangles and asks how far they are from a simplified surface.
pub(super) struct PatchWalk<'a> {
    pub(super) ruler: &'a Ruler<'a>,
    pub(super) simplified: &'a TriangleTree,
    /// The largest squared distance so far.
    pub(super) furthest: f32,
}

impl PatchWalk<'_> {
    fn distance(&mut self, point: Vec3A, guess: u32) -> Hit {
        let hit = self.simplified.nearest(point, self.furthest, guess);
        let hit = hit.unwrap_or(Hit {
            distance_squared: 0.0,
            slot: 0,
        });
        self.furthest = self.furthest.max(hit.distance_squared);
        hit
    }

    /// For each vertex a simplified triangle: the nearest, or one that is near enough.
    pub(super) fn vertices(&mut self, patch: &Patch) -> Vec<Hit> {
        let mut guess = 0;
        let vertices = patch.vertices.iter().map(|&vertex| {
            let hit = self.distance(self.ruler.position(vertex), guess);
            guess = hit.slot;
            hit
        });
        vertices.collect()
    }

    /// Each edge within the patch is walked once in each direction.
    pub(super) fn crossings(&mut self, patch: &Patch, nearest: &[Hit]) {
        for triangle in &patch.triangles {
            let slots = triangle.map(|corner| nearest[usize::from(corner)].slot);
            if slots[0] == slots[1] && slots[1] == slots[2] {
                continue;
            }
            let vertices = triangle.map(|corner| patch.vertices[usize::from(corner)]);
            let corners = vertices.map(|vertex| self.ruler.position(vertex));
            let mut beside = false;
            for from in 0..3 {
                let to = (from + 1) % 3;
                if slots[from] != slots[to] {
                    beside |= self.crossing([corners[from], corners[to]], slots[from]);
                }
            }
            let distances = triangle.map(|corner| nearest[usize::from(corner)].distance_squared);
            if beside && self.may_exceed(corners, distances) {
                self.sample_inside(corners, slots[0]);
            }
        }
    }

    /// Where the edges of both surfaces cross, one above the other, each may be furthest from the
    /// other. Returns whether the way starts beside the simplified triangle and not above it.
    fn crossing(&mut self, [from, to]: [Vec3A; 2], slot: u32) -> bool {
        let (above, below) = match self.simplified.triangle(slot).crossing(from, to) {
            Crossing::StartsOutside => return true,
            Crossing::EndsInside => return false,
            Crossing::At { above, below } => (above, below),
        };
        if above.distance_squared(below) > self.furthest {
            self.distance(above, slot);
            if let Some(hit) = self.ruler.source.nearest(below, self.furthest, 0) {
                self.furthest = self.furthest.max(hit.distance_squared);
            }
        }
        false
    }

    /// No place of a triangle is further from the nearest corner than 0.58 of the longest edge.
    fn may_exceed(&self, [a, b, c]: [Vec3A; 3], distances: [f32; 3]) -> bool {
        let edges = [
            a.distance_squared(b),
            b.distance_squared(c),
            c.distance_squared(a),
        ];
        let reach = edges.into_iter().fold(0.0, f32::max).sqrt() * 0.58;
        let corner = distances.into_iter().fold(0.0, f32::max).sqrt();
        let furthest = self.furthest.sqrt();
        corner > furthest * LEAST_BESIDE && corner + reach > furthest
    }

    /// Beside the simplified surface, such as where a component of the source has vanished, a
    /// place within a triangle may be further than its corners and edges.
    fn sample_inside(&mut self, corners: [Vec3A; 3], guess: u32) {
        let (surface, furthest) = (self.simplified, self.furthest);
        let mut walk = FaceWalk {
            surface,
            furthest,
            guess,
        };
        walk.sample(&Face { corners, sides: 7 }, ROWS_BESIDE);
        self.furthest = walk.furthest;
    }
}
