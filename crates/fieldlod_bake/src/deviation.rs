//! How far each simplified surface lies from the source surface, measured in both directions.
//!
//! A deviation is a maximum, and no less than those of the finer groups below. So most of the work
//! is to show that a place is no further than the furthest so far.
//!
//! Source to simplified: each source vertex is walked to the simplified triangle that it stands
//! above, from where it stood a level before. A source triangle above several simplified ones is
//! no further than its corners from the planes of these; where that is not enough, its edges are
//! measured where they cross from above one to above the next.
//!
//! Simplified to source: at the same crossings, and at samples on edges and faces. Triangles that
//! the source covers from edge to edge, and nowhere far above, are as near to it and need none;
//! those that may span a gap in the source get the most.
//! From a sample that is further than all before, the search climbs to where it is furthest.
//! (Corners of simplified triangles are source vertices.) Groups with few source triangles
//! below are sampled everywhere, and so are these if none of them lies beside: there, one fold of the
//! source is all that counts.
//!
//! A source vertex under a group goes on to the group that consumes the simplified triangle below
//! it, and source triangles go where their corners go.

mod crossings;
mod faces;
mod furthest;
mod output;
mod places;
mod seats;

use std::ops::Range;

use rayon::prelude::*;

use self::crossings::furthest_crossing;
use self::faces::{furthest_face, furthest_of_few};
use self::output::{Output, outputs_of};
use self::places::Places;
use self::seats::{SeatPool, Seating};
use crate::groups::RawGroup;
use crate::input::SimplifierInput;
use crate::patch::Patch;
use crate::surface::{NONE, Surface};

/// Distances below this, times the size of the mesh, are rounding.
const ROUNDING: f32 = 4e-7;
/// What is added for places between the samples.
const SAMPLING_MARGIN: f32 = 1.02;

/// Measures every group of `groups`, which come finer before coarser, and keeps the deviations
/// from shrinking upwards.
pub(crate) fn measure_deviations(input: SimplifierInput, groups: &mut [RawGroup]) {
    let places = Places::of(input, groups);
    let ruler = Ruler::of(&places, groups);
    let outputs = outputs_of(groups);
    let mut waiting: Vec<Vec<Patch>> = Vec::new();
    waiting.resize_with(groups.len(), Vec::new);
    let mut furthest = vec![ROUNDING * ROUNDING; groups.len()];
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
        let measured = measured.map(|(index, patches)| {
            let group = &groups[index];
            let finer = group.units.iter().filter(|unit| !unit.is_source());
            let finer = finer.map(|unit| furthest[unit.produced_by as usize]);
            let least = group.deviation_in_local / places.local_from_scaled / SAMPLING_MARGIN;
            // Rounded up.
            let least = least * least * (1.0 + 4.0 * f32::EPSILON);
            let start = finer.fold(furthest[index].max(least), f32::max);
            if outputs[index].is_empty() {
                return Measured::unchanged(start);
            }
            let patch = Patch::merge(patches, ruler.fresh[index].clone());
            ruler.measure(patch, index, &outputs[index], groups, start)
        });
        let measured: Vec<Measured> = measured.collect();
        first = run.end;
        for (index, measured) in run.zip(measured) {
            for (consumer, patch) in measured.onward {
                waiting[consumer as usize].push(patch);
            }
            furthest[index] = measured.furthest;
        }
    }
    for (group, furthest) in groups.iter_mut().zip(furthest) {
        let in_local = furthest.sqrt() * SAMPLING_MARGIN * places.local_from_scaled;
        group.deviation_in_local = if group.is_terminal() {
            f32::INFINITY
        } else {
            in_local.min(f32::MAX)
        };
    }
}

struct Measured {
    /// The largest distance, squared, in scaled units.
    furthest: f32,
    /// The source below, by the group that comes next.
    onward: Vec<(u32, Patch)>,
}

impl Measured {
    fn unchanged(furthest: f32) -> Self {
        Self {
            furthest,
            onward: Vec::new(),
        }
    }
}

struct Ruler<'a> {
    places: &'a Places,
    /// Triangles in the order of the groups that are the first to simplify them.
    source: Surface<'a>,
    /// For each group, the source triangles that it is the first to simplify.
    fresh: Vec<Range<u32>>,
    /// For each triangle of `source`, whether it has an open edge.
    is_rim: Vec<bool>,
    /// For each place, one of its triangles.
    triangle_at: Vec<u32>,
    seats: SeatPool,
}

impl<'a> Ruler<'a> {
    fn of(places: &'a Places, groups: &[RawGroup]) -> Self {
        let units = groups.iter().flat_map(|group| &group.units);
        let clusters = units.filter(|unit| unit.is_source());
        let clusters = clusters.flat_map(|unit| &unit.clusters);
        let triangles = clusters.map(|cluster| cluster.len() / 3).sum();
        let mut corners: Vec<[u32; 3]> = Vec::with_capacity(triangles);
        let mut fresh = Vec::with_capacity(groups.len());
        for group in groups {
            let first = corners.len() as u32;
            let source = group.units.iter().filter(|unit| unit.is_source());
            for cluster in source.flat_map(|unit| &unit.clusters) {
                corners.extend(places.triangles(cluster));
            }
            fresh.push(first..corners.len() as u32);
        }
        let seats = SeatPool::new(places.positions.len());
        let mut triangle_at = vec![NONE; places.positions.len()];
        let source = Surface::of(&places.positions, corners, &mut triangle_at);
        for (triangle, corners) in source.corners().iter().enumerate() {
            for &vertex in corners {
                triangle_at[vertex as usize] = triangle as u32;
            }
        }
        let neighbours = source.neighbours().iter();
        let is_rim = neighbours.map(|across| across.contains(&NONE)).collect();
        Self {
            places,
            source,
            is_rim,
            fresh,
            triangle_at,
            seats,
        }
    }

    fn measure(
        &self,
        patch: Patch,
        group: usize,
        units: &[(u32, usize)],
        groups: &[RawGroup],
        start: f32,
    ) -> Measured {
        let mut seats = self.seats.take();
        let output = Output::of(self.places, units, groups, &mut seats);
        let mut seating = Seating::new(&output, &mut seats, start);
        let clusters = groups[group].units.iter().flat_map(|unit| &unit.clusters);
        let inputs: Vec<[u32; 3]> = clusters.flat_map(|c| self.places.triangles(c)).collect();
        let removed = seating.seat_corners(&inputs);
        let furthest = seating.seat_riders(&patch.riders);
        let furthest = furthest_crossing(self, &output, &seats, &patch, furthest);
        let above = output.vertices_above(&seats, &removed, &patch.riders);
        let furthest = furthest_face(self, &output, &above, furthest);
        // All below was never simplified, or is all there is.
        let whole = [self.fresh[group].len(), self.source.corners().len()];
        let is_alone = whole.contains(&patch.inside.len());
        let furthest = furthest_of_few(self, &output, &seats, &patch, is_alone, furthest);
        let vertices = inputs.iter().flatten().copied();
        let vertices = vertices.chain(patch.riders.iter().map(|rider| rider.vertex));
        let vertices: Vec<u32> = vertices.collect();
        let onward = output.pass_on(self, &seats, &removed, patch);
        self.seats.give_back(seats, vertices, &output);
        Measured { furthest, onward }
    }
}
