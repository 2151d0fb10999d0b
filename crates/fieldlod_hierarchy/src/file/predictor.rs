//! From triangles to predictions: a new vertex is like those of the triangles around it.

use super::planes::Prediction;
use super::triangles::Step;

/// Finds for each new vertex those that it is predicted from.
pub(super) struct Predictor {
    predictions: Vec<Prediction>,
    /// Vertices below this come from coarser sections.
    first: usize,
    /// Of the others: whether they were predicted yet.
    known: Vec<bool>,
}

impl Predictor {
    pub(super) fn new(first: usize) -> Self {
        let (predictions, known) = (Vec::new(), Vec::new());
        Self {
            predictions,
            first,
            known,
        }
    }

    fn is_known(&self, vertex: u32) -> bool {
        match (vertex as usize).checked_sub(self.first) {
            Some(place) => self.known.get(place) == Some(&true),
            None => true,
        }
    }

    fn add(&mut self, prediction: Prediction) {
        // Vertices are counted from 1 there.
        let place = (prediction.target as usize - 1) - self.first;
        if place >= self.known.len() {
            self.known.resize(place + 1, false);
        }
        self.known[place] = true;
        self.predictions.push(prediction);
    }

    /// A triangle of the unit with these `vertices`.
    pub(super) fn see(&mut self, step: Step, vertices: &[u32]) {
        let corners = step.corners.map(|corner| vertices[usize::from(corner)]);
        let [a, b, c] = corners;
        if let Some(opposite) = step.opposite {
            if !self.is_known(c) {
                let d = vertices[usize::from(opposite)] + 1;
                let [target, a, b] = [c + 1, a + 1, b + 1];
                self.add(Prediction { target, a, b, d });
            }
            return;
        }
        for corner in corners {
            if !self.is_known(corner) {
                let neighbour = corners.into_iter().find(|&corner| self.is_known(corner));
                let neighbour = neighbour.map_or_else(|| self.latest(), |corner| corner + 1);
                self.add(Prediction::like(corner + 1, neighbour));
            }
        }
    }

    /// The vertex predicted last, counted from 1; 0 if there is none.
    fn latest(&self) -> u32 {
        match self.predictions.last() {
            Some(prediction) => prediction.target,
            None => self.first as u32,
        }
    }

    /// Vertices of a unit that none of its triangles use.
    pub(super) fn finish_unit(&mut self, vertices: &[u32]) {
        for &vertex in vertices {
            if !self.is_known(vertex) {
                self.add(Prediction::like(vertex + 1, self.latest()));
            }
        }
    }

    pub(super) fn finish(mut self, unused: usize) -> Vec<Prediction> {
        let first = (self.first + self.known.len()) as u32;
        for vertex in first..first + unused as u32 {
            self.add(Prediction::like(vertex + 1, self.latest()));
        }
        self.predictions
    }
}
