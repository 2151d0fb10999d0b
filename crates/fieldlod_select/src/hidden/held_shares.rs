//! Visible shares from frame to frame: they rise at once and fall after some frames.

use crate::hidden::shares::{FULL_SHARE, Shares};
use crate::lanes::bits::{CHUNK, LANES, is_set};
use crate::settings::LodSettings;

/// A share in steps.
///
/// ```text
/// not refined, or seen no less: the share that is seen now
/// else, after `hold_frames` frames in a row that saw less: the largest share of those and this frame
/// ```
/// Without that largest share, an instance behind the posts of a fence would change its level again and again.
#[derive(Clone, Copy, Debug, Default)]
struct HeldShare {
    held: u8,
    /// The largest share since less than `held` was seen, and the number of frames.
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

/// The share of a mesh that is drawn as a whole: one held share for all refined levels. Finer levels count the share
/// that is seen now.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LevelShare {
    pub(crate) now: u8,
    share: HeldShare,
}

impl LevelShare {
    /// Updates the share in a new frame. `was_refined` tells whether the last frame drew a finer level than the
    /// coarsest.
    pub(crate) fn update(&mut self, now: u8, was_refined: bool, hold_frames: u8) {
        self.now = now;
        self.share.update(now, was_refined, hold_frames);
    }

    /// Whether the share stays as it is while the same is seen.
    pub(crate) fn is_settled(&self) -> bool {
        self.share.held == self.now
    }

    /// Shares of finer levels and of refined levels.
    pub(crate) fn now_and_held(&self) -> [u8; 2] {
        [self.now, self.share.held]
    }

    /// The steps of all levels. Levels from `refined_from` on are refined.
    pub(crate) fn steps(&self, refined_from: usize) -> LevelSteps {
        let step = |level: usize| {
            if level < refined_from {
                self.now
            } else {
                self.share.held
            }
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
    /// Whether `held` equals the visible shares.
    pub(crate) is_settled: bool,
    /// The previous share, if it was the same for all groups.
    last_of_all: Option<u8>,
}

/// The visible share of all groups of an instance in one frame, or of each group.
pub(crate) type SeenShares<'a> = (Option<u8>, &'a [u8]);

impl ShareMemory {
    /// Removes all shares. All groups then count in full.
    pub(crate) fn clear(&mut self) {
        self.shares.clear();
        self.held.clear();
        self.last_of_all = None;
        self.is_settled = true;
    }

    /// The shares for decisions.
    pub(crate) fn shares(&self, settings: &LodSettings) -> Shares<'_> {
        match &settings.visible_flux {
            Some(flux) => Shares {
                steps: &self.held,
                least: flux.least_share,
            },
            None => Shares::FULL,
        }
    }

    /// Updates the shares in a new frame; `refined` has the bits of the previous cut.
    pub(crate) fn update(
        &mut self,
        (of_all, of_groups): SeenShares,
        refined: &[u64],
        hold_frames: u8,
    ) {
        if self.is_settled && of_all.is_some() && of_all == self.last_of_all {
            return;
        }
        self.last_of_all = of_all;
        self.is_settled = true;
        // New shares start with those that are seen now.
        let blocks = refined.len() * (CHUNK / LANES);
        self.shares.resize(blocks * LANES, HeldShare::default());
        self.held.resize(blocks, [0; LANES]);
        let held = self.held.as_flattened_mut().iter_mut();
        for (group, (held, share)) in held.zip(&mut self.shares).enumerate() {
            let of_group = of_all.or(of_groups.get(group).copied());
            let now = of_group.unwrap_or(FULL_SHARE);
            share.update(now, is_set(refined, group), hold_frames);
            *held = share.held;
            self.is_settled &= *held == now;
        }
    }
}
