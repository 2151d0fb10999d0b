//! What many poses and models say together.

use serde::{Deserialize, Serialize};

use super::curve::cost_at_triangles;
use super::worth::{markdown, worth};
use super::{
    COMPARED_AT_PX, Curve, Kept, Measure, ModelResult, OnPath, Options, Point, PoseResult, Ratios,
    THRESHOLDS_PX, Way, Worth, ratios, triangles_at_error,
};

/// The ways whose costs are charted.
pub(super) const CHARTED: [Way; 4] = [Way::Quality, Way::Clusterlod, Way::Godot, Way::Oracle];
/// The ways that are told apart by model.
const BY_MODEL: [Way; 7] = [
    Way::Quality,
    Way::NoProjection,
    Way::NoSilhouette,
    Way::NoOffAxis,
    Way::NoBound,
    Way::ShareInView,
    Way::Oracle,
];
/// Ways are shown at an error only where at least this share of poses can be compared.
const LEAST_SHARE: f64 = 0.6;

/// The numbers behind all charts.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// What drew the pictures.
    pub adapter: String,
    /// Width and height of the pictures.
    pub size_px: [u32; 2],
    /// What the poses depend on.
    pub seed: u64,
    /// How many poses of each model.
    pub poses: usize,
    /// Triangles of clusterlod at equal error, over all models' poses.
    pub ratios: Vec<Ratios>,
    /// The same for each model.
    pub models: Vec<ModelRatios>,
    /// Costs at equal image error, over all models' poses.
    pub costs: Vec<CostAtError>,
    /// What is kept of promises, in the worst model; triangles of all models together.
    pub promise: Vec<Kept>,
    /// What flickers, over all models.
    pub temporal: Vec<OnPath>,
    /// What each term of the criterion is worth.
    pub worth: Vec<Worth>,
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

/// What a way costs at an error: geometric means over poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CostAtError {
    /// The way.
    pub way: Way,
    /// The threshold of clusterlod with that error, in pixels.
    pub at_px: f64,
    /// Root mean squared difference of the picture, in levels of 255.
    pub rmse: f64,
    /// The threshold at which the way has that error, in pixels.
    pub threshold_px: f64,
    /// Triangles of units in view.
    pub triangles: f64,
    /// Units in view: draw commands.
    pub units: f64,
    /// Time to choose, in microseconds.
    pub select_us: f64,
    /// Time to draw, in milliseconds.
    pub frame_ms: f64,
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
        let poses: Vec<&PoseResult> = models.iter().flat_map(|model| &model.poses).collect();
        Self {
            adapter: adapter.to_owned(),
            size_px: options.size_px.to_array(),
            seed: options.seed,
            poses: options.poses,
            ratios: all_ratios(&poses, &options.ways),
            models: models.iter().map(of_model).collect(),
            costs: costs(&poses),
            promise: worst_promises(models),
            temporal: mean_paths(models),
            worth: worth(models),
        }
    }

    /// The ratio of a way over all models.
    #[must_use]
    pub fn ratio(&self, way: Way, measure: Measure, at_px: f64) -> Option<&Ratios> {
        find(&self.ratios, way, measure, at_px)
    }

    /// What each term of the criterion is worth, as a table in Markdown.
    #[must_use]
    pub fn worth_table(&self) -> String {
        markdown(&self.worth)
    }
}

impl ModelRatios {
    /// The ratio of a way.
    #[must_use]
    pub fn ratio(&self, way: Way, measure: Measure, at_px: f64) -> Option<&Ratios> {
        find(&self.ratios, way, measure, at_px)
    }
}

fn find(all: &[Ratios], way: Way, measure: Measure, at_px: f64) -> Option<&Ratios> {
    all.iter()
        .find(|r| r.way == way && r.measure == measure && r.at_px == at_px)
}

fn all_ratios(poses: &[&PoseResult], ways: &[Way]) -> Vec<Ratios> {
    let mut all = Vec::new();
    for &way in ways {
        for measure in Measure::ALL {
            let at = COMPARED_AT_PX.into_iter();
            all.extend(at.filter_map(|at_px| ratios(poses, way, measure, at_px)));
        }
    }
    all
}

fn costs(poses: &[&PoseResult]) -> Vec<CostAtError> {
    let at = THRESHOLDS_PX.map(f64::from);
    let all = CHARTED
        .into_iter()
        .flat_map(|way| at.map(|at_px| (way, at_px)));
    all.filter_map(|(way, at_px)| cost(poses, way, at_px))
        .collect()
}

