//! The order of the vertices of a section in the hierarchy.
//!
//! A moved vertex mostly follows the moved one before it. A vertex of the source is near its
//! neighbours, or in line with them: in many meshes the parallelogram rule holds for indices, too.

use crate::file::error::FileError;
use crate::file::reader::Reader;
use crate::file::sections::numbers::{self, Kind, unzigzag, zigzag};
use crate::file::vertices::rows::Prediction;

const WHAT: &str = "the vertex order";
/// How sure the guesser can get that one rule is better than the other.
const MOST_TRUST: i32 = 16;

/// Guesses indices from those that were there before.
struct Guesser {
    source_count: u32,
    last_source: u32,
    last_moved: u32,
    /// Above zero if parallelograms were the better guess of late.
    trust: i32,
}

impl Guesser {
    fn new(source_count: u32) -> Self {
        Self {
            source_count,
            last_source: 0,
            last_moved: source_count.wrapping_sub(1),
            trust: 0,
        }
    }

    /// The guesses for the target of `p`, if it is a vertex of the source: like a neighbour, and in
    /// line with its neighbours.
    fn source(&self, indices: &[u32], p: &Prediction) -> [u32; 2] {
        let known = |place: u32| {
            let index = indices.get((place as usize).wrapping_sub(1)).copied();
            index.filter(|&index| index < self.source_count)
        };
        let (a, b, d) = (known(p.a), known(p.b), known(p.d));
        let like = a.or(b).unwrap_or(self.last_source);
        match (a, b, d) {
            (Some(a), Some(b), Some(d)) => [like, a.wrapping_add(b).wrapping_sub(d)],
            _ => [like, like],
        }
    }

    /// Codes an index as its difference to what is guessed, by `code`, which returns the index.
    fn see(
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
        let index = code(if self.trust > 0 { in_line } else { like });
        let by_like = zigzag(index.wrapping_sub(like));
        let by_line = zigzag(index.wrapping_sub(in_line));
        self.trust += i32::from(by_like > by_line) - i32::from(by_like < by_line);
        self.trust = self.trust.clamp(-MOST_TRUST, MOST_TRUST);
        self.last_source = index;
        index
    }
}

/// Codes the indices of the targets of `predictions`, of which those below `source_count` are of the
/// source.
pub(in crate::file) fn write(
    bytes: &mut Vec<u8>,
    indices: &[u32],
    predictions: &[Prediction],
    source_count: u32,
) {
    let mut guesser = Guesser::new(source_count);
    let mut are_source = Vec::with_capacity(predictions.len());
    let (mut source, mut moved) = (Vec::new(), Vec::new());
    for p in predictions {
        let index = indices[p.target as usize - 1];
        let is_source = index < source_count;
        are_source.push(u32::from(is_source));
        let differences = if is_source { &mut source } else { &mut moved };
        guesser.see(indices, p, is_source, |guess| {
            differences.push(zigzag(index.wrapping_sub(guess)));
            index
        });
    }
    for numbers in [&are_source, &source, &moved] {
        numbers::write(bytes, numbers, Kind::Remainders);
    }
}

/// Reads the indices of the targets of `predictions` into `indices`, which has room for them.
pub(in crate::file) fn read(
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
    let mut guesser = Guesser::new(source_count);
    for (p, is_source) in predictions.iter().zip(are_source) {
        let differences = if is_source != 0 {
            &mut source
        } else {
            &mut moved
        };
        // There are as many as were counted.
        let difference = unzigzag(differences.next().unwrap_or(0));
        let index = guesser.see(indices, p, is_source != 0, |guess| {
            guess.wrapping_add(difference)
        });
        indices[p.target as usize - 1] = index;
    }
    Ok(())
}
