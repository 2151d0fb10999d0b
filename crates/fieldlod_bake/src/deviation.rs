//! How far each simplified surface lies from the source surface, measured in both directions.
//!
//! Source to simplified: the source triangles under a group are sampled at their vertices, and
//! where an edge crosses from above one simplified triangle to above the next. Where the two
//! surfaces lie one above the other, both are flat between these places, so that nothing between
//! them is further.
//!
//! Simplified to source: the simplified triangles are sampled at the middles of their edges and
//! faces (their corners are source vertices), and ever closer around samples that lie further away
//! than all before.
//!
//! The source triangles under a group are followed from level to level: each belongs to the group
//! that consumes the simplified triangle it is nearest to. Towards the source, distances are to
//! the whole source.

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use crate::input::SimplifierInput;
use crate::nearest::{Hit, TriangleTree};
use crate::patch::Patch;
use crate::simplify::RawGroup;

/// One vertex in so many is measured exactly before the others; those need only be compared with
/// the largest distance found so far.
const PROBE_STRIDE: usize = 16;
/// Simplified triangles that are sampled together.
const FACES_PER_TASK: usize = 256;
/// How often a simplified triangle is halved around a sample that is further away than all before.
const MAX_HALVINGS: u32 = 3;
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
            if group.is_stuck() {
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
            let stuck = group.is_stuck();
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
        let faces = triangles
            .iter()
            .map(|(_, corners)| corners.map(|v| self.position(v)));
        let faces: Vec<[Vec3A; 3]> = faces.collect();
        let simplified = TriangleTree::of(faces.iter().map(|face| face.map(Vec3::from)));
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
            (walk.furthest, parts)
        });
        let followed: Vec<(f32, Vec<(u32, Patch)>)> = followed.collect();
        let furthest = followed
            .iter()
            .map(|&(furthest, _)| furthest)
            .fold(probed, f32::max);
        let onward = followed.into_iter().flat_map(|(_, parts)| parts).collect();
        let sampled = faces
            .par_chunks(FACES_PER_TASK)
            .map(|faces| self.furthest_face(faces, furthest));
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
    fn furthest_face(&self, faces: &[[Vec3A; 3]], furthest: f32) -> f32 {
        let mut walk = FaceWalk {
            source: &self.source,
            furthest,
            guess: 0,
        };
        for &face in faces {
            walk.sample(face, 0);
        }
        walk.furthest
    }
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

    fn crossing(&mut self, [from, to]: [Vec3A; 2], slot: u32) {
        let triangle = self.simplified.triangle(slot);
        if let Some(share) = triangle.exit(from, to) {
            self.distance(from.lerp(to, share), slot);
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

    fn sample(&mut self, [a, b, c]: [Vec3A; 3], halvings: u32) {
        let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
        let mut exceeds = false;
        for point in [ab, bc, ca, (a + b + c) / 3.0] {
            exceeds |= self.exceeds(point);
        }
        if exceeds && halvings < MAX_HALVINGS {
            for quarter in [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]] {
                self.sample(quarter, halvings + 1);
            }
        }
    }
}
