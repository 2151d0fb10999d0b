//! Triangles of one surface, sampled for their distance from the other.

use glam::{Vec2, Vec3A};
use rayon::prelude::*;

use super::Ruler;
use super::furthest::Furthest;
use super::output::Output;
use super::places::Seats;
use crate::patch::Patch;
use crate::surface::{NONE, Surface};

/// Simplified triangles that are sampled together.
const FACES_PER_TASK: usize = 256;
/// Samples per source vertex above as much area.
const SAMPLES_PER_VERTEX: f32 = 0.1;
/// Most rows of samples on one triangle.
const MAX_ROWS: f32 = 8.0;
/// Samples per source vertex above as much area, where there may be a gap in the source.
const SAMPLES_PER_VERTEX_IN_GAPS: f32 = 0.5;
/// Least rows of samples there.
const MIN_ROWS_IN_GAPS: f32 = 5.0;
/// Most rows of samples there.
const MAX_ROWS_IN_GAPS: f32 = 24.0;
/// Source triangles below a group, up to which all of its surface is sampled.
const FEW_TRIANGLES: usize = 1500;
/// How many samples a surface gets then, about.
const SAMPLES_OF_FEW: f32 = 6000.0;
/// A triangle with less than this share of the source vertices that its area would have on average
/// may span a gap.
const GAP_SHARE: f32 = 0.5;
/// A sample this share of the largest distance so far is worth a climb: a summit may be near it.
const CLIMB_FROM: f32 = 0.5;
/// How many samples of a group are worth a climb: the furthest.
const MOST_CLIMBS: usize = 32;
/// Where a climb to the furthest place of a triangle ends: with steps of this share of the first.
const SMALLEST_STEP: f32 = 0.03;

/// The largest squared distance of the simplified surface from the source, or `furthest`. `above`
/// says how many source vertices stand above each triangle.
pub(super) fn furthest_face(
    ruler: &Ruler<'_>,
    output: &Output<'_>,
    above: &[u32],
    furthest: f32,
) -> f32 {
    let density = density_of(&output.surface, above);
    let tasks = above.par_chunks(FACES_PER_TASK).enumerate();
    let tasks = tasks.map(|(task, above)| {
        let mut walk = FaceWalk::over(&ruler.source, furthest);
        for (triangle, &above) in (task * FACES_PER_TASK..).zip(above) {
            let triangle = triangle as u32;
            let corner = output.surface.corners()[triangle as usize][0];
            walk.guess = ruler.triangle_at[corner as usize];
            let corners = output.surface.corner_positions(triangle);
            let expected = density * area(corners);
            let rows = Rows::on(output, triangle, expected, above, furthest);
            walk.sample(corners, &rows);
        }
        walk
    });
    let tasks: Vec<FaceWalk<'_>> = tasks.collect();
    let mut all = FaceWalk::over(&ruler.source, furthest);
    for task in tasks {
        all.slopes.extend(task.slopes);
        all.furthest.join([task.furthest]);
    }
    all.climb()
}

/// As [`furthest_face`], for groups with so few triangles that the rules which tell where no samples
/// are needed have little to go by: all of the surface is sampled, which costs little here. So is
/// the source, if `is_alone`: where nothing was simplified before, or the whole mesh is one group.
/// Elsewhere triangles inside a patch may lie above the groups beside, as borders go back and forth.
pub(super) fn furthest_of_few(
    ruler: &Ruler<'_>,
    output: &Output<'_>,
    seats: &Seats,
    patch: &Patch,
    is_alone: bool,
    furthest: f32,
) -> f32 {
    if patch.inside.is_empty() || patch.inside.len() >= FEW_TRIANGLES {
        return furthest;
    }
    let mut walk = FaceWalk::over(&ruler.source, furthest);
    let simplified = output.surface.corners();
    let rows = Rows::throughout(simplified.len());
    for (triangle, vertices) in (0..).zip(simplified) {
        walk.guess = ruler.triangle_at[vertices[0] as usize];
        walk.sample(output.surface.corner_positions(triangle), &rows);
    }
    let furthest = walk.climb();
    if !is_alone {
        return furthest;
    }
    let mut walk = FaceWalk::over(&output.surface, furthest);
    let rows = Rows::throughout(patch.inside.len());
    for &triangle in &patch.inside {
        let vertices = ruler.source.corners()[triangle as usize];
        let seats = vertices.map(|vertex| seats[vertex as usize]);
        walk.guess = seats.into_iter().find(|&seat| seat != NONE).unwrap_or(0);
        walk.sample(ruler.source.corner_positions(triangle), &rows);
    }
    walk.climb()
}

