//! The threshold that meets a triangle budget, found in one pass.
//!
//! With M the error of a group, closed over its finer groups and divided by its share of the
//! threshold (bias, hysteresis), a unit is drawn where `M(consumer) > τ ≥ M(producer)`. So the
//! triangles at threshold τ are a sum over units, and a histogram of M over the bits of the number,
//! which are monotone, gives them for every τ.

use wide::f32x8;

use crate::bits::{LANES, block_bits, is_set};
use crate::criterion::Criterion;
use crate::lane::mask_of;
use crate::scene::Scene;
use crate::settings::LodSettings;
use crate::table::GroupTable;
use crate::view::{InstanceView, View};

/// Low bits of an error that do not matter: thresholds differ by 0.2 %.
const DROPPED_BITS: u32 = 14;
const BUCKETS: usize = (f32::INFINITY.to_bits() >> DROPPED_BITS) as usize + 1;
/// Share of the budget by which the triangles may differ before a new threshold is sought.
const DEAD_BAND: f64 = 0.02;

/// Whether a count is so near its budget that the threshold stays.
pub(crate) fn is_met(budget: u64, triangle_count: u64) -> bool {
    (triangle_count as f64 - budget as f64).abs() <= budget as f64 * DEAD_BAND
}

/// The search for that threshold, with what it has found so far.
#[derive(Debug, Default)]
pub(crate) struct BudgetSearch {
    threshold_px: Option<f32>,
    /// Triangles that are drawn at thresholds below a bucket, less those above.
    histogram: Vec<i64>,
    errors: Vec<f32>,
}

impl BudgetSearch {
    /// The settings at the threshold in use.
    pub(crate) fn settings(&self, settings: &LodSettings) -> LodSettings {
        let plain = LodSettings {
            triangle_budget: None,
            ..*settings
        };
        match self.threshold_px {
            Some(threshold_px) => plain.at_threshold(threshold_px),
            None => plain,
        }
    }

    /// Begins the count of triangles by threshold.
    pub(crate) fn begin(&mut self) {
        self.histogram.clear();
        self.histogram.resize(BUCKETS, 0);
    }

    /// Adds an instance, with the bits of its last cut.
    pub(crate) fn add(
        &mut self,
        scene: &Scene,
        instance: usize,
        refined: Option<&[u64]>,
        view: &View,
        settings: &LodSettings,
    ) {
        let Some(mesh) = scene.entries[instance].mesh else {
            return;
        };
        // The error of each group as a share of its threshold, closed over finer groups.
        let (table, instance) = (scene.table(mesh), &scene.instances[instance]);
        let refined = refined.unwrap_or(&table.coarsest_refined);
        let instance_view = InstanceView::new(view, &instance.world_from_local);
        self.measure(table, &instance_view, settings, refined);
        let share = settings.resolution_scale * instance.bias;
        self.close(table, refined, share, settings.hysteresis.min(1.0));
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
    ) {
        let criterion = Criterion::<f32x8>::new(instance, settings);
        let blocks = 0..table.group_count().div_ceil(LANES);
        self.errors.clear();
        self.errors.extend(blocks.flat_map(|block| {
            let was_refined = block_bits(refined[block / LANES], block % LANES);
            let error_px = criterion.error_px(&table.criterion_input(block), mask_of(was_refined));
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
    }

    /// The settings at the least threshold that draws no more than `budget`.
    pub(crate) fn finish(&mut self, budget: u64, settings: &LodSettings) -> LodSettings {
        let mut above = 0;
        let mut least = BUCKETS - 1;
        // At the threshold where a bucket begins, that bucket and all above it are refined.
        while least > 0 {
            above += self.histogram[least];
            if above > budget as i64 {
                least += 1;
                break;
            }
            least -= 1;
        }
        let threshold_px = f32::from_bits((least.min(BUCKETS - 1) as u32) << DROPPED_BITS);
        self.threshold_px = Some(threshold_px);
        settings.at_threshold(threshold_px)
    }
}

/// The bucket of an error.
fn bucket(error: f32) -> usize {
    // Zero and less are refined at no threshold.
    (error.max(0.0).to_bits() >> DROPPED_BITS) as usize
}
