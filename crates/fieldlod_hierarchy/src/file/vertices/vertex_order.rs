//! Codes the index that each new vertex of a section has in the hierarchy.
//!
//! The index of a moved vertex is mostly one more than that of the previous moved vertex. The index of a
//! source vertex is near that of a neighbour. In many meshes, indices of source vertices also follow the
//! parallelogram rule, like positions.

use crate::file::error::FileError;
use crate::file::reader::Reader;
use crate::file::sections::numbers::{self, Kind, unzigzag, zigzag};
use crate::file::vertices::rows::Prediction;

const WHAT: &str = "the vertex order";
/// Limit of the score that chooses between the two rules for source vertices. With a larger limit, the choice adapts to
/// another order later. With a smaller limit, single vertices change the choice.
const MAX_SCORE: i32 = 16;

/// Predicts indices from earlier indices.
struct IndexPredictor {
    source_count: u32,
    last_source: u32,
    last_moved: u32,
    /// Positive if the parallelogram rule was better for recent vertices.
    score: i32,
}

impl IndexPredictor {
    fn new(source_count: u32) -> Self {
        Self {
            source_count,
            last_source: 0,
            last_moved: source_count.wrapping_sub(1),
            score: 0,
        }
    }

    /// Predictions for a source vertex: the index of a neighbour, and the parallelogram rule.
    fn source(&self, indices: &[u32], p: &Prediction) -> [u32; 2] {
        let known = |row: u32| {
            let index = indices.get((row as usize).wrapping_sub(1)).copied();
            index.filter(|&index| index < self.source_count)
        };
        let (a, b, d) = (known(p.a), known(p.b), known(p.d));
        let like = a.or(b).unwrap_or(self.last_source);
        match (a, b, d) {
            (Some(a), Some(b), Some(d)) => [like, a.wrapping_add(b).wrapping_sub(d)],
            _ => [like, like],
        }
    }

    /// Passes the prediction of an index to `code`, which returns the index.
    fn code(
        &mut self,
        indices: &[u32],
        p: &Prediction,
        is_source: bool,
        code: impl FnOnce(u32) -> u32,
    ) -> u32 {
        if !is_source {
            self.last_moved = code(self.last_moved.wrapping_add(1));
            return self.last_moved;
        }
        let [like, in_line] = self.source(indices, p);
        let index = code(if self.score > 0 { in_line } else { like });
        let by_like = zigzag(index.wrapping_sub(like));
        let by_line = zigzag(index.wrapping_sub(in_line));
        // Tools number vertices differently, so recent vertices decide which rule is better.
        self.score += i32::from(by_like > by_line) - i32::from(by_like < by_line);
        self.score = self.score.clamp(-MAX_SCORE, MAX_SCORE);
        self.last_source = index;
        index
    }
}

/// Writes the indices of the targets of `predictions`. Indices below `source_count` belong to source
/// vertices.
pub(crate) fn write(
    bytes: &mut Vec<u8>,
    indices: &[u32],
    predictions: &[Prediction],
    source_count: u32,
) {
    let mut predictor = IndexPredictor::new(source_count);
    let mut are_source = Vec::with_capacity(predictions.len());
    let (mut source, mut moved) = (Vec::new(), Vec::new());
    for p in predictions {
        let index = indices[p.target as usize - 1];
        let is_source = index < source_count;
        are_source.push(u32::from(is_source));
        let differences = if is_source { &mut source } else { &mut moved };
        predictor.code(indices, p, is_source, |guess| {
            differences.push(zigzag(index.wrapping_sub(guess)));
            index
        });
    }
    for numbers in [&are_source, &source, &moved] {
        numbers::write(bytes, numbers, Kind::Residuals);
    }
}

/// Reads the indices of the targets of `predictions` into existing entries of `indices`.
pub(crate) fn read(
    reader: &mut Reader<'_>,
    indices: &mut [u32],
    predictions: &[Prediction],
    source_count: u32,
) -> Result<(), FileError> {
    let are_source = numbers::read(reader, predictions.len(), WHAT)?;
    let count = are_source
        .iter()
        .filter(|&&is_source| is_source != 0)
        .count();
    let mut source = numbers::read(reader, count, WHAT)?.into_iter();
    let mut moved = numbers::read(reader, predictions.len() - count, WHAT)?.into_iter();
    let mut predictor = IndexPredictor::new(source_count);
    for (p, is_source) in predictions.iter().zip(are_source) {
        let differences = if is_source != 0 {
            &mut source
        } else {
            &mut moved
        };
        // The default 0 is never used, because the lists have the counted lengths.
        let difference = unzigzag(differences.next().unwrap_or(0));
        let index = predictor.code(indices, p, is_source != 0, |guess| {
            guess.wrapping_add(difference)
        });
        indices[p.target as usize - 1] = index;
    }
    Ok(())
}
