//! What is visible of the groups of one instance, from frame to frame.

use std::array::from_fn;

use crate::bits::{CHUNK, LANES, is_set};
use crate::settings::LodSettings;
use crate::shares::{FULL_SHARE, HIDDEN, Shares};

/// A share that rises at once and falls late, in steps of [`FULL_SHARE`].
///
/// ```text
/// of what was not refined, or of which as much is seen or more: what is seen now
/// else: once `hold_frames` frames in a row saw less, the most that they and this frame saw
/// ```
struct HeldShare<'a> {
    held: &'a mut u8,
    /// The most seen since less than `held` was, and for how many frames.
    peak: &'a mut u8,
    waited: &'a mut u8,
}

impl HeldShare<'_> {
    fn update(self, now: u8, was_refined: bool, hold_frames: u8) {
        if now >= *self.held || !was_refined {
            (*self.held, *self.waited) = (now, 0);
            return;
        }
        *self.peak = match *self.waited {
            0 => now,
            _ => now.max(*self.peak),
        };
        if *self.waited >= hold_frames {
            (*self.held, *self.waited) = (*self.peak, 0);
        } else {
            *self.waited += 1;
        }
    }
}

/// What counts of a mesh that is drawn as a whole: one held share for all levels that are refined. Finer ones count
/// what is seen now.
///
/// The more of a level counts the more does its error: an answer holds as long as no more is seen and no less is held.
#[derive(Clone, Copy, Debug)]
pub(super) struct LevelShare {
    now: u8,
    held: u8,
    peak: u8,
    waited: u8,
    /// Of the last answer.
    decided_now: u8,
    decided_held: u8,
}

impl LevelShare {
    /// Begins with what is seen now.
    pub(super) fn seen(now: u8) -> Self {
        Self {
            now,
            held: now,
            peak: now,
            waited: 0,
            decided_now: now,
            decided_held: now,
        }
    }

    /// Goes on to another frame, after one in which something was refined or not. Whether the last answer may be
    /// another one for it.
    pub(super) fn update(&mut self, now: u8, was_refined: bool, hold_frames: u8) -> bool {
        self.now = now;
        let held = HeldShare {
            held: &mut self.held,
            peak: &mut self.peak,
            waited: &mut self.waited,
        };
        held.update(now, was_refined, hold_frames);
        self.now > self.decided_now || was_refined && self.held < self.decided_held
    }

    /// Notes that there is an answer for this frame.
    pub(super) fn note_decided(&mut self) {
        (self.decided_now, self.decided_held) = (self.now, self.held);
    }

    /// Whether the next frame changes nothing if it sees the same.
    pub(super) fn is_settled(&self) -> bool {
        self.held == self.now
    }

    /// What is seen now.
    pub(super) fn now(&self) -> u8 {
        self.now
    }

    /// Whether nothing is seen now.
    pub(super) fn is_hidden(&self) -> bool {
        self.now <= HIDDEN
    }

    /// The steps of all levels, of which those from `refined_from` on are refined.
    pub(super) fn steps(&self, refined_from: usize) -> [[u8; LANES]; CHUNK / LANES] {
        let step = |level: usize| {
            if level < refined_from {
                self.now
            } else {
                self.held
            }
        };
        from_fn(|block| from_fn(|lane| step(block * LANES + lane)))
    }
}

/// The [held shares](HeldShare) of groups, eight to an element.
#[derive(Debug, Default)]
pub(super) struct ShareMemory {
    held: Vec<[u8; LANES]>,
    peak: Vec<[u8; LANES]>,
    waited: Vec<[u8; LANES]>,
    /// Whether `held` is what is seen.
    is_settled: bool,
    /// What was seen last, if it was the same of all groups.
    last_of_all: Option<u8>,
}

/// What a frame sees of an instance's groups.
#[derive(Clone, Copy, Debug)]
pub(super) enum SeenShares<'a> {
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
    pub(super) fn with_capacity(words: usize) -> Self {
        let blocks = || Vec::with_capacity(words * LANES);
        Self {
            held: blocks(),
            peak: blocks(),
            waited: blocks(),
            ..Self::default()
        }
    }

    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        self.held.capacity() + self.peak.capacity() + self.waited.capacity()
    }

    /// Nothing is hidden, and nothing remembered.
    pub(super) fn clear(&mut self) {
        self.held.clear();
    }

    pub(super) fn is_empty(&self) -> bool {
        self.held.is_empty()
    }

    /// Whether the next frame changes nothing if it sees the same.
    pub(super) fn is_settled(&self) -> bool {
        self.is_settled
    }

    /// What was seen last, if it was the same of all groups.
    pub(super) fn last_of_all(&self) -> Option<u8> {
        self.last_of_all
    }

    /// What decisions under some settings read.
    pub(super) fn shares(&self, settings: &LodSettings) -> Shares<'_> {
        match &settings.visible_flux {
            Some(flux) => Shares::new(&self.held, flux.least_share),
            None => Shares::FULL,
        }
    }

    /// Begins with what is seen now.
    pub(super) fn begin(&mut self, words: usize, seen: &SeenShares) {
        for steps in [&mut self.held, &mut self.peak, &mut self.waited] {
            steps.clear();
            steps.resize(words * LANES, [0; LANES]);
        }
        for (group, held) in self.held.as_flattened_mut().iter_mut().enumerate() {
            *held = seen.of(group);
        }
        self.is_settled = true;
        self.last_of_all = seen.of_all();
    }

    /// Goes on to another frame; `refined` has the bits of the last cut. Calls `changed` for each word
    /// with another share than before.
    pub(super) fn update(
        &mut self,
        seen: &SeenShares,
        refined: &[u64],
        hold_frames: u8,
        mut changed: impl FnMut(usize),
    ) {
        let of_all = seen.of_all();
        if self.is_settled && of_all.is_some() && of_all == self.last_of_all {
            return;
        }
        self.last_of_all = of_all;
        self.is_settled = true;
        let peaks = self.peak.as_flattened_mut();
        let waits = self.waited.as_flattened_mut();
        let mut last_changed = None;
        for (group, held) in self.held.as_flattened_mut().iter_mut().enumerate() {
            let (now, before) = (seen.of(group), *held);
            let share = HeldShare {
                held: &mut *held,
                peak: &mut peaks[group],
                waited: &mut waits[group],
            };
            share.update(now, is_set(refined, group), hold_frames);
            self.is_settled &= *held == now;
            if *held != before && last_changed != Some(group / CHUNK) {
                last_changed = Some(group / CHUNK);
                changed(group / CHUNK);
            }
        }
    }
}
