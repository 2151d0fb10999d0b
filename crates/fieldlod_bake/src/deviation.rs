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

mod faces;
mod patches;

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use self::faces::{Face, FaceWalk, faces_of, rows_of};
use self::patches::PatchWalk;
use crate::input::SimplifierInput;
use crate::levels::RawGroup;
use crate::nearest::{Hit, TriangleTree};
use crate::patch::Patch;

/// One vertex in so many is measured exactly before the others; those need only be compared with
/// the largest distance found so far.
const PROBE_STRIDE: usize = 16;
/// Simplified triangles that are sampled together.
const FACES_PER_TASK: usize = 256;
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
        // Groups of the same level do not build on each other.
        let level = groups[first].level;
        let same = groups[first..]
            .iter()
            .take_while(|group| group.level == level);
        let run = first..first + same.count();
        let patches: Vec<Vec<Patch>> = waiting[run.clone()]
            .iter_mut()
            .map(std::mem::take)
            .collect();
        let measured = run.clone().into_par_iter().zip(patches);
        let measured = measured.map(|(index, mut patches)| {
            if groups[index].is_terminal() {
                return Measured::default();
            }
            patches.extend(source_clusters(&groups[index]).map(Patch::of));
            ruler.measure(patches, &outputs[index], groups)
        });
        let measured: Vec<Measured> = measured.collect();
        first = run.end;
        for (index, measured) in run.zip(measured) {
            for (consumer, patch) in measured.onward {
                waiting[consumer as usize].push(patch);
            }
            let own = measured.deviation * input.local_from_scaled;
            let own = own.max(groups[index].deviation_in_local);
            groups[index].deviation_in_local = monotone(own, &groups[index], groups);
        }
    }
}

/// The group's own deviation, but no less than those of the groups that produced its units.
fn monotone(own: f32, group: &RawGroup, groups: &[RawGroup]) -> f32 {
    if group.is_terminal() {
        return f32::INFINITY;
    }
    let finer = group
        .units
        .iter()
        .filter_map(|unit| groups.get(unit.produced_by as usize));
    let largest = finer
        .map(|finer| finer.deviation_in_local)
        .fold(own, f32::max);
    largest.min(f32::MAX)
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

/// What a group was simplified to.
struct Output {
    /// For each triangle, the group that consumes it.
    consumers: Vec<u32>,
    faces: Vec<Face>,
    tree: TriangleTree,
}

impl Output {
    /// The group that consumes the triangle of `hit`.
    fn consumer(&self, hit: Hit) -> u32 {
        self.consumers[self.tree.id(hit.slot) as usize]
    }

    fn has_several_consumers(&self) -> bool {
        self.consumers.windows(2).any(|pair| pair[0] != pair[1])
    }
}

impl Ruler<'_> {
    fn position(&self, vertex: u32) -> Vec3A {
        Vec3A::from_array(self.input.positions[vertex as usize])
    }

    fn measure(
        &self,
        patches: Vec<Patch>,
        units: &[(u32, usize)],
        groups: &[RawGroup],
    ) -> Measured {
        let output = self.output_of(units, groups);
        let probed = self.probe(&patches, &output.tree).max(ROUNDING * ROUNDING);
        let followed = patches
            .into_par_iter()
            .map(|patch| self.follow(patch, &output, probed));
        let followed: Vec<Followed> = followed.collect();
        let furthest = followed.iter().map(|followed| followed.furthest);
        let furthest = furthest.fold(probed, f32::max);
        let under = followed.iter().flat_map(|followed| &followed.under);
        let rows = rows_of(&output.faces, under.copied());
        let tasks = output
            .faces
            .par_chunks(FACES_PER_TASK)
            .zip(rows.par_chunks(FACES_PER_TASK));
        let sampled = tasks.map(|(faces, rows)| self.furthest_face(faces, rows, furthest));
        let furthest = sampled.reduce(|| furthest, f32::max);
        let onward = followed.into_iter().flat_map(|followed| followed.onward);
        Measured {
            deviation: furthest.sqrt() * SAMPLING_MARGIN,
            onward: onward.collect(),
        }
    }

    fn output_of(&self, units: &[(u32, usize)], groups: &[RawGroup]) -> Output {
        let (mut consumers, mut welded) = (Vec::new(), Vec::new());
        for &(consumer, unit) in units {
            for cluster in &groups[consumer as usize].units[unit].clusters {
                let (triangles, _) = cluster.as_chunks::<3>();
                let weld =
                    |corners: &[u32; 3]| corners.map(|v| self.input.same_position[v as usize]);
                welded.extend(triangles.iter().map(weld));
            }
            consumers.resize(welded.len(), consumer);
        }
        let faces = faces_of(&welded, |vertex| self.position(vertex));
        let tree = TriangleTree::of(faces.iter().map(|face| face.corners.map(Vec3::from)));
        Output {
            consumers,
            faces,
            tree,
        }
    }

    /// Measures a patch, and divides it among the groups that come next.
    fn follow(&self, patch: Patch, output: &Output, furthest: f32) -> Followed {
        let mut walk = PatchWalk {
            ruler: self,
            simplified: &output.tree,
            furthest,
        };
        let nearest = walk.vertices(&patch);
        walk.crossings(&patch, &nearest);
        let onward = if output.has_several_consumers() {
            let consumer = |corner: u16| output.consumer(nearest[usize::from(corner)]);
            let votes = patch
                .triangles
                .iter()
                .map(|triangle| majority(triangle.map(consumer)));
            let votes: Vec<u32> = votes.collect();
            patch
                .split(|triangle| votes[triangle])
                .into_iter()
                .collect()
        } else {
            vec![(output.consumers[0], patch)]
        };
        let under = nearest.iter().map(|hit| output.tree.id(hit.slot)).collect();
        Followed {
            furthest: walk.furthest,
            onward,
            under,
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
            surface: &self.source,
            furthest,
            guess: 0,
        };
        for (face, &rows) in faces.iter().zip(rows) {
            walk.sample(face, rows);
        }
        walk.furthest
    }
}

/// What came of a patch.
struct Followed {
    furthest: f32,
    /// Its parts, by the group that comes next.
    onward: Vec<(u32, Patch)>,
    /// For each vertex, the simplified triangle that it is near to.
    under: Vec<u32>,
}

fn majority([a, b, c]: [u32; 3]) -> u32 {
    if b == c { b } else { a }
}
