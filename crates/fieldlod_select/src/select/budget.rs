//! The search for the finest threshold whose triangles fit the budget: the frame is selected at one threshold after
//! another.
//!
//! The constants were measured in a walk of 900 frames among 10,000 rocks, with 0.3, 0.6 and 0.9 of the triangles.

use crate::settings::LodSettings;

/// Share of the budget below which a finer threshold is searched. The walk used 0.97 of the budget with 26 searches. At
/// 0.9 it used 0.95 to 0.96 with 10; at 0.975 it used 0.98 with 46 to 61, and changed 1.2 to 1.4 times as many cuts.
const DEAD_BAND_FROM: f64 = 0.95;
/// Frames with other input after which a search is repeated although the previous search could not use more of the
/// budget. Groups are refined as a whole, so the budget may be out of reach for a while. With 8 frames the walk took up to 1.3 times as
/// many searches to use up to 0.005 more of the budget; with 32 it took 0.7 to 0.9 times as many for up to 0.005 less.
const PATIENCE: u32 = 16;
/// Largest number of selections in one search: enough to bracket any budget and to halve the interval to
/// [`LEAST_STEP`]. The walk takes at most 4, so that 6 and 24 use the same share of the budget to 0.003.
const MOST_TRIES: u32 = 12;
/// Relative difference at which a search ends, and its first step. At 0.01 the walk changed 0.8 to 0.9 times as many
/// cuts, but single searches took 5 selections in place of 4; at 0.04 it changed 1.2 to 1.3 times as many cuts.
const LEAST_STEP: f32 = 0.02;
/// First threshold above 0: steps are factors, and would stay at 0.
const LEAST_PX: f32 = 1e-3;

/// The threshold in use, and the state of a search.
#[derive(Debug, Default)]
pub(crate) struct BudgetSearch {
    /// `None` for the threshold of the settings, the finest allowed.
    threshold_px: Option<f32>,
    /// Budget and triangles at the end of the last search, and frames with other input since.
    found: [u64; 2],
    age: u32,
    /// The coarsest known threshold that exceeds the budget, and the finest that fits.
    exceeds: Option<f32>,
    keeps: Option<f32>,
    tries: u32,
}

impl BudgetSearch {
    /// The settings at the threshold in use; the settings themselves without a budget.
    pub(crate) fn settings(&self, settings: &LodSettings) -> LodSettings {
        let coarser = |threshold_px: &f32| *threshold_px > settings.threshold_px();
        match self.threshold_px.filter(coarser) {
            Some(threshold_px) if settings.triangle_budget.is_some() => {
                settings.at_threshold(threshold_px)
            }
            _ => *settings,
        }
    }

    /// Begins a frame. Without another input, a search that could not use more of the budget is not repeated.
    pub(crate) fn begin(&mut self, has_other_input: bool) {
        self.age = self.age.saturating_add(u32::from(has_other_input));
    }

    /// The settings to select at next in the same frame, after a selection of `triangle_count`; `None` if the search is
    /// over.
    pub(crate) fn next(
        &mut self,
        settings: &LodSettings,
        triangle_count: u64,
    ) -> Option<LodSettings> {
        let budget = settings.triangle_budget?;
        let used_px = self.settings(settings).threshold_px();
        if self.tries == 0 && !self.is_due(budget, triangle_count, used_px) {
            return None;
        }
        let next_px = self.next_threshold(budget, triangle_count, used_px, settings);
        self.tries += 1;
        if next_px == used_px {
            *self = Self {
                threshold_px: self.threshold_px,
                found: [budget, triangle_count],
                ..Self::default()
            };
            return None;
        }
        self.threshold_px = Some(next_px);
        // Without hysteresis the triangles depend on the threshold alone, not on thresholds that were tried before.
        let mut next = self.settings(settings);
        next.advanced.hysteresis = 1.0;
        Some(next)
    }

    /// Whether to search another threshold.
    fn is_due(&self, budget: u64, triangle_count: u64, used_px: f32) -> bool {
        let [last_budget, found] = self.found;
        let is_known = budget == last_budget && self.age < PATIENCE;
        let reachable = if is_known { found.min(budget) } else { budget };
        let is_too_coarse = (triangle_count as f64) < reachable as f64 * DEAD_BAND_FROM;
        let is_too_fine = triangle_count > budget && used_px < f32::INFINITY;
        is_too_fine || (is_too_coarse && self.threshold_px.is_some())
    }

    /// The next threshold; the one in use if the search is over.
    fn next_threshold(
        &mut self,
        budget: u64,
        triangle_count: u64,
        used_px: f32,
        settings: &LodSettings,
    ) -> f32 {
        let finest_px = settings.threshold_px();
        let is_kept = triangle_count <= budget;
        let is_used_up = triangle_count as f64 >= budget as f64 * DEAD_BAND_FROM;
        let is_last = self.tries >= MOST_TRIES;
        if is_kept && (is_used_up || used_px <= finest_px || is_last) {
            return used_px;
        }
        // Because of the hysteresis at the edges of the view, a threshold that fits may exceed the budget in another
        // try.
        let beyond = |other: &f32| {
            if is_kept {
                *other < used_px
            } else {
                *other > used_px
            }
        };
        if is_kept {
            (self.keeps, self.exceeds) = (Some(used_px), self.exceeds.filter(beyond));
        } else {
            (self.exceeds, self.keeps) = (Some(used_px), self.keeps.filter(beyond));
        }
        // Steps grow until the budget is between two thresholds.
        let step = 1.0 + LEAST_STEP * (1u32 << self.tries.min(MOST_TRIES)) as f32;
        match (self.exceeds, self.keeps) {
            (_, Some(keeps)) if is_last => keeps,
            (_, None) if is_last => f32::INFINITY,
            // Steps from infinity stay there.
            (None, Some(f32::INFINITY)) => finest_px.max(LEAST_PX),
            (None, Some(keeps)) => (keeps / step).max(finest_px),
            (Some(exceeds), Some(keeps)) if keeps < exceeds * (1.0 + LEAST_STEP) => keeps,
            (Some(exceeds), Some(keeps)) if keeps < f32::INFINITY => (exceeds * keeps).sqrt(),
            _ => (used_px * step).max(LEAST_PX),
        }
    }
}
