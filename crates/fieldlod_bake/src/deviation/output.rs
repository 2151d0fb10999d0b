//! What a group was simplified to.

use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicU8, AtomicU32};

use glam::Vec3A;

use super::Ruler;
use super::places::{Places, Seats};
use crate::groups::RawGroup;
use crate::patch::{Patch, Rider};
use crate::surface::{NONE, Surface};

/// For each group, the units that it produced: the group that consumes each and its index there.
pub(super) fn outputs_of(groups: &[RawGroup]) -> Vec<Vec<(u32, usize)>> {
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

/// The simplified surface of a group.
pub(super) struct Output<'a> {
    pub(super) surface: Surface<'a>,
    /// The groups that consume it, each once.
    consumers: Vec<u32>,
    /// For each triangle, which of `consumers` consumes it.
    part_of: Vec<u32>,
    /// For each triangle, bit k if source triangles were seen to go over the edge from corner k to
    /// the next, and [`RIM`].
    seen: Vec<AtomicU8>,
    /// For each triangle, the furthest of what stands above it, squared, as bits: those of numbers
    /// that are not negative are in the order of the numbers. 0 for what is [low](LOW).
    tallest: Vec<AtomicU32>,
}

/// Triangles in a row that one edge of the source goes over.
const MOST_BETWEEN: usize = 4;
/// Set where the source has an open border above a triangle.
const RIM: u8 = 1 << 3;
/// The share of the largest distance so far (both squared) up to which what stands above a triangle
/// leaves it well covered.
const LOW: f32 = 0.81;

impl<'a> Output<'a> {
    /// `seats` are all free, and are so again afterwards.
    pub(super) fn of(
        places: &'a Places,
        units: &[(u32, usize)],
        groups: &[RawGroup],
        seats: &mut Seats,
    ) -> Self {
        let (mut consumers, mut part_of, mut corners) = (Vec::new(), Vec::new(), Vec::new());
        for &(consumer, unit) in units {
            if consumers.last() != Some(&consumer) {
                consumers.push(consumer);
            }
            for cluster in &groups[consumer as usize].units[unit].clusters {
                corners.extend(places.triangles(cluster));
            }
            part_of.resize(corners.len(), consumers.len() as u32 - 1);
        }
        let surface = Surface::of(&places.positions, corners, seats);
        // The outline is shared with the groups beside, and the source goes on there.
        let outline = |across: &[u32; 3]| {
            let bits = across.iter().zip([1, 2, 4]);
            bits.map(|(&next, bit)| if next == NONE { bit } else { 0 })
                .sum()
        };
        let seen = surface.neighbours().iter().map(outline);
        let tallest = surface.neighbours().iter().map(|_| AtomicU32::new(0));
        Self {
            seen: seen.map(AtomicU8::new).collect(),
            tallest: tallest.collect(),
            surface,
            consumers,
            part_of,
        }
    }

    /// Notes that a source triangle with these corners stands above these and goes over the edges
    /// between them.
    pub(super) fn cross(&self, corners: [Vec3A; 3], seats: [u32; 3]) {
        for from in 0..3 {
            let to = (from + 1) % 3;
            let both = seats[from] != NONE && seats[to] != NONE && seats[from] != seats[to];
            if both {
                self.cross_between(seats[from], seats[to], corners[to]);
            }
        }
    }

    /// `end` stands above `to`.
    fn cross_between(&self, from: u32, to: u32, end: Vec3A) {
        let mut at = from;
        for _ in 0..MOST_BETWEEN {
            let edge = self.edge_towards(at, to);
            let Some(edge) = edge.or_else(|| self.surface.edge_facing(at, end)) else {
                return;
            };
            self.cross_edge(at, edge);
            at = self.surface.neighbours()[at as usize][edge];
            if at == to || at == NONE {
                return;
            }
        }
    }

    fn edge_towards(&self, from: u32, to: u32) -> Option<usize> {
        let across = self.surface.neighbours()[from as usize];
        across.iter().position(|&neighbour| neighbour == to)
    }

    /// Notes that a source triangle at a corner of `seat` has these vertices: an edge between two
    /// corners is an edge of the source too.
    pub(super) fn share_edge(&self, seat: u32, vertices: [u32; 3]) {
        if self.is_crossed(seat) {
            return;
        }
        let corners = self.surface.corners()[seat as usize];
        let is_vertex = corners.map(|corner| vertices.contains(&corner));
        for edge in 0..3 {
            if is_vertex[edge] && is_vertex[(edge + 1) % 3] {
                self.cross_edge(seat, edge);
            }
        }
    }

    /// On both sides of it.
    fn cross_edge(&self, triangle: u32, edge: usize) {
        if self.mark(triangle, 1 << edge) {
            let other = self.surface.neighbours()[triangle as usize][edge];
            if other != NONE
                && let Some(edge) = self.edge_towards(other, triangle)
            {
                self.mark(other, 1 << edge);
            }
        }
    }

