//! How far each simplified surface lies from the source surface, measured in both directions.
//!
//! Source to simplified: the source triangles under a group are sampled at their vertices, and
//! where an edge crosses from above one simplified triangle to above the next. Where the two
//! surfaces lie one above the other, both are flat between these places, so that nothing between
//! them is further.
//!
//! Simplified to source: at the same crossings, at the middles of all edges, and in rows on edges
//! and faces, about two vertices of the source apart: closer where a triangle may span a gap.
//! From a sample that is further than all before, the search climbs to where it is furthest.
//! (Corners of simplified triangles are source vertices.)
//!
//! The source triangles under a group are followed from level to level: each belongs to the group
//! that consumes the simplified triangle it is nearest to. Towards the source, distances are to
//! the whole source.

use glam::{Vec2, Vec3, Vec3A};
use rayon::prelude::*;

use crate::input::SimplifierInput;
use crate::levels::RawGroup;
use crate::nearest::{Hit, TriangleTree};
use crate::patch::Patch;

/// One vertex in so many is measured exactly before the others; those need only be compared with
/// the largest distance found so far.
const PROBE_STRIDE: usize = 16;
/// Simplified triangles that are sampled together.
const FACES_PER_TASK: usize = 256;
/// Samples on a simplified triangle per source vertex above as much area.
const SAMPLES_PER_VERTEX: f32 = 0.5;
/// A simplified triangle with less than this share of the source vertices that its area would
/// have on average may span a gap.
const GAP_SHARE: f32 = 0.5;
/// Most rows of samples on one simplified triangle.
const MAX_ROWS: f32 = 24.0;
/// Where a climb to the furthest place of a triangle ends: with steps of this share of the first.
const SMALLEST_STEP: f32 = 0.03;
/// Distances below this, times the size of the mesh, are rounding.
const ROUNDING: f32 = 4e-7;
/// What is added for places between the samples.
const SAMPLING_MARGIN: f32 = 1.02;

/// Measures every group of `groups`, which come finer before coarser, and keeps the deviations
/// from shrinking upwards.
pub(crate) fn measure_deviations(
    indices: &[u32],
    input: &SimplifierInput,
    groups: &mut [RawGroup],
) {
    let (triangles, _) = indices.as_chunks::<3>();
    let corners = |triangle: &[u32; 3]| triangle.map(|v| Vec3::from(input.positions[v as usize]));
    let ruler = Ruler {
        input,
        source: TriangleTree::of(triangles.iter().map(corners)),
    };
    let outputs = outputs_of(groups);
    let mut waiting: Vec<Vec<Patch>> = Vec::new();
    waiting.resize_with(groups.len(), Vec::new);
    let mut first = 0;
    while first < groups.len() {
        let level = groups[first].level;
        let count = groups[first..]
            .iter()
            .take_while(|group| group.level == level)
            .count();
        let range = first..first + count;
        let tasks = range
            .clone()
            .zip(&mut waiting[range.clone()])
            .map(|(g, w)| (g, std::mem::take(w)));
        let tasks: Vec<(usize, Vec<Patch>)> = tasks.collect();
        let measured = tasks.into_par_iter().map(|(index, patches)| {
            let group = &groups[index];
            if group.is_terminal() {
                return Measured::default();
            }
            let own = source_clusters(group).map(Patch::of);
            let patches = patches.into_iter().chain(own).collect();
            ruler.measure(patches, &outputs[index], groups)
        });
        let measured: Vec<Measured> = measured.collect();
        for (index, measured) in range.zip(measured) {
            for (consumer, patch) in measured.onward {
                waiting[consumer as usize].push(patch);
            }
            let own = measured.deviation * input.local_from_scaled;
            let group = &groups[index];
            let finer = group
                .units
                .iter()
                .filter_map(|unit| groups.get(unit.produced_by as usize));
            let largest = finer
                .map(|group| group.deviation_in_local)
                .fold(own, f32::max);
            let stuck = group.is_terminal();
            groups[index].deviation_in_local = if stuck {
                f32::INFINITY
            } else {
                largest.min(f32::MAX)
            };
        }
        first += count;
    }
}

/// For each group, the units that it produced: the group that consumes each and its index there.
fn outputs_of(groups: &[RawGroup]) -> Vec<Vec<(u32, usize)>> {
    let mut outputs = vec![Vec::new(); groups.len()];
    for (consumer, group) in groups.iter().enumerate() {
        for (index, unit) in group.units.iter().enumerate() {
            if let Some(units) = outputs.get_mut(unit.produced_by as usize) {
                units.push((consumer as u32, index));
            }
        }
    }
    outputs
}

