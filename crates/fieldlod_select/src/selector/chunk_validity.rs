//! For how long the answers of one instance stay valid, 64 groups at a time.

use crate::bits::{LANES, set_bits_of};
use crate::validity::{CameraTravel, Levers, Tolerance, Validity};

/// The move that is tolerated first, as a share of the greatest distance, and the most.
const FIRST_TOLERANCE: f32 = 0.01;
const LARGEST_TOLERANCE: f32 = 0.25;
/// How tolerances grow where most answers stay valid, and shrink where few do.
const GROWTH: f32 = 1.3;
const SHRINKAGE: f32 = 0.6;

/// How far points may have moved in camera space until each word's bits must be decided anew.
///
/// A word's bits follow from the pose and from which of its groups were refined: its validity ends when
/// either changes. All words of an instance count turns at the same distance, so that one number is
/// enough for each.
#[derive(Debug, Default)]
pub(super) struct ChunkValidity {
    until: Vec<f64>,
    /// At least as far as any group was when a validity began.
    max_distance: f32,
    /// The move to tolerate when answers are sought next, in world units.
    tolerance: f32,
    /// The travel that `until` can be compared with; `None` after something happened to the instance.
    since: Option<CameraTravel>,
    sought: u32,
    stay_valid: u32,
}

impl ChunkValidity {
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

    /// Nothing is valid any more.
    pub(super) fn forget(&mut self) {
        self.since = None;
    }

    /// Gets ready for a frame, in which the farthest group is `farthest` away. `last_step` is the
    /// camera's last travel, less than which is not worth tolerating.
    pub(super) fn begin(
        &mut self,
        words: usize,
        farthest: f32,
        now: &CameraTravel,
        last_step: &CameraTravel,
    ) {
        // Nothing is valid through another lens, or where a group may be farther than was thought.
        let is_comparable = self.since.is_some_and(|since| since.has_same_lens(now));
        if !is_comparable || self.until.len() != words || self.max_distance < farthest {
            self.until.clear();
            self.until.resize(words, f64::NEG_INFINITY);
            self.since = Some(*now);
            self.max_distance = farthest * 1.1;
            self.tolerance = self.max_distance * FIRST_TOLERANCE;
        }
        // At least two frames of this pace.
        let least = 2.0 * last_step.of_points_within(self.max_distance) as f32;
        let largest = self.max_distance * LARGEST_TOLERANCE;
        self.tolerance = self.tolerance.min(largest).max(least);
        (self.sought, self.stay_valid) = (0, 0);
    }

    /// How far points may move, and by how much the camera may turn within that.
    pub(super) fn tolerance(&self) -> Tolerance {
        Tolerance {
            moved: self.tolerance,
            turned: self.tolerance / self.max_distance,
            zoomed: 0.0,
        }
    }

    /// Of eight words from `first` on, a bit for each that is not valid any more. All where the travel
    /// is not a number.
    pub(super) fn ended(&self, first: usize, now: &CameraTravel) -> u32 {
        let moved = now.of_points_within(self.max_distance);
        let words = self.until[first..].iter().take(LANES);
        words
            .enumerate()
            .map(|(index, until)| u32::from(*until <= moved || moved.is_nan()) << index)
            .sum()
    }

    /// Notes which new answers stay valid: bits of the words from `first` on.
    pub(super) fn put(&mut self, first: usize, asked: u32, valid: u32, now: &CameraTravel) {
        self.sought += asked.count_ones();
        self.stay_valid += valid.count_ones();
        let moved = now.of_points_within(self.max_distance);
        let until = moved + f64::from(self.tolerance * 0.999);
        for word in set_bits_of(asked) {
            let is_valid = valid >> word & 1 == 1;
            self.until[first + word] = if is_valid { until } else { f64::NEG_INFINITY };
        }
    }

    /// Ends the validity of a word, if it has begun.
    pub(super) fn end(&mut self, word: usize) {
        if let Some(until) = self.until.get_mut(word) {
            *until = f64::NEG_INFINITY;
        }
    }

    /// For how long all words are valid. Chooses the next tolerance by how many of the answers were.
    pub(super) fn finish(&mut self, now: &CameraTravel) -> Validity {
        if self.stay_valid * 4 >= self.sought * 3 {
            self.tolerance *= GROWTH;
        } else if self.stay_valid * 2 < self.sought {
            self.tolerance *= SHRINKAGE;
        }
        let first = self.until.iter().copied().fold(f64::INFINITY, f64::min);
        let tolerance = first - now.of_points_within(self.max_distance);
        let levers = Levers {
            turn: self.max_distance,
            zoom: f32::INFINITY,
        };
        Validity::tolerating(tolerance, &levers, now)
    }
}