    /// Returns whether it is new.
    fn mark(&self, triangle: u32, bit: u8) -> bool {
        let seen = &self.seen[triangle as usize];
        seen.load(Relaxed) & bit == 0 && seen.fetch_or(bit, Relaxed) & bit == 0
    }

    pub(super) fn mark_rim(&self, triangle: u32) {
        self.mark(triangle, RIM);
    }

    /// Notes that something stands above a triangle at this distance (squared). `furthest` is the
    /// largest so far.
    pub(super) fn mark_tall(&self, triangle: u32, distance_squared: f32, furthest: f32) {
        if distance_squared > furthest * LOW {
            let (tallest, bits) = (&self.tallest[triangle as usize], distance_squared.to_bits());
            if bits > tallest.load(Relaxed) {
                tallest.fetch_max(bits, Relaxed);
            }
        }
    }

    /// Whether source triangles were seen to go over all edges of a triangle.
    fn is_crossed(&self, triangle: u32) -> bool {
        self.seen[triangle as usize].load(Relaxed) & 0b111 == 0b111
    }

    /// Whether source triangles were seen to go over the edge from each corner to the next.
    pub(super) fn crossed(&self, triangle: u32) -> [bool; 3] {
        let seen = self.seen[triangle as usize].load(Relaxed);
        [0, 1, 2].map(|edge| seen & 1 << edge != 0)
    }

    /// Whether the source has an open border above a triangle.
    pub(super) fn has_rim(&self, triangle: u32) -> bool {
        self.seen[triangle as usize].load(Relaxed) & RIM != 0
    }

    /// Whether something above a triangle is not nearer than the `furthest` from the surface, or
    /// hardly.
    pub(super) fn is_tall(&self, triangle: u32, furthest: f32) -> bool {
        let tallest = self.tallest[triangle as usize].load(Relaxed);
        f32::from_bits(tallest) > furthest * LOW
    }

    /// For each triangle, how many source vertices stand above it, apart from its corners.
    pub(super) fn vertices_above(
        &self,
        seats: &Seats,
        removed: &[u32],
        riders: &[Rider],
    ) -> Vec<u32> {
        let mut above = vec![0; self.part_of.len()];
        let riders = riders.iter().map(|rider| rider.vertex);
        for vertex in removed.iter().copied().chain(riders) {
            above[seats[vertex as usize] as usize] += 1;
        }
        above
    }

    /// Divides the source below among the groups that come next.
    pub(super) fn pass_on(
        &self,
        ruler: &Ruler<'_>,
        seats: &Seats,
        removed: &[u32],
        mut patch: Patch,
    ) -> Vec<(u32, Patch)> {
        let mut parts: Vec<Patch> = Vec::new();
        parts.resize_with(self.consumers.len(), Patch::default);
        let removed = removed.iter().map(|&vertex| self.rider(seats, vertex));
        if parts.len() == 1 {
            for rider in &mut patch.riders {
                *rider = self.rider(seats, rider.vertex);
            }
            patch.riders.extend(removed);
            parts[0] = patch;
        } else {
            let riders = patch.riders.iter();
            let riders = riders.map(|rider| self.rider(seats, rider.vertex));
            for rider in riders.chain(removed) {
                let part = self.part_of[seats[rider.vertex as usize] as usize];
                parts[part as usize].riders.push(rider);
            }
            self.divide_triangles(ruler, seats, &patch, &mut parts);
        }
        self.consumers.iter().copied().zip(parts).collect()
    }

    fn rider(&self, seats: &Seats, vertex: u32) -> Rider {
        let on = self.nearest_corner(seats[vertex as usize], vertex);
        Rider { vertex, on }
    }

    fn nearest_corner(&self, triangle: u32, vertex: u32) -> u32 {
        let point = self.surface.position(vertex);
        let corners = self.surface.corners()[triangle as usize];
        let distance = |corner: u32| self.surface.position(corner).distance_squared(point);
        let [a, b, c] = corners.map(distance);
        if a <= b && a <= c {
            corners[0]
        } else if b <= c {
            corners[1]
        } else {
            corners[2]
        }
    }

    fn divide_triangles(
        &self,
        ruler: &Ruler<'_>,
        seats: &Seats,
        patch: &Patch,
        parts: &mut [Patch],
    ) {
        let part_at = |vertex: u32| match seats[vertex as usize] {
            NONE => NONE,
            seat => self.part_of[seat as usize],
        };
        for triangle in patch.triangles() {
            let [a, b, c] = ruler.source.corners()[triangle as usize].map(part_at);
            if a == b && b == c && a != NONE {
                parts[a as usize].inside.push(triangle);
                continue;
            }
            let mut give = |part: u32| {
                if part != NONE {
                    parts[part as usize].across.push(triangle);
                }
            };
            give(a);
            give(if b == a { NONE } else { b });
            give(if c == a || c == b { NONE } else { c });
        }
    }
}
