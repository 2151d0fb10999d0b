//! What many poses and models say together.

use serde::{Deserialize, Serialize};

use super::ablation::{AblationRow, ablation, markdown};
use super::costs::{CostAtError, costs};
use super::curve::{Measure, PoseResult};
use super::flicker::FlickerResult;
use super::model_result::{ModelResult, Options};
use super::promise::PromiseResult;
use super::ratios::{COMPARED_AT_PX, Ratios, geometric_mean};
use crate::method::Method;

/// The methods that are told apart by model.
const BY_MODEL: [Method; 9] = [
    Method::Quality,
    Method::VisibleFlux,
    Method::ClusterlodOnOurLevels,
    Method::NoProjection,
    Method::NoSilhouette,
    Method::NoOffAxis,
    Method::NoBound,
    Method::ShareInView,
    Method::Oracle,
];
/// The numbers behind all charts.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// The adapter that drew the pictures.
    pub adapter: String,
    /// Width and height of the pictures.
    pub size_px: [u32; 2],
    /// The seed of the poses.
    pub seed: u64,
    /// The number of poses of each model.
    pub poses: usize,
    /// Triangles relative to clusterlod's at equal error, over all models' poses.
    pub ratios: Vec<Ratios>,
    /// The ratios of each model.
    pub models: Vec<ModelRatios>,
    /// Costs at equal image error, over all models' poses.
    pub costs: Vec<CostAtError>,
    /// Displacements at thresholds, in the worst model; triangles of all models together.
    pub promise: Vec<PromiseResult>,
    /// Flicker on a walk, over all models.
    pub flicker: Vec<FlickerResult>,
    /// The worth of each term of the criterion.
    pub ablation: Vec<AblationRow>,
}

/// One model's ratios.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ModelRatios {
    /// Its name.
    pub name: String,
    /// Triangles of the source.
    pub triangles: u64,
    /// Relative to clusterlod at equal error.
    pub ratios: Vec<Ratios>,
}

impl Report {
    /// Sums up models.
    #[must_use]
    pub fn new(models: &[ModelResult], options: &Options, adapter: &str) -> Self {
        let of_model = |model: &ModelResult| {
            let poses: Vec<&PoseResult> = model.poses.iter().collect();
            ModelRatios {
                name: model.name.clone(),
                triangles: model.triangles,
                ratios: all_ratios(&poses, &BY_MODEL),
            }
        };
        // All models' poses count alike.
        let poses: Vec<&PoseResult> = models.iter().flat_map(|model| &model.poses).collect();
        Self {
            adapter: adapter.to_owned(),
            size_px: options.size_px.to_array(),
            seed: options.seed,
            poses: options.poses,
            ratios: all_ratios(&poses, &options.methods),
            models: models.iter().map(of_model).collect(),
            costs: costs(&poses),
            promise: worst_promises(models),
            flicker: mean_flicker(models),
            ablation: ablation(models),
        }
    }

    /// The ratio of a method over all models.
    #[must_use]
    pub fn ratio(&self, method: Method, measure: Measure, at_px: f64) -> Option<&Ratios> {
        find(&self.ratios, method, measure, at_px)
    }

    /// The worth of each term of the criterion, as a table in Markdown.
    #[must_use]
    pub fn ablation_table(&self) -> String {
        markdown(&self.ablation)
    }
}

impl ModelRatios {
    /// The ratio of a method.
    #[must_use]
    pub fn ratio(&self, method: Method, measure: Measure, at_px: f64) -> Option<&Ratios> {
        find(&self.ratios, method, measure, at_px)
    }
}

fn find(all: &[Ratios], method: Method, measure: Measure, at_px: f64) -> Option<&Ratios> {
    all.iter()
        .find(|r| r.method == method && r.measure == measure && r.at_px == at_px)
}

fn all_ratios(poses: &[&PoseResult], methods: &[Method]) -> Vec<Ratios> {
    let mut all = Vec::new();
    for &method in methods {
        for measure in Measure::ALL {
            let at = COMPARED_AT_PX.into_iter();
            all.extend(at.filter_map(|at_px| Ratios::of(poses, method, measure, at_px)));
        }
    }
    all
}

fn worst_promises(models: &[ModelResult]) -> Vec<PromiseResult> {
    let Some(first) = models.first() else {
        return Vec::new();
    };
    let worst = |index: usize| {
        // The worst displacements, and the triangles of all models together.
        let of_models = models.iter().filter_map(|model| model.promise.get(index));
        let none = PromiseResult {
            triangles: 0.0,
            ..first.promise[index]
        };
        of_models.fold(none, |worst, result| PromiseResult {
            max_px: worst.max_px.max(result.max_px),
            p99_9_px: worst.p99_9_px.max(result.p99_9_px),
            mean_px: worst.mean_px.max(result.mean_px),
            triangles: worst.triangles + result.triangles,
            ..worst
        })
    };
    (0..first.promise.len()).map(worst).collect()
}

fn mean_flicker(models: &[ModelResult]) -> Vec<FlickerResult> {
    let Some(first) = models.first() else {
        return Vec::new();
    };
    let mean = |index: usize| {
        // Geometric means, but of flips, which may be 0.
        let paths = || models.iter().filter_map(|model| model.flicker.get(index));
        let flips: f64 = paths().map(|path| path.flips_per_frame).sum();
        FlickerResult {
            triangles: geometric_mean(paths().map(|path| path.triangles)),
            temporal_error: geometric_mean(paths().map(|path| path.temporal_error)),
            flips_per_frame: flips / models.len() as f64,
            ..first.flicker[index]
        }
    };
    (0..first.flicker.len()).map(mean).collect()
}
