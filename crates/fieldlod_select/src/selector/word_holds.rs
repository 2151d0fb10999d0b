//! For how long the answers of one instance hold, 64 groups at a time.

use crate::hold::{Hold, Odometer};
use crate::table::set_bits_of;

/// The way that is asked for first, as a share of the reach, and the most.
const FIRST_WAY: f32 = 0.01;
const LONGEST_WAY: f32 = 0.25;
/// How ways grow where most answers hold, and shrink where few do.
const GROWTH: f32 = 1.3;
const SHRINKAGE: f32 = 0.6;

/// Where the odometer stands when each word's bits must be decided anew.
///
/// A word's bits follow from the pose and from which of its groups were refined: a hold ends when either
/// changes. All words of an instance count turns by the same reach, so that one number is enough for
/// each.
#[derive(Debug, Default)]
pub(super) struct WordHolds {
    until: Vec<f64>,
    /// At least as far as any group was when a hold began.
    reach: f32,
    /// The way asked for when answers are sought next, in world units.
    way: f32,
    /// The odometer's run; none after something happened to the instance.
    run: Option<Odometer>,
    sought: u32,
    held: u32,
}

impl WordHolds {
    pub(super) fn with_capacity(words: usize) -> Self {
        Self {
            until: Vec::with_capacity(words),
            ..Self::default()
        }
    }

    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        self.until.capacity()
    }

    /// Nothing holds.
    pub(super) fn forget(&mut self) {
        self.run = None;
    }

    /// Gets ready for a frame, in which the farthest group is `farthest` away. `last_step` is the
    /// odometer's last step, less than which no hold is worth asking for.
    pub(super) fn begin(
        &mut self,
        words: usize,
        farthest: f32,
        now: &Odometer,
        last_step: &Odometer,
    ) {
        let is_same_run = self.run.is_some_and(|run| run.is_same_run(now));
        if !is_same_run || self.until.len() != words || self.reach < farthest {
            self.until.clear();
            self.until.resize(words, f64::NEG_INFINITY);
            self.run = Some(*now);
            self.reach = farthest * 1.1;
            self.way = self.reach * FIRST_WAY;
        }
        let least = 2.0 * last_step.reading(self.reach) as f32;
        self.way = self.way.min(self.reach * LONGEST_WAY).max(least);
        (self.sought, self.held) = (0, 0);
    }

    pub(super) fn way(&self) -> f32 {
        self.way
    }

    /// Of eight words from `first` on, a bit for each that holds no longer. All where the reading
    /// is not a number.
    pub(super) fn ended(&self, first: usize, now: &Odometer) -> u32 {
        let reading = now.reading(self.reach);
        let words = self.until[first..].iter().take(8);
        words
            .enumerate()
            .map(|(index, until)| u32::from(*until <= reading || reading.is_nan()) << index)
            .sum()
    }

    /// Takes over which new answers hold on the way: bits of the words from `first` on.
    pub(super) fn put(&mut self, first: usize, asked: u32, held: u32, now: &Odometer) {
        self.sought += asked.count_ones();
        self.held += held.count_ones();
        let until = now.reading(self.reach) + f64::from(self.way * 0.999);
        for word in set_bits_of(asked) {
            let holds = held >> word & 1 == 1;
            self.until[first + word] = if holds { until } else { f64::NEG_INFINITY };
        }
    }

    /// Ends the hold of a word.
    pub(super) fn end(&mut self, word: usize) {
        self.until[word] = f64::NEG_INFINITY;
    }

    /// For how long all words hold. Chooses the next way by how many of the answers did.
    pub(super) fn finish(&mut self, now: &Odometer) -> Hold {
        if self.held * 4 >= self.sought * 3 {
            self.way *= GROWTH;
        } else if self.held * 2 < self.sought {
            self.way *= SHRINKAGE;
        }
        let first = self.until.iter().copied().fold(f64::INFINITY, f64::min);
        Hold::until(first, self.reach, now)
    }
}
