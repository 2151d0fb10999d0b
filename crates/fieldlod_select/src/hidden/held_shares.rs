//! What counts as visible from frame to frame: a share that rises at once and falls late.
//!
//! ```text
//! of what was not refined, or of which as much is seen or more: what is seen now
//! else: what is seen once `hold_frames` frames in a row saw less
//! ```

use crate::hidden::shares::{FULL_SHARE, Shares};
use crate::lanes::bits::{LANES, is_set};
use crate::settings::LodSettings;

/// Goes on to another frame with a share in steps and the count of frames that saw less.
fn update(held: &mut u8, waited: &mut u8, now: u8, was_refined: bool, hold_frames: u8) {
    if now >= *held || !was_refined || *waited >= hold_frames {
        (*held, *waited) = (now, 0);
    } else {
        *waited += 1;
    }
}

/// What counts of a mesh that is drawn as a whole: one held share for all levels that are refined. Finer ones count
/// what is seen now.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LevelShare {
    pub(crate) now: u8,
    held: u8,
    waited: u8,
}

impl LevelShare {
    /// Goes on to another frame, after one in which something was refined or not.
    pub(crate) fn update(&mut self, now: u8, was_refined: bool, hold_frames: u8) {
        self.now = now;
        update(&mut self.held, &mut self.waited, now, was_refined, hold_frames);
    }

    /// Whether the next frame changes nothing if it sees the same.
    pub(crate) fn is_settled(&self) -> bool {
        self.held == self.now
    }

    /// The steps of all levels, of which those from `refined_from` on are refined.
    pub(crate) fn steps(&self, refined_from: usize) -> LevelSteps {
        let step = |level: usize| match level < refined_from {
            true => self.now,
            false => self.held,
        };
        std::array::from_fn(|block| std::array::from_fn(|lane| step(block * LANES + lane)))
    }
}

/// What counts of the levels of a mesh as a whole, in steps.
pub(crate) type LevelSteps = [[u8; LANES]; LANES];

/// The held shares of groups, eight to an element.
#[derive(Debug, Default)]
pub(crate) struct ShareMemory {
    held: Vec<[u8; LANES]>,
    waited: Vec<[u8; LANES]>,
    /// Whether `held` is what is seen.
    is_settled: bool,
    /// What was seen last, if it was the same of all groups.
    last_of_all: Option<u8>,
}

/// What a frame sees of an instance's groups.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SeenShares<'a> {
    /// The same of all.
    OfAll(u8),
    OfGroups(&'a [u8]),
}

impl SeenShares<'_> {
    fn of(&self, group: usize) -> u8 {
        match self {
            Self::OfAll(share) => *share,
            Self::OfGroups(shares) => shares.get(group).copied().unwrap_or(FULL_SHARE),
        }
    }

    fn of_all(&self) -> Option<u8> {
        match self {
            Self::OfAll(share) => Some(*share),
            Self::OfGroups(_) => None,
        }
    }
}

impl ShareMemory {
    pub(crate) fn with_capacity(words: usize) -> Self {
        let blocks = || Vec::with_capacity(words * LANES);
        Self {
            held: blocks(),
            waited: blocks(),
            ..Self::default()
        }
    }

    #[cfg(test)]
    pub(crate) fn capacity(&self) -> usize {
        self.held.capacity() + self.waited.capacity()
    }

    /// Nothing is hidden, and nothing remembered.
    pub(crate) fn clear(&mut self) {
        self.held.clear();
        self.is_settled = true;
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.held.is_empty()
    }

    /// Whether the next frame changes nothing if it sees the same.
    pub(crate) fn is_settled(&self) -> bool {
        self.is_settled
    }

    /// What decisions under some settings read.
    pub(crate) fn shares(&self, settings: &LodSettings) -> Shares<'_> {
        match &settings.visible_flux {
            Some(flux) => Shares::new(&self.held, flux.least_share),
            None => Shares::FULL,
        }
    }

    /// Begins with what is seen now.
    pub(crate) fn begin(&mut self, words: usize, seen: &SeenShares) {
        for steps in [&mut self.held, &mut self.waited] {
            steps.clear();
            steps.resize(words * LANES, [0; LANES]);
        }
        for (group, held) in self.held.as_flattened_mut().iter_mut().enumerate() {
            *held = seen.of(group);
        }
        self.is_settled = true;
        self.last_of_all = seen.of_all();
    }

    /// Goes on to another frame; `refined` has the bits of the last cut.
    pub(crate) fn update(&mut self, seen: &SeenShares, refined: &[u64], hold_frames: u8) {
        let of_all = seen.of_all();
        if self.is_settled && of_all.is_some() && of_all == self.last_of_all {
            return;
        }
        self.last_of_all = of_all;
        self.is_settled = true;
        let waits = self.waited.as_flattened_mut().iter_mut();
        let shares = self.held.as_flattened_mut().iter_mut().zip(waits);
        for (group, (held, waited)) in shares.enumerate() {
            let now = seen.of(group);
            update(held, waited, now, is_set(refined, group), hold_frames);
            self.is_settled &= *held == now;
        }
    }
}
