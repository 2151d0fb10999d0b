//! Source triangles that stand above several simplified ones.

use glam::Vec3A;
use rayon::prelude::*;

use super::Ruler;
use super::faces::{FaceWalk, Rows};
use super::furthest::Furthest;
use super::output::Output;
use super::places::Seats;
use crate::patch::Patch;
use crate::surface::{Crossing, NONE};

/// Source triangles that are gone over together.
const TRIANGLES_PER_TASK: usize = 4096;
/// A source triangle whose corners are all nearer than this share of the largest distance so far
/// does not count as beside the simplified surface.
const LEAST_BESIDE: f32 = 0.5;
/// Rows of samples on a source triangle that lies beside the simplified surface.
const ROWS_BESIDE: u32 = 2;
/// Beyond so many source triangles for each simplified one, they share hardly an edge.
const FINE: usize = 64;
/// How far from a corner towards the middle of a triangle it counts as above what is below there.
const INWARD: f32 = 0.25;

/// The largest squared distance of the source triangles in `patch` from the simplified surface and
/// the other way round, or `furthest`.
pub(super) fn furthest_crossing(
    ruler: &Ruler<'_>,
    output: &Output<'_>,
    seats: &Seats,
    patch: &Patch,
    furthest: f32,
) -> f32 {
    let is_fine = patch.inside.len() + patch.across.len() < output.surface.corners().len() * FINE;
    let walk = |triangles: &[u32]| {
        let mut walk = CrossingWalk {
            source: Furthest::from(&ruler.source, furthest),
            simplified: Furthest::from(&output.surface, furthest),
            output,
            seats,
            is_rim: &ruler.is_rim,
            is_fine,
        };
        for &triangle in triangles {
            walk.triangle(triangle);
        }
        (walk.source, walk.simplified)
    };
    let lists = [&patch.inside, &patch.across];
    let tasks = lists
        .into_par_iter()
        .flat_map(|list| list.par_chunks(TRIANGLES_PER_TASK));
    let (from_source, from_simplified): (Vec<_>, Vec<_>) = tasks.map(walk).unzip();
    let mut to_simplified = Furthest::from(&output.surface, furthest);
    to_simplified.join(from_simplified);
    let mut to_source = Furthest::from(&ruler.source, to_simplified.settle());
    to_source.join(from_source);
    to_source.settle()
}

struct CrossingWalk<'a> {
    /// From simplified places to the source.
    source: Furthest<'a>,
    /// From source places to the simplified surface.
    simplified: Furthest<'a>,
    output: &'a Output<'a>,
    seats: &'a Seats,
    /// For each triangle of the source, whether it has an open edge.
    is_rim: &'a [bool],
    /// Whether edges of the source may be among those of the simplified surface.
    is_fine: bool,
}

