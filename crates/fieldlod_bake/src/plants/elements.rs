//! Flattening and pruning of the elements of an aggregate. A neighbour replaces a pruned element and gets the mean
//! attributes of both, weighted by their visible pixels.
//!
//! The least visible elements are pruned first: half of an oak's leaves have only a fifth of the visible pixels,
//! because other leaves hide them. Covered area, mean colour and mean normal of the aggregate are kept.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use glam::Vec3;

use crate::levels::simplify::{Method, Simplified, Task};
use crate::mesh::components::Component;
use crate::mesh::edges::Links;
use crate::plants::curve::Curve;

/// Exponent for the growth of an element that replaces another. The base is the visible pixels of both, divided by its
/// own. It is below 1, because large leaves look worse than a few missing leaves; [coverage](crate::plants::coverage)
/// adds growth if needed.
const GROWTH: f32 = 0.6;
/// Share of an element's visible pixels that change if it is flattened. With larger shares, more elements are pruned:
/// at 0.8, crowns have 10 to 20 % more error at equal triangles. Without flattening, palms have 16 % more RMSE.
const FLATTENING_COST: f32 = 0.4;
/// Open elements with more triangles keep the borders of the source. They may be split between groups, and each group
/// would move its part differently. At 8 and 32, palms' errors change by less than 3 %.
pub(crate) const MAX_SMALL_ELEMENT: usize = 16;
/// Number of an element's vertices that may be corners of the flattened element. The time grows with its third power.
/// Most leaves have fewer vertices.
const MOST_CORNERS: usize = 128;

impl Task<'_> {
    /// Flattens and prunes elements, down to `wanted` triangles if possible. The step that changes the fewest visible
    /// pixels per saved triangle comes first.
    pub(crate) fn flatten_and_prune(
        &self,
        simplified: &mut Simplified,
        mut elements: Vec<Component>,
        wanted: f32,
    ) -> Vec<Component> {
        let mut left: usize = elements.iter().map(|element| element.triangles.len()).sum();
        let mut curve = Curve::through(&elements);
        let mut flat = self.flattenings(&elements);
        let first = (0..elements.len()).map(|index| Step::of(index, &elements, &flat));
        // The cheapest step comes first.
        let mut steps: BinaryHeap<Reverse<Step>> = first.map(Reverse).collect();
        while left as f32 > wanted
            && let Some(Reverse(step)) = steps.pop()
        {
            let index = step.element;
            let is_gone = elements[index].triangles.is_empty();
            // Neighbours that replaced others have new costs. Their older entries in the heap are skipped.
            if is_gone || step != Step::of(index, &elements, &flat) {
                continue;
            }
            let before = elements[index].triangles.len();
            if simplified.method == Method::Pieces {
                // Pieces of a kit are seen one by one, so each must be small where it changes.
                let error = simplified.error_in_scaled;
                simplified.error_in_scaled = error.max(elements[index].radius);
            }
            let changed = if step.is_flattening
                && let Some(flat) = flat[index].take()
            {
                self.flatten(simplified, &mut elements[index], flat);
                index
            } else if let Some(nearest) = curve.nearest(index, &elements) {
                let pruned = std::mem::take(&mut elements[index]);
                curve.remove(index);
                self.replace_pruned(simplified, &mut elements[nearest], &pruned);
                simplified.is_pruned = true;
                nearest
            } else {
                continue;
            };
            left -= before - elements[index].triangles.len();
            steps.push(Reverse(Step::of(changed, &elements, &flat)));
        }
        elements.retain(|element| !element.triangles.is_empty());
        elements
    }

    /// How each element is flattened; `None` if it keeps its shape.
    fn flattenings(&self, elements: &[Component]) -> Vec<Option<Flat>> {
        let first = |own: u32| self.same_position[own as usize];
        let mut links = Links::of(self.piece.vertices.len());
        links.add(elements.iter().flat_map(Component::corners).map(first));
        let of_element = |element: &Component| {
            let is_open = element.corners().any(|own| links.is_open(first(own)));
            if is_open {
                return self.is_leaf_cut_out(element).then_some(Flat::OneSide);
            }
            // The element may be seen from anywhere, and a closed element stays closed.
            Some(Flat::BothSides)
        };
        elements.iter().map(of_element).collect()
    }

    /// Replaces an element by the largest triangle between its vertices, with the area of its opaque part.
    fn flatten(&self, simplified: &mut Simplified, element: &mut Component, flat: Flat) {
        let vertices = element.vertices();
        let step = vertices.len().div_ceil(MOST_CORNERS);
        let corners: Vec<u32> = vertices.into_iter().step_by(step).collect();
        let Some([a, b, c]) = largest_triangle(&corners, &simplified.positions) else {
            return;
        };
        let before = element.clone();
        let mean = self.mean_row(&simplified.rows, &before);
        let opaque = self.opaque_part(simplified, &before);
        element.triangles = match flat {
            Flat::BothSides => vec![[a, b, c], [a, c, b]],
            Flat::OneSide if opaque.is_none() => return,
            Flat::OneSide => vec![[a, b, c]],
        };
        let front = before.area_vector(&simplified.positions);
        if front.dot(element.area_vector(&simplified.positions)) < 0.0 {
            element.triangles = vec![[a, c, b]];
        }
        element.measure(&simplified.positions);
        let (mut area, mut centroid) = (before.area, before.centroid);
        if let Some(part) = opaque {
            (area, centroid) = (part.area, part.centroid);
            self.set_uvs(simplified, [a, b, c], &part.row);
        }
        self.fit(simplified, element, area * self.area_gain, centroid, &mean);
    }

    /// Grows an element, and mixes its attributes, to replace a pruned element.
    fn replace_pruned(
        &self,
        simplified: &mut Simplified,
        element: &mut Component,
        pruned: &Component,
    ) {
        let visible_px = element.visible_px + pruned.visible_px;
        let share = if visible_px > 0.0 {
            pruned.visible_px / visible_px
        } else {
            0.0
        };
        let own = self.mean_row(&simplified.rows, element);
        let other = self.mean_row(&simplified.rows, pruned);
        let mixed = own.iter().zip(&other);
        let mean: Vec<f32> = mixed.map(|(x, y)| x + (y - x) * share).collect();
        // `1 - share` is the own share, so its inverse is the base of the exponent.
        let growth = if simplified.method == Method::Pieces {
            (1.0 - share).recip()
        } else {
            (1.0 - share).recip().powf(GROWTH)
        };
        let grown = element.area * growth * self.area_gain;
        self.fit(simplified, element, grown, element.centroid, &mean);
        element.visible_px = visible_px;
    }

    /// Scales and moves an element to the given area and centroid, and adapts its colours and normals to the given
    /// mean.
    pub(crate) fn fit(
        &self,
        simplified: &mut Simplified,
        element: &mut Component,
        area: f32,
        centroid: Vec3,
        mean: &[f32],
    ) {
        let factor = (area / element.area).sqrt();
        let is_large = element.triangles.len() > MAX_SMALL_ELEMENT;
        if !factor.is_finite() || is_large && element.corners().any(|own| self.is_border(own)) {
            return;
        }
        let layout = &self.vertices.layout;
        let width = layout.width();
        let own_mean = self.mean_row(&simplified.rows, element);
        for own in element.vertices().into_iter().map(|own| own as usize) {
            let position = Vec3::from(simplified.positions[own]);
            let fitted = centroid + (position - element.centroid) * factor;
            simplified.positions[own] = fitted.to_array();
            layout.shift_mean(
                &mut simplified.rows[own * width..][..width],
                &own_mean,
                mean,
            );
            simplified.is_new[own] = true;
        }
        element.measure(&simplified.positions);
    }

    /// Mean attributes of an element over its triangle corners.
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

