//! The least threshold that keeps to a triangle budget, found in one pass.
//!
//! With M the error of a group, closed over its finer groups and divided by its share of the
//! threshold (bias, hysteresis), a unit is drawn where `M(consumer) > τ ≥ M(producer)`. So the
//! triangles at threshold τ are a sum over units, and a histogram of M over the bits of the number,
//! which are monotone, gives them for every τ.

use wide::f32x8;

use super::cuts::SceneCuts;
use super::frame::Input;
use super::memory::InstanceState;
use crate::criterion::Criterion;
use crate::hidden::shares::Shares;
use crate::lanes::bits::{LANES, block_bits, is_set};
use crate::lanes::mask_of;
use crate::scene::Scene;
use crate::scene::table::GroupTable;
use crate::settings::LodSettings;
use crate::view::{InstanceView, View};

/// Low bits of an error that do not matter: thresholds differ by 0.2 %.
const DROPPED_BITS: u32 = 14;
const BUCKETS: usize = (f32::INFINITY.to_bits() >> DROPPED_BITS) as usize + 1;
/// Share of the budget that a search aims at, and that below which a finer threshold is sought. Between
/// it and the whole budget the threshold stays.
const AIM: f64 = 0.98;
const DEAD_BAND_FROM: f64 = 0.95;
/// In a view that changes, what a search could not get nearer to its budget is not sought again for so many
/// frames.
const PATIENCE: u32 = 16;

/// Searches in one and the same frame: each changes what the hysteresis remembers, and so what the next one finds.
const MOST_SEARCHES: u32 = 3;

/// The search for that threshold, with what it has found so far.
#[derive(Debug, Default)]
pub(crate) struct BudgetSearch {
    /// The threshold in use, if it is not that of the settings.
    threshold_px: Option<f32>,
    /// The budget of the last search, and the triangles that it came to.
    budget: u64,
    found: u64,
    /// Frames since.
    age: u32,
    /// The input that a threshold was last sought for, and how often.
    sought: Option<(Input, u32)>,
    /// Triangles that are drawn at thresholds below a bucket, less those above.
    histogram: Vec<i64>,
    errors: Vec<f32>,
}

impl BudgetSearch {
    /// The settings at the threshold in use, which is never finer than theirs; as they are without a budget.
    pub(crate) fn settings(&self, settings: &LodSettings) -> LodSettings {
        let coarser = |threshold_px: &f32| *threshold_px > settings.threshold_px();
        match self.threshold_px.filter(coarser) {
            Some(threshold_px) if budget_of(settings).is_some() => {
                settings.at_threshold(threshold_px)
            }
            _ => *settings,
        }
    }

    /// Whether another threshold should be sought, now that this one draws `triangle_count`.
    fn is_due(&mut self, budget: u64, triangle_count: u64) -> bool {
        self.age = self.age.saturating_add(1);
        let Some(threshold_px) = self.threshold_px else {
            return triangle_count > budget;
        };
        // Groups come and go as a whole, so that the budget may be out of reach for a while.
        let is_known = budget == self.budget && self.age < PATIENCE;
        let reachable = if is_known {
            self.found.min(budget)
        } else {
            budget
        };
        let is_too_fine = triangle_count > budget && threshold_px < f32::INFINITY;
        is_too_fine || (triangle_count as f64) < reachable as f64 * DEAD_BAND_FROM
    }

    /// The settings at another threshold that keeps to their budget, by the cuts that were selected last; `None` if
    /// the one in use does.
    pub(crate) fn search(
        &mut self,
        cuts: &mut SceneCuts,
        scene: &Scene,
        view: &View,
        settings: &LodSettings,
    ) -> Option<LodSettings> {
        let budget = budget_of(settings)?;
        let input = Input::new(scene, view, settings);
        let searches = match self.sought {
            Some((sought, searches)) if sought == input => searches,
            _ => 0,
        };
        if !self.is_due(budget, cuts.triangle_count) || searches >= MOST_SEARCHES {
            return None;
        }
        self.sought = Some((input, searches + 1));
        cuts.statistics.budget_searches += 1;
        self.begin();
        let mut forced_triangles = 0;
        for index in 0..scene.instances.len() {
            let state = cuts.memory(index).state;
            if !state.is_drawn() {
                continue;
            }
            // Those of forced levels are drawn at any threshold.
            if scene.entries[index].forced_level.is_some() {
                let of_cut = cuts.cut(index).map(|cut| cut.drawn().1);
                forced_triangles += of_cut.unwrap_or_else(|| state.drawn_whole(scene).1);
                continue;
            }
            self.add_drawn(cuts, scene, index, view, settings);
        }
        self.budget = budget;
        Some(self.finish(budget.saturating_sub(forced_triangles), settings))
    }

