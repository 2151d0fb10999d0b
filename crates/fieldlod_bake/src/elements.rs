//! The elements of an aggregate: flattened, and pruned in pairs of neighbours, of which one stays with
//! the mean attributes and the area of both.
//!
//! Pairs of neighbours keep what is left well spread, and which of the two stays is drawn by lot, the
//! larger one more often. So the levels of an aggregate keep its covered area, its mean colour and its
//! mean normal, whatever is left of it.

use glam::Vec3;

use crate::components::Component;
use crate::edges::{Links, number};
use crate::simplify::{Simplified, Task};
use crate::vertices::adapter;

/// How many of the next elements along a curve through space are looked at for the nearest.
const NEIGHBOURS: usize = 24;
/// Of two elements one gets their area, relative to its own, raised to this power, beside what
/// [coverage](crate::coverage) asks for: large leaves look worse than a few that are missing.
const GROWTH: f32 = 0.7;
/// Open elements of more triangles keep their border where the source has it: they may come to lie in several
/// groups, each of which sees a part of it.
pub(crate) const MOST_MOVED_IF_OPEN: usize = 16;
/// Elements grow no more than this when they are flattened.
const MOST_FLATTENED: f32 = 4.0;

impl Task<'_> {
    /// Replaces closed elements of few triangles by both sides of the largest triangle of their corners.
    pub(crate) fn flatten(&self, simplified: &mut Simplified, elements: &mut [Component]) {
        let first = |own: u32| self.same_position[own as usize];
        let mut links = Links::of(self.piece.vertices.len());
        links.add(elements.iter().flat_map(Component::corners).map(first));
        for element in elements {
            let is_open = element.corners().any(|own| links.is_open(first(own)));
            if element.triangles.len() <= 2 || is_open {
                continue;
            }
            let Some([a, b, c]) = largest_triangle(&element.vertices(), &simplified.positions)
            else {
                continue;
            };
            let before = element.clone();
            let mean = self.mean_row(&simplified.rows, &before);
            element.triangles = vec![[a, b, c], [a, c, b]];
            element.measure(&simplified.positions);
            let area = (before.area * self.area_gain).min(element.area * MOST_FLATTENED);
            self.fit(simplified, element, area, before.centroid, &mean);
        }
    }

    /// Prunes one of each pair of neighbours, until no more than `wanted` triangles are left or there
    /// are no pairs any more.
    pub(crate) fn prune_pairs(
        &self,
        simplified: &mut Simplified,
        mut elements: Vec<Component>,
        wanted: f32,
    ) -> Vec<Component> {
        let mut left: usize = elements.iter().map(|element| element.triangles.len()).sum();
        for [a, b] in pairs(&elements) {
            if left as f32 <= wanted {
                break;
            }
            // By lot, so that the mean of many stays what it was.
            let area = elements[a].area + elements[b].area;
            let lot = lot_of(elements[a].triangles[0][0], elements[b].triangles[0][0]);
            let (stays, goes) = if lot * area < elements[a].area {
                (a, b)
            } else {
                (b, a)
            };
            let pruned = std::mem::take(&mut elements[goes]);
            left -= pruned.triangles.len();
            let own = self.mean_row(&simplified.rows, &elements[stays]);
            let other = self.mean_row(&simplified.rows, &pruned);
            let mixed = own
                .iter()
                .zip(&other)
                .map(|(x, y)| x + (y - x) * (pruned.area / area));
            let mean: Vec<f32> = mixed.collect();
            let element = &mut elements[stays];
            let growth = (area / element.area).powf(GROWTH);
            let grown = element.area * growth * self.area_gain;
            self.fit(simplified, element, grown, element.centroid, &mean);
        }
        simplified.is_pruned = true;
        elements.retain(|element| !element.triangles.is_empty());
        elements
    }

    /// Scales and moves an element to have an area and a centroid, and adapts its colours and normals
    /// to have a mean.
    pub(crate) fn fit(
        &self,
        simplified: &mut Simplified,
        element: &mut Component,
        area: f32,
        centroid: Vec3,
        mean: &[f32],
    ) {
        let factor = (area / element.area).sqrt();
        let is_border = |&own: &u32| {
            let vertex = self.piece.vertices[own as usize];
            self.vertices.is_border[vertex as usize]
        };
        let is_large = element.triangles.len() > MOST_MOVED_IF_OPEN;
        if !factor.is_finite() || is_large && element.vertices().iter().any(is_border) {
            return;
        }
        let layout = &self.vertices.layout;
        let width = layout.width();
        let own_mean = self.mean_row(&simplified.rows, element);
        for own in element.vertices().into_iter().map(|own| own as usize) {
            let position = Vec3::from(simplified.positions[own]);
            let fitted = centroid + (position - element.centroid) * factor;
            simplified.positions[own] = fitted.to_array();
            layout.adapt(
                &mut simplified.rows[own * width..][..width],
                &own_mean,
                mean,
            );
            simplified.is_new[own] = true;
        }
        element.measure(&simplified.positions);
    }

    /// The mean of the attributes at the corners of an element.
    pub(crate) fn mean_row(&self, rows: &[f32], element: &Component) -> Vec<f32> {
        let width = self.vertices.layout.width();
        let mut mean = vec![0.0; width];
        for own in element.corners() {
            let row = &rows[own as usize * width..][..width];
            mean.iter_mut()
                .zip(row)
                .for_each(|(sum, number)| *sum += number);
        }
        let share = (element.triangles.len() as f32 * 3.0).recip();
        mean.iter_mut().for_each(|sum| *sum *= share);
        mean
    }
}

