//! The threshold that meets a triangle budget, found in one pass.
//!
//! With M the error of a group, closed over its finer groups and divided by its share of the
//! threshold (bias, hysteresis), a unit is drawn where `M(consumer) > τ ≥ M(producer)`. So the
//! triangles at threshold τ are a sum over units, and a histogram of M over the bits of the number,
//! which are monotone, gives them for every τ.

use wide::f32x8;

use crate::kernel::Kernel;
use crate::scene::Scene;
use crate::table::{CHUNK, GroupTable, LANES};
use crate::{InstanceView, LodSettings, View};

/// Low bits of an error that do not matter: thresholds differ by 0.2 %.
const DROPPED_BITS: u32 = 14;
const BUCKETS: usize = (f32::INFINITY.to_bits() >> DROPPED_BITS) as usize + 1;
/// Share of the budget by which the triangles may differ before a new threshold is sought.
const DEAD_BAND: f64 = 0.02;

/// Whether a count is so near its budget that the threshold stays.
pub(crate) fn is_met(budget: u64, triangle_count: u64) -> bool {
    (triangle_count as f64 - budget as f64).abs() <= budget as f64 * DEAD_BAND
}

#[derive(Debug, Default)]
pub(crate) struct Search {
    threshold_px: Option<f32>,
    /// Triangles that are drawn at thresholds below a bucket, less those above.
    histogram: Vec<i64>,
    errors: Vec<f32>,
}

impl Search {
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
        let data = &scene.instances[instance];
        let Some(mesh) = scene.occupants[instance].mesh else {
            return;
        };
        let table = scene.table(mesh);
        let instance_view = InstanceView::new(view, &data.world_from_local);
        let kernel = Kernel::new(&instance_view, settings);
        let refined = refined.unwrap_or(&table.coarsest_refined);
        let blocks = 0..table.group_count().div_ceil(LANES);
        self.errors.clear();
        self.errors.extend(blocks.flat_map(|block| {
            let was_refined = refined[block * LANES / CHUNK] >> (block * LANES % CHUNK);
            f32x8::to_array(kernel.error_px(table, block, was_refined as u32 & 0xff))
        }));
        let share = settings.resolution_scale * data.bias;
        self.close(table, refined, share, settings.hysteresis.min(1.0));
        for group in 0..table.group_count() {
            for (producer, triangle_count) in table.consumed_by(group) {
                let triangle_count = i64::from(triangle_count);
                self.histogram[bucket(self.errors[group])] += triangle_count;
                if let Some(producer) = producer {
                    self.histogram[bucket(self.errors[producer as usize])] -= triangle_count;
                }
            }
        }
    }

    fn close(&mut self, table: &GroupTable, refined: &[u64], share: f32, hysteresis: f32) {
        for group in 0..table.group_count() {
            let bit = |words: &[u64]| words[group / 64] >> (group % 64) & 1 == 1;
            let memory = if bit(refined) { hysteresis } else { 1.0 };
            let error = self.errors[group];
            let own = if bit(&table.terminal) || error.is_nan() {
                f32::INFINITY
            } else {
                error * share / memory
            };
            self.errors[group] = own;
        }
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

fn bucket(error: f32) -> usize {
    // Zero and less are refined at no threshold.
    (error.max(0.0).to_bits() >> DROPPED_BITS) as usize
}
