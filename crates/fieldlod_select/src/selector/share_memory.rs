//! What is visible of the groups of one instance, from frame to frame.

use crate::bits::{CHUNK, LANES, is_set};
use crate::settings::LodSettings;
use crate::shares::{FULL_SHARE, Shares};

/// Shares that rise at once and fall late, in steps of [`FULL_SHARE`], eight groups to an element.
///
/// ```text
/// a group that was not refined, or of which as much is seen or more: the share is what is seen now
/// else: once `hold_frames` frames in a row saw less, the most that they and this frame saw
/// ```
#[derive(Debug, Default)]
pub(super) struct ShareMemory {
    held: Vec<[u8; LANES]>,
    /// The most seen since less than `held` was, and for how many frames.
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
            let (peak, waited) = (&mut peaks[group], &mut waits[group]);
            if now >= before || !is_set(refined, group) {
                (*held, *waited) = (now, 0);
            } else {
                *peak = if *waited == 0 { now } else { now.max(*peak) };
                if *waited >= hold_frames {
                    (*held, *waited) = (*peak, 0);
                } else {
                    *waited += 1;
                }
            }
            self.is_settled &= *held == now;
            if *held != before && last_changed != Some(group / CHUNK) {
                last_changed = Some(group / CHUNK);
                changed(group / CHUNK);
            }
        }
    }
}