/// The largest triangle between three of the vertices.
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

/// What an element becomes when it is flattened.
#[derive(Clone, Copy)]
enum Flat {
    /// Both sides of a triangle.
    BothSides,
    /// One triangle.
    OneSide,
}

impl Flat {
    fn triangles(self) -> usize {
        match self {
            Self::BothSides => 2,
            Self::OneSide => 1,
        }
    }
}

/// The next step for an element: flattening or pruning.
#[derive(Clone, Copy, PartialEq)]
struct Step {
    /// Visible pixels that change per saved triangle.
    cost: f32,
    element: usize,
    /// `false` for pruning.
    is_flattening: bool,
}

impl Step {
    /// The cheaper of both steps.
    fn of(index: usize, elements: &[Component], flat: &[Option<Flat>]) -> Self {
        let element = &elements[index];
        let count = element.triangles.len() as f32;
        let pruned = element.visible_px / count;
        // Some triangles remain after flattening, so it saves less than pruning.
        let saved = flat[index].map_or(0.0, |flat| count - flat.triangles() as f32);
        let flattened = FLATTENING_COST * element.visible_px / saved;
        let is_flattening = saved > 0.0 && flattened < pruned;
        Self {
            cost: if is_flattening { flattened } else { pruned },
            element: index,
            is_flattening,
        }
    }
}

impl Eq for Step {}

impl PartialOrd for Step {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Step {
    fn cmp(&self, other: &Self) -> Ordering {
        // Ties are broken by index: the order of equal costs must not depend on the heap.
        let by_cost = self.cost.total_cmp(&other.cost);
        by_cost.then(self.element.cmp(&other.element))
    }
}