/// The triangle of three of the vertices that has most area.
fn largest_triangle(vertices: &[u32], positions: &[[f32; 3]]) -> Option<[u32; 3]> {
    let position = |vertex: u32| Vec3::from(positions[vertex as usize]);
    let mut largest = (0.0f32, None);
    for (at_b, &a) in (1..).zip(vertices) {
        for (at_c, &b) in (at_b + 1..).zip(&vertices[at_b..]) {
            for &c in &vertices[at_c..] {
                let sides = [position(b) - position(a), position(c) - position(a)];
                let area = sides[0].cross(sides[1]).length();
                if area > largest.0 {
                    largest = (area, Some([a, b, c]));
                }
            }
        }
    }
    largest.1
}

/// Pairs of neighbours, each element in one at most; those first of which least changes.
fn pairs(elements: &[Component]) -> Vec<[usize; 2]> {
    // Along a curve through space, each with the nearest of the next.
    let points: Vec<[f32; 3]> = elements.iter().map(|e| e.centroid.to_array()).collect();
    let mut order = vec![0; elements.len()];
    for (element, place) in meshopt::spatial_sort_remap(&adapter(&points))
        .into_iter()
        .enumerate()
    {
        order[place as usize] = element;
    }
    let distance_squared =
        |a: usize, b: usize| elements[a].centroid.distance_squared(elements[b].centroid);
    let mut is_paired = vec![false; elements.len()];
    let mut found: Vec<(f32, [usize; 2])> = Vec::new();
    for (place, &a) in order.iter().enumerate() {
        if is_paired[a] {
            continue;
        }
        let free = order[place + 1..]
            .iter()
            .copied()
            .filter(|&b| !is_paired[b]);
        let nearest = free
            .take(NEIGHBOURS)
            .min_by(|&b, &c| distance_squared(a, b).total_cmp(&distance_squared(a, c)));
        if let Some(b) = nearest {
            (is_paired[a], is_paired[b]) = (true, true);
            let area = elements[a].area + elements[b].area;
            found.push((area * distance_squared(a, b), [a, b]));
        }
    }
    found.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
    found.into_iter().map(|(_, pair)| pair).collect()
}

/// A number from 0 to below 1 that two vertices decide.
fn lot_of(a: u32, b: u32) -> f32 {
    let bits = number(a).wrapping_add(number(b).rotate_left(32)) >> 40;
    bits as f32 / (1u32 << 24) as f32
}