/// Clusterlod's mean cost times the mean ratio to it, over the poses that have one. Nothing where
/// clusterlod draws the source itself in some pose.
fn cost(poses: &[&PoseResult], way: Way, at_px: f64) -> Option<CostAtError> {
    let pairs = poses.iter().filter_map(|pose| Pair::new(pose, way, at_px));
    let pairs: Vec<Pair> = pairs.collect();
    let based = poses
        .iter()
        .filter_map(|pose| Pair::new(pose, Way::Clusterlod, at_px));
    let based: Vec<Pair> = based.collect();
    let enough = LEAST_SHARE * poses.len() as f64;
    if pairs.is_empty() || (pairs.len() as f64) < enough || based.len() < poses.len() {
        return None;
    }
    let mean = |of: fn(&Point) -> f64| {
        let base = geometric_mean(based.iter().filter_map(|pair| pair.of_base(of)));
        let ratio = |pair: &Pair| Some(pair.of_way(of)? / pair.of_base(of)?);
        base * geometric_mean(pairs.iter().filter_map(ratio))
    };
    Some(CostAtError {
        way,
        at_px,
        rmse: geometric_mean(based.iter().map(|pair| pair.error)),
        threshold_px: mean(|point| point.threshold),
        triangles: mean(|point| point.triangles as f64),
        units: mean(|point| point.units as f64),
        select_us: mean(|point| point.select_us),
        frame_ms: mean(|point| point.frame_ms),
    })
}

/// A way and clusterlod in one pose at one error.
struct Pair<'a> {
    error: f64,
    way: (&'a Curve, f64),
    base: (&'a Curve, f64),
}

impl<'a> Pair<'a> {
    fn new(pose: &'a PoseResult, way: Way, at_px: f64) -> Option<Self> {
        let base = pose.curve(Way::Clusterlod)?;
        let point = base
            .points
            .iter()
            .find(|p| (p.threshold - at_px).abs() < 1e-4)?;
        let error = point.error.rmse;
        let at = |curve: &'a Curve| Some((curve, triangles_at_error(curve, Measure::Rmse, error)?));
        Some(Self {
            error,
            way: at(pose.curve(way)?)?,
            base: at(base)?,
        })
    }

    fn of_way(&self, cost: fn(&Point) -> f64) -> Option<f64> {
        cost_at_triangles(self.way.0, self.way.1, cost)
    }

    fn of_base(&self, cost: fn(&Point) -> f64) -> Option<f64> {
        cost_at_triangles(self.base.0, self.base.1, cost)
    }
}

/// Of what is positive; 0 for nothing.
pub(super) fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    let logs: Vec<f64> = values.filter(|v| *v > 0.0).map(f64::ln).collect();
    if logs.is_empty() {
        return 0.0;
    }
    (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}

fn worst_promises(models: &[ModelResult]) -> Vec<Kept> {
    let Some(first) = models.first() else {
        return Vec::new();
    };
    let worst = |index: usize| {
        let of_models = models.iter().filter_map(|model| model.promise.get(index));
        let none = Kept {
            triangles: 0.0,
            ..first.promise[index]
        };
        of_models.fold(none, |worst, kept| Kept {
            max_px: worst.max_px.max(kept.max_px),
            p99_9_px: worst.p99_9_px.max(kept.p99_9_px),
            mean_px: worst.mean_px.max(kept.mean_px),
            triangles: worst.triangles + kept.triangles,
            ..worst
        })
    };
    (0..first.promise.len()).map(worst).collect()
}

fn mean_paths(models: &[ModelResult]) -> Vec<OnPath> {
    let Some(first) = models.first() else {
        return Vec::new();
    };
    let mean = |index: usize| {
        let paths = || models.iter().filter_map(|model| model.temporal.get(index));
        let flips: f64 = paths().map(|path| path.flips_per_frame).sum();
        OnPath {
            triangles: geometric_mean(paths().map(|path| path.triangles)),
            temporal_error: geometric_mean(paths().map(|path| path.temporal_error)),
            flips_per_frame: flips / models.len() as f64,
            ..first.temporal[index].clone()
        }
    };
    (0..first.temporal.len()).map(mean).collect()
}