/// Clusters of source triangles that `group` is the first to simplify.
fn source_clusters(group: &RawGroup) -> impl Iterator<Item = &[u32]> {
    let source = group.units.iter().filter(|unit| unit.is_source());
    source.flat_map(|unit| &unit.clusters).map(Vec::as_slice)
}

#[derive(Default)]
struct Measured {
    /// In scaled units.
    deviation: f32,
    /// The source triangles below, by the group that comes next.
    onward: Vec<(u32, Patch)>,
}

struct Ruler<'a> {
    input: &'a SimplifierInput,
    source: TriangleTree,
}

impl Ruler<'_> {
    fn position(&self, vertex: u32) -> Vec3A {
        Vec3A::from_array(self.input.positions[vertex as usize])
    }

    fn measure(
        &self,
        patches: Vec<Patch>,
        output: &[(u32, usize)],
        groups: &[RawGroup],
    ) -> Measured {
        let units = || {
            output
                .iter()
                .map(|&(consumer, unit)| (consumer, &groups[consumer as usize].units[unit]))
        };
        let triangles = units().flat_map(|(consumer, unit)| {
            let corners = unit
                .clusters
                .iter()
                .flat_map(|cluster| cluster.as_chunks::<3>().0);
            corners.map(move |corners| (consumer, *corners))
        });
        let triangles: Vec<(u32, [u32; 3])> = triangles.collect();
        let welded = |corners: &[u32; 3]| corners.map(|v| self.input.same_position[v as usize]);
        let welded: Vec<[u32; 3]> = triangles
            .iter()
            .map(|(_, corners)| welded(corners))
            .collect();
        let edges = EdgeSet::of(welded.iter());
        let faces = welded.iter().map(|&[a, b, c]| {
            let once = |from: u32, to: u32| from < to || !edges.contains(to, from);
            Face {
                corners: [a, b, c].map(|v| self.position(v)),
                sides: u8::from(once(a, b)) | u8::from(once(b, c)) << 1 | u8::from(once(c, a)) << 2,
            }
        });
        let faces: Vec<Face> = faces.collect();
        let simplified = TriangleTree::of(faces.iter().map(|face| face.corners.map(Vec3::from)));
        let floor = ROUNDING * ROUNDING;
        let probed = self.probe(&patches, &simplified).max(floor);
        let several = units().any(|(consumer, _)| consumer != output[0].0);
        let followed = patches.into_par_iter().map(|patch| {
            let mut walk = PatchWalk {
                ruler: self,
                simplified: &simplified,
                furthest: probed,
            };
            let nearest = walk.vertices(&patch);
            walk.crossings(&patch, &nearest);
            let consumer = |hit: Hit| triangles[simplified.id(hit.slot) as usize].0;
            let parts = if several {
                let corner = |triangle: usize| {
                    patch.triangles[triangle].map(|v| consumer(nearest[usize::from(v)]))
                };
                let votes: Vec<u32> = (0..patch.triangles.len())
                    .map(|t| majority(corner(t)))
                    .collect();
                patch
                    .split(|triangle| votes[triangle])
                    .into_iter()
                    .collect()
            } else {
                vec![(output[0].0, patch)]
            };
            Followed {
                furthest: walk.furthest,
                parts,
                under: nearest.iter().map(|hit| simplified.id(hit.slot)).collect(),
            }
        });
        let followed: Vec<Followed> = followed.collect();
        let furthest = followed
            .iter()
            .map(|followed| followed.furthest)
            .fold(probed, f32::max);
        let rows = rows_of(&faces, &followed);
        let onward = followed
            .into_iter()
            .flat_map(|followed| followed.parts)
            .collect();
        let sampled = faces
            .par_chunks(FACES_PER_TASK)
            .zip(rows.par_chunks(FACES_PER_TASK))
            .map(|(faces, rows)| self.furthest_face(faces, rows, furthest));
        let furthest = sampled.reduce(|| furthest, f32::max);
        Measured {
            deviation: furthest.sqrt() * SAMPLING_MARGIN,
            onward,
        }
    }

    /// A first estimate (squared) of the largest distance: that of some of the vertices.
    fn probe(&self, patches: &[Patch], simplified: &TriangleTree) -> f32 {
        let distances = patches.par_iter().map(|patch| {
            let mut furthest = 0.0f32;
            for &vertex in patch.vertices.iter().step_by(PROBE_STRIDE) {
                if let Some(hit) = simplified.nearest(self.position(vertex), furthest, 0) {
                    furthest = furthest.max(hit.distance_squared);
                }
            }
            furthest
        });
        distances.reduce(|| 0.0, f32::max)
    }

    /// The largest squared distance of some simplified triangles from the source, or `furthest`.
    fn furthest_face(&self, faces: &[Face], rows: &[u32], furthest: f32) -> f32 {
        let mut walk = FaceWalk {
            source: &self.source,
            furthest,
            guess: 0,
        };
        for (face, &rows) in faces.iter().zip(rows) {
            walk.sample(face, rows);
        }
        walk.furthest
    }
}