/// Source vertices above a surface, for each (twofold) area.
fn density_of(surface: &Surface<'_>, above: &[u32]) -> f32 {
    let triangles = 0..above.len() as u32;
    let areas = triangles.map(|triangle| area(surface.corner_positions(triangle)));
    let total: f32 = areas.sum();
    above.iter().sum::<u32>() as f32 / total.max(f32::MIN_POSITIVE)
}

/// Twice the area.
fn area([a, b, c]: [Vec3A; 3]) -> f32 {
    (b - a).cross(c - a).length()
}

/// How finely a triangle is sampled.
pub(super) struct Rows {
    pub(super) inside: u32,
    /// Samples on the edge from each corner to the next.
    pub(super) sides: [u32; 3],
}

impl Rows {
    /// On each triangle of a surface that is sampled everywhere.
    fn throughout(triangle_count: usize) -> Self {
        let rows = (SAMPLES_OF_FEW / triangle_count as f32).sqrt().ceil();
        let rows = rows.clamp(1.0, MAX_ROWS_IN_GAPS) as u32;
        Self {
            inside: rows,
            // An odd number, as below.
            sides: [rows | 1; 3],
        }
    }

    /// Where the source goes over all edges of a triangle, has no border above it and is near it
    /// everywhere, so is the triangle to the source: no samples are needed. Where the source is
    /// further away, a few are; more where there may be a gap.
    fn on(output: &Output<'_>, triangle: u32, expected: f32, above: u32, furthest: f32) -> Self {
        let is_tall = |triangle: u32| output.is_tall(triangle, furthest);
        let has_rim = output.has_rim(triangle);
        let is_sparse = (above as f32) < (expected * GAP_SHARE).floor();
        let covered = (expected * SAMPLES_PER_VERTEX).sqrt().ceil();
        let covered = u32::from(is_tall(triangle)) * covered.clamp(1.0, MAX_ROWS) as u32;
        let gap = (expected * SAMPLES_PER_VERTEX_IN_GAPS).sqrt() * 2.0;
        let gap = gap.ceil().clamp(MIN_ROWS_IN_GAPS, MAX_ROWS_IN_GAPS) as u32;
        let rows = |has_gap: bool| if has_gap { gap } else { covered };
        let across = output.surface.neighbours()[triangle as usize];
        let is_crossed = output.crossed(triangle);
        let side = |k: usize| {
            // Each edge is sampled with the later of its triangles, or with the taller.
            let own = across[k] == NONE || across[k] < triangle || !is_tall(across[k]);
            // An odd number, so that the middle is among them: there, edges stray furthest.
            let rows = u32::from(own) * rows(has_rim || !is_crossed[k]);
            if rows > 0 { rows | 1 } else { 0 }
        };
        Self {
            inside: rows(has_rim || is_sparse || is_crossed.contains(&false)),
            sides: [side(0), side(1), side(2)],
        }
    }
}

/// Goes over triangles of one surface and asks how far they are from the other.
pub(super) struct FaceWalk<'a> {
    furthest: Furthest<'a>,
    /// The triangle to try first.
    pub(super) guess: u32,
    /// Samples with a summit near them, one on each triangle at most.
    slopes: Vec<Slope>,
}

/// A place on a triangle that is nearly as far as the furthest.
#[derive(Clone, Copy)]
struct Slope {
    distance_squared: f32,
    corners: [Vec3A; 3],
    /// As shares of the edges from the first corner.
    place: Vec2,
    /// To the next sample, as such a share.
    step: f32,
    guess: u32,
}

