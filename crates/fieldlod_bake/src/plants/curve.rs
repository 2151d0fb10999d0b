//! Nearest neighbours of elements, searched along a space-filling curve.

use std::cmp::Ordering;

use crate::mesh::adapter;
use crate::mesh::components::Component;

/// Number of elements that are searched in each direction along the curve. The nearest element may lie outside.
/// At 12, levels differ by 0.3 % more from the source; at 48 by 0.2 % less. With the truly nearest element, errors at
/// equal triangles are 1 % larger.
const MAX_STEPS: usize = 24;
const NONE: u32 = u32::MAX;

/// A linked list of elements in curve order.
pub(crate) struct Curve {
    /// For each element, the element on either side, or [`NONE`].
    previous: Vec<u32>,
    next: Vec<u32>,
}

impl Curve {
    pub(crate) fn through(elements: &[Component]) -> Self {
        let points: Vec<[f32; 3]> = elements.iter().map(|e| e.centroid.to_array()).collect();
        let mut order = vec![0u32; elements.len()];
        let places = meshopt::spatial_sort_remap(&adapter(&points));
        for (element, place) in (0..).zip(places) {
            order[place as usize] = element;
        }
        let mut curve = Self {
            previous: vec![NONE; elements.len()],
            next: vec![NONE; elements.len()],
        };
        for pair in order.windows(2) {
            curve.next[pair[0] as usize] = pair[1];
            curve.previous[pair[1] as usize] = pair[0];
        }
        curve
    }

    /// The nearest element among the neighbours on the curve. `None` if no other element is left.
    pub(crate) fn nearest(&self, index: usize, elements: &[Component]) -> Option<usize> {
        let others = self.neighbours(index).into_iter();
        others.min_by(|a, b| by_distance(elements, index, *a, *b))
    }

    /// The `count` nearest elements among the neighbours on the curve.
    pub(crate) fn nearest_of(
        &self,
        index: usize,
        elements: &[Component],
        count: usize,
    ) -> Vec<usize> {
        let mut others = self.neighbours(index);
        others.sort_by(|a, b| by_distance(elements, index, *a, *b));
        others.truncate(count);
        others
    }

    /// Neighbours on the curve are near in space in most cases, and are found without a search tree that would have to
    /// change with each pruned element.
    fn neighbours(&self, index: usize) -> Vec<usize> {
        let along = |next: &'_ [u32]| {
            let step = |at: &u32| Some(next[*at as usize]).filter(|at| *at != NONE);
            let others = std::iter::successors(step(&(index as u32)), step);
            let others = others.take(MAX_STEPS).map(|other| other as usize);
            others.collect::<Vec<usize>>()
        };
        [along(&self.previous), along(&self.next)].concat()
    }

    pub(crate) fn remove(&mut self, index: usize) {
        let (previous, next) = (self.previous[index], self.next[index]);
        if previous != NONE {
            self.next[previous as usize] = next;
        }
        if next != NONE {
            self.previous[next as usize] = previous;
        }
    }
}

/// Compares two elements by their distances from a third.
fn by_distance(elements: &[Component], from: usize, a: usize, b: usize) -> Ordering {
    let own = elements[from].centroid;
    let distance = |other: usize| elements[other].centroid.distance_squared(own);
    distance(a).total_cmp(&distance(b))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn nearest_skips_removed_elements() {
        let at = |x: f32| Component {
            centroid: Vec3::X * x,
            ..Component::default()
        };
        let elements: Vec<Component> = [0.0, 7.0, 1.0, 3.0].map(at).into();
        let mut curve = Curve::through(&elements);
        assert_eq!(curve.nearest(0, &elements), Some(2));
        curve.remove(2);
        assert_eq!(curve.nearest(0, &elements), Some(3));
        curve.remove(3);
        curve.remove(0);
        assert_eq!(curve.nearest(1, &elements), None);
    }
}
