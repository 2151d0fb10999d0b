//! From triangles to predictions: a new vertex is like those of the triangles around it.

use crate::file::sections::triangles::Step;
use crate::file::vertices::rows::Prediction;

/// Finds for each new vertex those that it is predicted from.
pub(in crate::file) struct Predictor {
    /// One for each new vertex, of which the first `count` were found yet, and room for one more.
    predictions: Vec<Prediction>,
    count: usize,
    /// Whether each vertex comes from a coarser section or was predicted yet.
    known: Vec<bool>,
}

impl Predictor {
    /// For `count` new vertices after the `first`.
    pub(in crate::file) fn new(first: usize, count: usize) -> Self {
        let mut known = vec![true; first];
        known.resize(first + count, false);
        Self {
            predictions: vec![Prediction::like(0, 0); count + 1],
            count: 0,
            known,
        }
    }

    fn is_known(&self, vertex: u32) -> bool {
        self.known[vertex as usize]
    }

    /// Adds the prediction of a vertex, unless it is known. Which of both cannot be foreseen, so
    /// that nothing branches on it.
    fn add(&mut self, prediction: Prediction) {
        // Vertices are counted from 1 there.
        let known = &mut self.known[prediction.target as usize - 1];
        self.predictions[self.count] = prediction;
        self.count += usize::from(!*known);
        *known = true;
    }

    /// A triangle of the unit with these `vertices`.
    pub(in crate::file) fn see(&mut self, step: Step, vertices: &[u32]) {
        let [a, b, c] = step.corners;
        let vertex = |corner: u16| vertices[usize::from(corner)];
        // The parallelogram over a shared edge.
        if let Some(opposite) = step.opposite {
            let (a, b, d) = (vertex(a) + 1, vertex(b) + 1, vertex(opposite) + 1);
            let target = vertex(c) + 1;
            self.add(Prediction { target, a, b, d });
            return;
        }
        let corners = [vertex(a), vertex(b), vertex(c)];
        for corner in corners {
            if !self.is_known(corner) {
                // Like a neighbour that is known, or else like the latest.
                let known = corners.into_iter().find(|&corner| self.is_known(corner));
                let like = known.map_or_else(|| self.latest(), |corner| corner + 1);
                self.add(Prediction::like(corner + 1, like));
            }
        }
    }

    /// The vertex predicted last, or else the last of the coarser sections, counted from 1; 0 if
    /// there is neither.
    fn latest(&self) -> u32 {
        match self.predictions[..self.count].last() {
            Some(prediction) => prediction.target,
            None => (self.known.len() - (self.predictions.len() - 1)) as u32,
        }
    }

    /// Vertices of a unit that none of its triangles use.
    pub(in crate::file) fn finish_unit(&mut self, vertices: &[u32]) {
        for &vertex in vertices {
            if !self.is_known(vertex) {
                self.add(Prediction::like(vertex + 1, self.latest()));
            }
        }
    }

    /// With those for the vertices that no unit uses: the last, `unused` of the new ones.
    pub(in crate::file) fn finish(mut self, unused: usize) -> Vec<Prediction> {
        let end = self.known.len();
        for vertex in end - unused..end {
            self.add(Prediction::like(vertex as u32 + 1, self.latest()));
        }
        self.predictions.truncate(self.count);
        self.predictions
    }
}