impl Slope {
    fn point(&self, place: Vec2) -> Vec3A {
        let [a, b, c] = self.corners;
        a + (b - a) * place.x + (c - a) * place.y
    }
}

impl<'a> FaceWalk<'a> {
    pub(super) fn over(surface: &'a Surface<'a>, furthest: f32) -> Self {
        Self {
            furthest: Furthest::from(surface, furthest),
            guess: 0,
            slopes: Vec::new(),
        }
    }

    /// The squared distance of `point`, if it is above `floor`.
    fn beyond(&mut self, point: Vec3A, floor: f32) -> Option<f32> {
        let hit = self.furthest.see(point, self.guess, floor);
        self.guess = hit.triangle;
        (hit.distance_squared > floor).then_some(hit.distance_squared)
    }

    /// Samples the sides and the inside of a triangle.
    pub(super) fn sample(&mut self, corners: [Vec3A; 3], rows: &Rows) {
        let step = 1.0 / rows.inside as f32;
        let mut best = Slope {
            distance_squared: self.furthest.squared * CLIMB_FROM * CLIMB_FROM,
            corners,
            place: Vec2::ZERO,
            step,
            guess: NONE,
        };
        for (side, &parts) in rows.sides.iter().enumerate() {
            for part in 0..parts {
                let along = (part as f32 + 0.5) / parts as f32;
                let place = [(along, 0.0), (1.0 - along, along), (0.0, 1.0 - along)][side];
                self.sample_at(Vec2::from(place), &mut best);
            }
        }
        for row in 0..rows.inside {
            for column in 0..rows.inside - row {
                let corner = Vec2::new(column as f32, row as f32);
                self.sample_at((corner + 1.0 / 3.0) * step, &mut best);
                if column + row + 1 < rows.inside {
                    self.sample_at((corner + 2.0 / 3.0) * step, &mut best);
                }
            }
        }
        if best.guess != NONE {
            self.slopes.push(best);
        }
    }

    fn sample_at(&mut self, place: Vec2, best: &mut Slope) {
        if let Some(further) = self.beyond(best.point(place), best.distance_squared) {
            best.distance_squared = further;
            best.place = place;
            best.guess = self.guess;
        }
    }

    /// Climbs from the furthest samples to where it is furthest, and returns how far that is.
    pub(super) fn climb(mut self) -> f32 {
        self.furthest.settle();
        let mut slopes = std::mem::take(&mut self.slopes);
        slopes.sort_by(|a, b| b.distance_squared.total_cmp(&a.distance_squared));
        for slope in slopes.into_iter().take(MOST_CLIMBS) {
            if slope.distance_squared > self.furthest.squared * CLIMB_FROM * CLIMB_FROM {
                self.climb_from(slope);
                self.furthest.settle();
            }
        }
        self.furthest.squared
    }

    fn climb_from(&mut self, mut slope: Slope) {
        const DIRECTIONS: [(f32, f32); 6] = [
            (1.0, 0.0),
            (0.0, 1.0),
            (-1.0, 1.0),
            (-1.0, 0.0),
            (0.0, -1.0),
            (1.0, -1.0),
        ];
        self.guess = slope.guess;
        let smallest = slope.step * SMALLEST_STEP;
        while slope.step > smallest {
            let further = DIRECTIONS.into_iter().find_map(|direction| {
                let place = within(slope.place + Vec2::from(direction) * slope.step);
                Some((
                    place,
                    self.beyond(slope.point(place), slope.distance_squared)?,
                ))
            });
            match further {
                Some(further) => (slope.place, slope.distance_squared) = further,
                None => slope.step *= 0.5,
            }
        }
    }
}

/// The place nearest to `place`, more or less, that lies in the triangle.
fn within(place: Vec2) -> Vec2 {
    let place = place.max(Vec2::ZERO);
    place / (place.x + place.y).max(1.0)
}
