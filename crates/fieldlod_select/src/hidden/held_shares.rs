//! Visible shares from frame to frame: they rise at once and fall late.

use crate::hidden::shares::{FULL_SHARE, Shares};
use crate::lanes::bits::{CHUNK, LANES, is_set};
use crate::settings::LodSettings;

/// A share in steps.
///
/// ```text
/// of what was not refined, or of which as much is seen or more: what is seen now
/// else: once `hold_frames` frames in a row saw less, the most that they and this frame saw
/// ```
/// Without that most, what is seen again and again past the posts of a fence would change its level each time.
#[derive(Clone, Copy, Debug, Default)]
struct HeldShare {
    held: u8,
    /// The most seen since less than `held` was, and for how many frames.
    peak: u8,
    waited: u8,
}

impl HeldShare {
    fn update(&mut self, now: u8, was_refined: bool, hold_frames: u8) {
        if now >= self.held || !was_refined {
            (self.held, self.waited) = (now, 0);
            return;
        }
        self.peak = match self.waited {
            0 => now,
            _ => now.max(self.peak),
        };
        if self.waited >= hold_frames {
            (self.held, self.waited) = (self.peak, 0);
        } else {
            self.waited += 1;
        }
    }
}

/// What counts of a mesh that is drawn as a whole: one held share for all levels that are refined. Finer ones count
/// what is seen now.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LevelShare {
    pub(crate) now: u8,
    share: HeldShare,
}

impl LevelShare {
    /// Goes on to another frame, after one in which something was refined or not.
    pub(crate) fn update(&mut self, now: u8, was_refined: bool, hold_frames: u8) {
        self.now = now;
        self.share.update(now, was_refined, hold_frames);
    }

    /// Whether the next frame changes nothing if it sees the same.
    pub(crate) fn is_settled(&self) -> bool {
        self.share.held == self.now
    }

    /// Shares of finer levels and of refined ones.
    pub(crate) fn now_and_held(&self) -> [u8; 2] {
        [self.now, self.share.held]
    }

    /// The steps of all levels, of which those from `refined_from` on are refined.
    pub(crate) fn steps(&self, refined_from: usize) -> LevelSteps {
        let step = |level: usize| match level < refined_from {
            true => self.now,
            false => self.share.held,
        };
        std::array::from_fn(|block| std::array::from_fn(|lane| step(block * LANES + lane)))
    }
}

/// Shares of the levels of a whole mesh, in steps.
pub(crate) type LevelSteps = [[u8; LANES]; LANES];

/// The shares of groups.
#[derive(Debug, Default)]
pub(crate) struct ShareMemory {
    shares: Vec<HeldShare>,
    /// Held shares, eight to an element.
    held: Vec<[u8; LANES]>,
    /// Whether `held` is what is seen.
    is_settled: bool,
    /// The last share, if it was the same for all groups.
    last_of_all: Option<u8>,
}

/// Visible shares of an instance's groups in one frame.
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

    /// The shares as decisions read them.
    pub(crate) fn shares(&self, settings: &LodSettings) -> Shares<'_> {
        match &settings.visible_flux {
            Some(flux) => Shares::new(&self.held, flux.least_share),
            None => Shares::FULL,
        }
    }

    /// Begins with what is seen now.
    pub(crate) fn begin(&mut self, words: usize, seen: &SeenShares) {
        self.shares.clear();
        self.shares.resize(words * CHUNK, HeldShare::default());
        self.held.clear();
        self.held.resize(words * LANES, [0; LANES]);
        self.last_of_all = None;
        self.update(seen, &[], 0);
    }

    /// Goes on to another frame; `refined` has the bits of the last cut.
    pub(crate) fn update(&mut self, seen: &SeenShares, refined: &[u64], hold_frames: u8) {
        let of_all = seen.of_all();
        if self.is_settled && of_all.is_some() && of_all == self.last_of_all {
            return;
        }
        self.last_of_all = of_all;
        self.is_settled = true;
        let held = self.held.as_flattened_mut().iter_mut();
        for (group, (held, share)) in held.zip(&mut self.shares).enumerate() {
            let now = seen.of(group);
            share.update(now, is_set(refined, group), hold_frames);
            *held = share.held;
            self.is_settled &= *held == now;
        }
    }
}
