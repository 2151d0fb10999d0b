//! Visible shares of the groups of one instance, in steps of a sixteenth.

use crate::lanes::bits::LANES;

/// The steps of hidden and of fully visible groups. In a walk among 10,000 rocks, 8 steps drew 1.05 times the triangles
/// with 0.96 times the changes of cuts. 32 steps drew 0.98 times the triangles with 1.02 times the changes.
pub(crate) const HIDDEN: u8 = 0;
pub(crate) const FULL_SHARE: u8 = 16;

/// Visible shares of groups in steps, eight to an element.
#[derive(Clone, Copy)]
pub(crate) struct Shares<'a> {
    pub(crate) steps: &'a [[u8; LANES]],
    /// Least share of hidden groups.
    pub(crate) least: f32,
}

impl Shares<'_> {
    /// All groups are visible.
    pub(crate) const FULL: Self = Self {
        steps: &[],
        least: 1.0,
    };

    /// The shares of one block.
    #[inline(always)]
    pub(crate) fn of_block(&self, block: usize) -> [f32; LANES] {
        match self.steps.get(block) {
            Some(steps) => steps.map(|step| share_of_step(step, self.least)),
            None => [1.0; LANES],
        }
    }
}

/// The share of a step, at least `least`.
#[inline(always)]
pub(crate) fn share_of_step(step: u8, least: f32) -> f32 {
    let share = f32::from(step) / f32::from(FULL_SHARE);
    // Above 0, because 0 times an infinite error is NaN.
    share.max(least).clamp(f32::MIN_POSITIVE, 1.0)
}