/// A simplified triangle.
struct Face {
    corners: [Vec3A; 3],
    /// Bit k is set if the edge from corner k to the next is sampled with this triangle and not
    /// with its neighbour.
    sides: u8,
}

/// The directed edges of some triangles.
struct EdgeSet(Vec<u64>);

impl EdgeSet {
    fn of<'a>(triangles: impl Iterator<Item = &'a [u32; 3]> + Clone) -> Self {
        let edges = triangles.clone().count() * 3;
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

/// What came of a patch.
struct Followed {
    furthest: f32,
    parts: Vec<(u32, Patch)>,
    /// For each vertex, the simplified triangle that it is near to.
    under: Vec<u32>,
}

/// How finely each simplified triangle is sampled: about as finely as the source has vertices
/// there, and twice as finely where there are fewer source vertices than elsewhere, since it may
/// span a gap.
fn rows_of(faces: &[Face], followed: &[Followed]) -> Vec<u32> {
    let mut above = vec![0u32; faces.len()];
    for &face in followed.iter().flat_map(|followed| &followed.under) {
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
            .clamp(1.0, MAX_ROWS) as u32
    });
    rows.collect()
}

fn majority([a, b, c]: [u32; 3]) -> u32 {
    if b == c { b } else { a }
}

/// Goes over source triangles and asks how far they are from a simplified surface.
struct PatchWalk<'a> {
    ruler: &'a Ruler<'a>,
    simplified: &'a TriangleTree,
    /// The largest squared distance so far.
    furthest: f32,
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
    fn vertices(&mut self, patch: &Patch) -> Vec<Hit> {
        let mut guess = 0;
        let vertices = patch.vertices.iter().map(|&vertex| {
            let hit = self.distance(self.ruler.position(vertex), guess);
            guess = hit.slot;
            hit
        });
        vertices.collect()
    }

    /// Each edge within the patch is walked once in each direction.
    fn crossings(&mut self, patch: &Patch, nearest: &[Hit]) {
        for &[a, b, c] in &patch.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let (from, to) = (usize::from(from), usize::from(to));
                if nearest[from].slot != nearest[to].slot {
                    let ends = [from, to].map(|end| self.ruler.position(patch.vertices[end]));
                    self.crossing(ends, nearest[from].slot);
                }
            }
        }
    }

    /// Where the edges of both surfaces cross, one above the other, each may be furthest from the
    /// other.
    fn crossing(&mut self, [from, to]: [Vec3A; 2], slot: u32) {
        let crossing = self.simplified.triangle(slot).crossing(from, to);
        let Some([above, below]) = crossing else {
            return;
        };
        if above.distance_squared(below) <= self.furthest {
            return;
        }
        self.distance(above, slot);
        if let Some(hit) = self.ruler.source.nearest(below, self.furthest, 0) {
            self.furthest = self.furthest.max(hit.distance_squared);
        }
    }
}

/// Goes over simplified triangles and asks how far they are from the source.
struct FaceWalk<'a> {
    source: &'a TriangleTree,
    /// The largest squared distance so far.
    furthest: f32,
    guess: u32,
}

impl FaceWalk<'_> {
    /// Whether `point` is further away than all before.
    fn exceeds(&mut self, point: Vec3A) -> bool {
        let Some(hit) = self.source.nearest(point, self.furthest, self.guess) else {
            return false;
        };
        self.guess = hit.slot;
        let exceeds = hit.distance_squared > self.furthest;
        self.furthest = self.furthest.max(hit.distance_squared);
        exceeds
    }

    /// Samples the sides that count and the inside of a triangle, in `rows` rows.
    fn sample(&mut self, face: &Face, rows: u32) {
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

    /// Samples one place, and if it is further than all before, climbs from there to where it is
    /// furthest. Places are shares of the edges from the first corner.
    fn sample_at(&mut self, face: &Face, mut place: Vec2, mut step: f32) {
        if !self.exceeds(face.point(place)) {
            return;
        }
        let smallest = step * SMALLEST_STEP;
        while step > smallest {
            let directions = [
                (1.0, 0.0),
                (0.0, 1.0),
                (-1.0, 1.0),
                (-1.0, 0.0),
                (0.0, -1.0),
                (1.0, -1.0),
            ];
            let further = directions.into_iter().find_map(|direction| {
                let place = within(place + Vec2::from(direction) * step);
                self.exceeds(face.point(place)).then_some(place)
            });
            match further {
                Some(further) => place = further,
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
