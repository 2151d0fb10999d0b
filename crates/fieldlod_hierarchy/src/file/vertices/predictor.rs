//! Derives predictions of new vertices from triangles.

use crate::file::sections::triangles::Step;
use crate::file::vertices::rows::Prediction;

/// Chooses the vertices from which each new vertex is predicted.
pub(crate) struct Predictor {
    /// The first `count` entries are valid. There is one more entry than new vertices, which `add` may
    /// overwrite.
    predictions: Vec<Prediction>,
    count: usize,
    /// Number of vertices of earlier sections.
    first: u32,
    /// Whether vertices are known: one entry for all vertices of earlier sections, then one for each new vertex.
    known: Vec<bool>,
}

impl Predictor {
    /// Creates a predictor for `count` new vertices after `first` known vertices.
    pub(crate) fn new(first: usize, count: usize) -> Self {
        let mut known = vec![false; count + 1];
        known[0] = true;
        Self {
            first: first as u32,
            predictions: vec![Prediction::like(0, 0); count + 1],
            count: 0,
            known,
        }
    }

    fn is_known(&self, vertex: u32) -> bool {
        self.known[(vertex + 1).saturating_sub(self.first) as usize]
    }

    /// Adds the prediction of a vertex, unless it is known. Branchless, because known vertices occur irregularly.
    fn add(&mut self, prediction: Prediction) {
        let known = &mut self.known[prediction.target.saturating_sub(self.first) as usize];
        self.predictions[self.count] = prediction;
        self.count += usize::from(!*known);
        *known = true;
    }

    /// Predicts the new vertices of a triangle. `vertices` is the list of its unit.
    pub(crate) fn add_triangle(&mut self, step: Step, vertices: &[u32]) {
        let [a, b, c] = step.corners;
        let vertex = |corner: u16| vertices[usize::from(corner)];
        if let Some(opposite) = step.opposite {
            let (a, b, d) = (vertex(a) + 1, vertex(b) + 1, vertex(opposite) + 1);
            let target = vertex(c) + 1;
            self.add(Prediction { target, a, b, d });
            return;
        }
        let corners = [vertex(a), vertex(b), vertex(c)];
        // Without a shared edge, a vertex is near the other corners of its triangle.
        for corner in corners {
            if !self.is_known(corner) {
                let known = corners.into_iter().find(|&corner| self.is_known(corner));
                let like = known.map_or_else(|| self.latest(), |corner| corner + 1);
                self.add(Prediction::like(corner + 1, like));
            }
        }
    }

    /// The row of the last predicted vertex, or of the last known vertex. 0 without vertices.
    fn latest(&self) -> u32 {
        match self.predictions[..self.count].last() {
            Some(prediction) => prediction.target,
            None => self.first,
        }
    }

    /// Predicts the vertices of a unit that none of its triangles use.
    pub(crate) fn finish_unit(&mut self, vertices: &[u32]) {
        for &vertex in vertices {
            if !self.is_known(vertex) {
                self.add(Prediction::like(vertex + 1, self.latest()));
            }
        }
    }

    /// Predicts the last `unused` vertices, which no unit uses, and returns all predictions.
    pub(crate) fn finish(mut self, unused: usize) -> Vec<Prediction> {
        let end = self.first + self.known.len() as u32;
        for row in end - unused as u32..end {
            self.add(Prediction::like(row, self.latest()));
        }
        self.predictions.truncate(self.count);
        self.predictions
    }
}