    /// Adds an instance by how it is drawn and what is visible of it.
    fn add_drawn(
        &mut self,
        cuts: &SceneCuts,
        scene: &Scene,
        index: usize,
        view: &View,
        settings: &LodSettings,
    ) {
        let Some(mesh) = scene.entries[index].mesh else {
            return;
        };
        let (table, memory) = (scene.table(mesh), cuts.memory(index));
        if let Some(cut) = cuts.cut(index) {
            let shares = cut.shares().shares(settings);
            return self.add(scene, index, cut.refined(), shares, view, settings);
        }
        let flux = settings.visible_flux;
        if let InstanceState::AtLevel(_, level) = memory.state {
            let refined = [table.refined_at_level(usize::from(level))];
            let steps = memory.share.steps(usize::from(level));
            let shares = flux.map_or(Shares::FULL, |flux| Shares::new(&steps, flux.least_share));
            return self.add(scene, index, &refined, shares, view, settings);
        }
        let placed = &scene.instances[index];
        let of_whole = |flux| (cuts.visible).shares_of_whole(table, index as u32, placed, flux);
        let shares = flux.as_ref().map_or(Shares::FULL, of_whole);
        self.add(
            scene,
            index,
            &table.coarsest_refined,
            shares,
            view,
            settings,
        );
    }

    /// Begins the count of triangles by threshold.
    fn begin(&mut self) {
        self.histogram.clear();
        self.histogram.resize(BUCKETS, 0);
    }

    /// Adds an instance, with the bits of its last cut and what is visible of it.
    fn add(
        &mut self,
        scene: &Scene,
        instance: usize,
        refined: &[u64],
        shares: Shares,
        view: &View,
        settings: &LodSettings,
    ) {
        let Some(mesh) = scene.entries[instance].seen_mesh(view.layers) else {
            return;
        };
        // The error of each group as a share of its threshold, closed over finer groups.
        let (table, instance) = (scene.table(mesh), &scene.instances[instance]);
        let instance_view = InstanceView::new(view, &instance.world_from_local);
        self.measure(table, &instance_view, settings, refined, shares);
        let share = settings.resolution_scale * instance.bias;
        self.close(table, refined, share, settings.advanced.hysteresis.min(1.0));
        // A unit is drawn between the error of its producer and that of its consumer.
        for group in 0..table.group_count() {
            for unit in table.consumed_by(group) {
                let triangle_count = i64::from(unit.triangle_count);
                self.histogram[bucket(self.errors[group])] += triangle_count;
                if let Some(producer) = unit.producer() {
                    self.histogram[bucket(self.errors[producer])] -= triangle_count;
                }
            }
        }
    }

    /// The error of each group by itself.
    fn measure(
        &mut self,
        table: &GroupTable,
        instance: &InstanceView,
        settings: &LodSettings,
        refined: &[u64],
        shares: Shares,
    ) {
        let criterion = Criterion::<f32x8>::new(instance, settings);
        let blocks = 0..table.group_count().div_ceil(LANES);
        self.errors.clear();
        self.errors.extend(blocks.flat_map(|block| {
            let was_refined = block_bits(refined[block / LANES], block % LANES);
            let error_px =
                criterion.error_px(&table.criterion_input(block, shares), mask_of(was_refined));
            error_px.to_array()
        }));
    }

    /// Divides errors by their shares of the threshold, and closes them over finer groups.
    fn close(&mut self, table: &GroupTable, refined: &[u64], share: f32, hysteresis: f32) {
        // A refined group has the hysteresis' share of the threshold.
        for group in 0..table.group_count() {
            let memory = if is_set(refined, group) {
                hysteresis
            } else {
                1.0
            };
            let error = self.errors[group];
            self.errors[group] = if is_set(&table.terminal, group) || error.is_nan() {
                f32::INFINITY
            } else {
                error * share / memory
            };
        }
        // Finer groups come first, so one pass closes the errors.
        for group in 0..table.group_count() {
            let error = self.errors[group];
            for &coarser in table.coarser_of(group) {
                let coarser = &mut self.errors[coarser as usize];
                *coarser = coarser.max(error);
            }
        }
        // Groups that are not at hand are never refined.
        for group in 0..table.group_count() {
            if !table.is_available(group) {
                self.errors[group] = 0.0;
            }
        }
    }

    /// The settings at the least threshold that keeps to `budget`.
    fn finish(&mut self, budget: u64, settings: &LodSettings) -> LodSettings {
        let aim = (budget as f64 * AIM) as i64;
        let mut above = 0;
        let mut least = BUCKETS - 1;
        // At the threshold where a bucket begins, that bucket and all above it are refined.
        while least > 0 {
            above += self.histogram[least];
            if above > aim {
                least += 1;
                break;
            }
            least -= 1;
        }
        let threshold_px = f32::from_bits((least.min(BUCKETS - 1) as u32) << DROPPED_BITS);
        self.threshold_px = (threshold_px > settings.threshold_px()).then_some(threshold_px);
        self.settings(settings)
    }

    /// Notes what the threshold that was found draws.
    pub(crate) fn note_found(&mut self, triangle_count: u64) {
        self.found = triangle_count;
        self.age = 0;
    }
}

/// The budget of settings, which forced levels come before.
fn budget_of(settings: &LodSettings) -> Option<u64> {
    let is_free = settings.forced_level.is_none();
    settings.triangle_budget.filter(|_| is_free)
}

/// The bucket of an error.
fn bucket(error: f32) -> usize {
    // Zero and less are refined at no threshold.
    (error.max(0.0).to_bits() >> DROPPED_BITS) as usize
}