impl CrossingWalk<'_> {
    /// The largest squared distance so far.
    fn furthest(&self) -> f32 {
        self.source.squared.max(self.simplified.squared)
    }

    fn triangle(&mut self, triangle: u32) {
        let vertices = self.source.surface.corners()[triangle as usize];
        let mut seats = vertices.map(|vertex| self.seats[vertex as usize]);
        if self.is_rim[triangle as usize] {
            self.mark_rim(seats);
        }
        self.settle(vertices, &mut seats);
        if seats[0] == seats[1] && seats[1] == seats[2] {
            if seats[0] != NONE && self.is_fine {
                self.output.share_edge(seats[0], vertices);
            }
            return;
        }
        let corners = vertices.map(|vertex| self.source.surface.position(vertex));
        self.output.cross(corners, seats);
        if self.is_fine {
            for seat in seats.into_iter().filter(|&seat| seat != NONE) {
                self.output.share_edge(seat, vertices);
            }
        }
        if !self.is_near(corners, seats) {
            self.measure(triangle, corners, seats);
        }
    }

    fn mark_rim(&self, seats: [u32; 3]) {
        for seat in seats.into_iter().filter(|&seat| seat != NONE) {
            self.output.mark_rim(seat);
        }
    }

    /// Whether no corner is further from the plane of any of these simplified triangles than the
    /// furthest so far. Then nothing between them is, where the triangle stands above those.
    fn is_near(&self, corners: [Vec3A; 3], seats: [u32; 3]) -> bool {
        let furthest = self.furthest();
        let mut is_near = true;
        for from in 0..3 {
            let [next, last] = [(from + 1) % 3, (from + 2) % 3];
            let seat = seats[from];
            // What two corners stand above is looked at from the first of them.
            if seat == NONE
                || seat == seats[last] && last < from
                || seat == seats[next] && next < from
            {
                continue;
            }
            let others = [next, last].into_iter().filter(|&to| seats[to] != seat);
            let height = |to: usize| self.simplified.surface.height_squared(seat, corners[to]);
            let height = others.map(height).fold(0.0, f32::max);
            self.output.mark_tall(seat, height, furthest);
            is_near &= height <= furthest;
        }
        is_near
    }

    /// A corner that the simplified surface has too stands above all triangles around it: takes
    /// that of another corner if that is among them, or else the one on the side of this source
    /// triangle.
    fn settle(&self, vertices: [u32; 3], seats: &mut [u32; 3]) {
        if seats[0] == seats[1] && seats[1] == seats[2] {
            return;
        }
        let mut is_kept =
            [0, 1, 2].map(|k| seats[k] != NONE && self.has_corner(seats[k], vertices[k]));
        for k in 0..3 {
            if !is_kept[k] {
                continue;
            }
            let others = [(k + 1) % 3, (k + 2) % 3].into_iter();
            let mut others = others.filter(|&other| !is_kept[other] && seats[other] != NONE);
            let shared = others.find(|&other| self.has_corner(seats[other], vertices[k]));
            seats[k] = match shared {
                Some(other) => seats[other],
                None => self.inward_of(k, vertices, seats[k]),
            };
            is_kept[k] = false;
        }
    }

    fn has_corner(&self, triangle: u32, vertex: u32) -> bool {
        self.simplified.surface.corners()[triangle as usize].contains(&vertex)
    }

    /// The simplified triangle below a place within the source triangle, near corner `k`.
    fn inward_of(&self, k: usize, vertices: [u32; 3], guess: u32) -> u32 {
        let corners = vertices.map(|vertex| self.source.surface.position(vertex));
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let inward = corners[k].lerp(middle, INWARD);
        self.simplified.surface.walk(inward, 0.0, guess).0.triangle
    }

    /// Each edge within the patch is walked once in each direction.
    fn measure(&mut self, triangle: u32, corners: [Vec3A; 3], seats: [u32; 3]) {
        let mut beside = false;
        for from in 0..3 {
            let to = (from + 1) % 3;
            if seats[from] != seats[to] && seats[from] != NONE {
                let way = [corners[from], corners[to]];
                beside |= self.crossing(way, seats[from], triangle);
            }
        }
        if beside && !seats.contains(&NONE) && self.may_exceed(corners, seats) {
            self.sample_inside(corners, seats[0]);
        }
    }

    /// Where the edges of both surfaces cross, one above the other, each may be furthest from the
    /// other. Returns whether the way starts beside the simplified triangle and not above it.
    fn crossing(&mut self, way: [Vec3A; 2], seat: u32, triangle: u32) -> bool {
        let (above, below) = match self.simplified.surface.crossing(seat, way) {
            Crossing::StartsOutside => return true,
            Crossing::EndsInside => return false,
            Crossing::At { above, below } => (above, below),
        };
        if above.distance_squared(below) > self.furthest() {
            self.simplified.see(above, seat, self.furthest());
            self.source.see(below, triangle, self.furthest());
        }
        false
    }

    /// No place of a triangle is further from the nearest corner than 0.58 of the longest edge.
    fn may_exceed(&self, [a, b, c]: [Vec3A; 3], seats: [u32; 3]) -> bool {
        let edges = [
            a.distance_squared(b),
            b.distance_squared(c),
            c.distance_squared(a),
        ];
        let reach = edges.into_iter().fold(0.0, f32::max).sqrt() * 0.58;
        let distance = |corner: Vec3A, seat: u32| {
            let triangle = self.simplified.surface.triangle(seat);
            triangle.distance_squared(corner)
        };
        let distances = [
            distance(a, seats[0]),
            distance(b, seats[1]),
            distance(c, seats[2]),
        ];
        let corner = distances.into_iter().fold(0.0, f32::max).sqrt();
        let furthest = self.furthest().sqrt();
        corner > furthest * LEAST_BESIDE && corner + reach > furthest
    }

    /// Beside the simplified surface, such as where a component of the source has vanished, a
    /// place within a triangle may be further than its corners and edges.
    fn sample_inside(&mut self, corners: [Vec3A; 3], guess: u32) {
        let mut walk = FaceWalk::over(self.simplified.surface, self.furthest());
        walk.guess = guess;
        let rows = Rows {
            inside: ROWS_BESIDE,
            sides: [ROWS_BESIDE + 1; 3],
        };
        walk.sample(corners, &rows);
        self.simplified.squared = walk.climb();
    }
}
