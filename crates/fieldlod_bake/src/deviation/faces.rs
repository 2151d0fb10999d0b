//! Triangles of one surface, sampled for their distance from the other.

use glam::{Vec2, Vec3A};

use crate::nearest::TriangleTree;

/// Samples on a simplified triangle per source vertex above as much area.
const SAMPLES_PER_VERTEX: f32 = 0.5;
/// A simplified triangle with less than this share of the source vertices that its area would
/// have on average may span a gap.
const GAP_SHARE: f32 = 0.5;
/// Least rows of samples on one simplified triangle: a single one may miss what lies beside its
/// middle.
const MIN_ROWS: f32 = 3.0;
/// Most rows of samples on one simplified triangle.
const MAX_ROWS: f32 = 24.0;
/// A sample this share of the largest distance so far is worth a climb: a summit may be near it.
const CLIMB_FROM: f32 = 0.7;
/// Where a climb to the furthest place of a triangle ends: with steps of this share of the first.
const SMALLEST_STEP: f32 = 0.03;

/// A triangle to be sampled.
pub(super) struct Face {
    pub(super) corners: [Vec3A; 3],
    /// Bit k is set if the edge from corner k to the next is sampled with this triangle and not
    /// with its neighbour.
    pub(super) sides: u8,
}

/// The triangles given, as source vertices welded by place; each edge is sampled with one of them.
pub(super) fn faces_of(welded: &[[u32; 3]], position: impl Fn(u32) -> Vec3A) -> Vec<Face> {
    let edges = EdgeSet::of(welded);
    let once = |from: u32, to: u32| from < to || !edges.contains(to, from);
    let face = |&[a, b, c]: &[u32; 3]| Face {
        corners: [a, b, c].map(&position),
        sides: u8::from(once(a, b)) | u8::from(once(b, c)) << 1 | u8::from(once(c, a)) << 2,
    };
    welded.iter().map(face).collect()
}

/// The directed edges of some triangles.
struct EdgeSet(Vec<u64>);

impl EdgeSet {
    fn of(triangles: &[[u32; 3]]) -> Self {
        let edges = triangles.len() * 3;
        let mut set = Self(vec![u64::MAX; (edges * 2).next_power_of_two()]);
        for &[a, b, c] in triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let slot = set.slot_of(from, to);
                set.0[slot] = key(from, to);
            }
        }
        set
    }

    fn contains(&self, from: u32, to: u32) -> bool {
        self.0[self.slot_of(from, to)] != u64::MAX
    }

    fn slot_of(&self, from: u32, to: u32) -> usize {
        let key = key(from, to);
        let mut slot =
            (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & (self.0.len() - 1);
        while self.0[slot] != u64::MAX && self.0[slot] != key {
            slot = (slot + 1) & (self.0.len() - 1);
        }
        slot
    }
}

fn key(from: u32, to: u32) -> u64 {
    u64::from(from) << 32 | u64::from(to)
}

/// How finely each simplified triangle is sampled: about as finely as the source has vertices
/// there, and twice as finely where there are fewer source vertices than elsewhere, since it may
/// span a gap. `under` names the triangle that each of those vertices is near to.
pub(super) fn rows_of(faces: &[Face], under: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut above = vec![0u32; faces.len()];
    for face in under {
        above[face as usize] += 1;
    }
    let areas: Vec<f32> = faces
        .iter()
        .map(
            |Face {
                 corners: [a, b, c], ..
             }| (*b - *a).cross(*c - *a).length(),
        )
        .collect();
    let total: f32 = areas.iter().sum();
    let vertices: u32 = above.iter().sum();
    let rows = areas.iter().zip(above).map(|(area, above)| {
        let expected = (area / total.max(f32::MIN_POSITIVE)) * vertices as f32;
        let gap = if (above as f32) < expected * GAP_SHARE {
            2.0
        } else {
            1.0
        };
        ((expected * SAMPLES_PER_VERTEX).sqrt() * gap)
            .ceil()
            .clamp(MIN_ROWS, MAX_ROWS) as u32
    });
    rows.collect()
}

/// Goes over triangles of one surface and asks how far they are from the other.
pub(super) struct FaceWalk<'a> {
    pub(super) surface: &'a TriangleTree,
    /// The largest squared distance so far.
    pub(super) furthest: f32,
    /// The triangle to try first.
    pub(super) guess: u32,
}

impl FaceWalk<'_> {
    /// The squared distance of `point`, if it is above `floor`.
    fn beyond(&mut self, point: Vec3A, floor: f32) -> Option<f32> {
        let hit = self.surface.nearest(point, floor, self.guess)?;
        self.guess = hit.slot;
        self.furthest = self.furthest.max(hit.distance_squared);
        (hit.distance_squared > floor).then_some(hit.distance_squared)
    }

    /// Samples the sides that count and the inside of a triangle, in `rows` rows.
    pub(super) fn sample(&mut self, face: &Face, rows: u32) {
        let step = 1.0 / rows as f32;
        // An odd number, so that the middle is among them: there, edges stray furthest as a rule.
        let parts = rows | 1;
        for part in 0..parts {
            let along = (part as f32 + 0.5) / parts as f32;
            for side in 0..3 {
                if face.sides & 1 << side != 0 {
                    let place = [(along, 0.0), (1.0 - along, along), (0.0, 1.0 - along)][side];
                    self.sample_at(face, Vec2::from(place), step);
                }
            }
        }
        for row in 0..rows {
            for column in 0..rows - row {
                let corner = Vec2::new(column as f32, row as f32);
                self.sample_at(face, (corner + 1.0 / 3.0) * step, step);
                if column + row + 1 < rows {
                    self.sample_at(face, (corner + 2.0 / 3.0) * step, step);
                }
            }
        }
    }

    /// Samples one place, and if it is nearly as far as the furthest before, climbs from there to
    /// where it is furthest. Places are shares of the edges from the first corner.
    fn sample_at(&mut self, face: &Face, mut place: Vec2, mut step: f32) {
        const DIRECTIONS: [(f32, f32); 6] = [
            (1.0, 0.0),
            (0.0, 1.0),
            (-1.0, 1.0),
            (-1.0, 0.0),
            (0.0, -1.0),
            (1.0, -1.0),
        ];
        let floor = self.furthest * CLIMB_FROM * CLIMB_FROM;
        let Some(mut distance_squared) = self.beyond(face.point(place), floor) else {
            return;
        };
        let smallest = step * SMALLEST_STEP;
        while step > smallest {
            let further = DIRECTIONS.into_iter().find_map(|direction| {
                let place = within(place + Vec2::from(direction) * step);
                Some((place, self.beyond(face.point(place), distance_squared)?))
            });
            match further {
                Some(further) => (place, distance_squared) = further,
                None => step *= 0.5,
            }
        }
    }
}

impl Face {
    fn point(&self, place: Vec2) -> Vec3A {
        let [a, b, c] = self.corners;
        a + (b - a) * place.x + (c - a) * place.y
    }
}

/// The place nearest to `place`, more or less, that lies in the triangle.
fn within(place: Vec2) -> Vec2 {
    let place = place.max(Vec2::ZERO);
    place / (place.x + place.y).max(1.0)
}
