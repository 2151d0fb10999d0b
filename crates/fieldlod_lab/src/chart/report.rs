//! Summarises the results of all models and poses.

use serde::Serialize;

use super::curve::{
    Curve, Measure, PoseResult, THRESHOLDS_PX, threshold_at_triangles, triangles_at_error,
};
use super::ratios::{COMPARED_AT_PX, Ratios};
use super::{ModelResult, Options};
use crate::measure::geometric_mean;
use crate::method::Method;

/// The chart has a point of a method only if at least this share of the poses can be compared. With a smaller share, points
/// would be means over few, easy poses; with a larger one, most methods would lose the ends of their curves.
const MIN_COMPARED_SHARE: f64 = 0.6;

/// The numbers of a chart.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The adapter that drew the pictures.
    pub adapter: String,
    /// Width and height of the pictures.
    pub size_px: [u32; 2],
    /// The seed of the poses.
    pub seed: u64,
    /// The number of poses of each model.
    pub poses: usize,
    /// The ratios of all models together.
    pub all: ModelRatios,
    /// The ratios of each model.
    pub models: Vec<ModelRatios>,
    /// The curves of the chart, over all models' poses.
    pub curves: Vec<TrianglesAtError>,
}

/// The ratios of a model, or of all models together.
#[derive(Clone, Debug, Serialize)]
pub struct ModelRatios {
    /// The model's name.
    pub name: String,
    /// Triangles of the source.
    pub triangles: u64,
    /// The number of poses.
    pub poses: usize,
    /// Triangles relative to clusterlod's at equal error.
    pub ratios: Vec<Ratios>,
}

/// A point of the chart: geometric means over poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TrianglesAtError {
    /// The method.
    pub method: Method,
    /// The threshold of clusterlod that gives the error, in pixels.
    pub at_px: f64,
    /// Root mean squared difference of the picture, on a scale of 255.
    pub rmse: f64,
    /// The threshold at which the method has the same error, in pixels.
    pub threshold_px: f64,
    /// Triangles of units in view.
    pub triangles: f64,
}

impl Report {
    /// Summarises models.
    #[must_use]
    pub fn new(models: &[ModelResult], options: &Options, adapter: &str) -> Self {
        let of_model = |model: &ModelResult| ModelRatios {
            name: model.name.clone(),
            triangles: model.triangles,
            poses: model.poses.len(),
            ratios: all_ratios(&model.poses.iter().collect::<Vec<_>>(), &options.methods),
        };
        // The poses of all models have the same weight.
        let poses: Vec<&PoseResult> = models.iter().flat_map(|model| &model.poses).collect();
        let all = ModelRatios {
            name: "all models".to_owned(),
            triangles: models.iter().map(|model| model.triangles).sum(),
            poses: poses.len(),
            ratios: all_ratios(&poses, &options.methods),
        };
        Self {
            adapter: adapter.to_owned(),
            size_px: options.size_px.to_array(),
            seed: options.seed,
            poses: options.poses,
            all,
            models: models.iter().map(of_model).collect(),
            curves: curves(&poses, &options.methods),
        }
    }
}

impl ModelRatios {
    /// The ratio of a method.
    #[must_use]
    pub fn ratio(&self, method: Method, measure: Measure, at_px: f64) -> Option<&Ratios> {
        let mut ratios = self.ratios.iter();
        ratios.find(|r| r.method == method && r.measure == measure && r.at_px == at_px)
    }
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

/// All methods at the errors of all of clusterlod's thresholds.
fn curves(poses: &[&PoseResult], methods: &[Method]) -> Vec<TrianglesAtError> {
    // Full detail has no place on a logarithmic scale of errors.
    let at = || THRESHOLDS_PX.into_iter().skip(1).map(f64::from);
    let all = methods
        .iter()
        .flat_map(|&method| at().map(move |at_px| (method, at_px)));
    all.filter_map(|(method, at_px)| mean_point(poses, method, at_px))
        .collect()
}

/// The mean of clusterlod times the mean ratio of the method to clusterlod, over the poses that can be compared. `None`
/// if there are too few of them, or if clusterlod cannot be compared in some pose.
fn mean_point(poses: &[&PoseResult], method: Method, at_px: f64) -> Option<TrianglesAtError> {
    let pairs_of = |method| -> Vec<Pair> {
        let pairs = poses.iter().map(|pose| Pair::new(pose, method, at_px));
        pairs.flatten().collect()
    };
    let (pairs, based) = (pairs_of(method), pairs_of(Method::Clusterlod));
    // A mean ratio over few poses does not fit clusterlod's mean over all poses.
    let enough = MIN_COMPARED_SHARE * poses.len() as f64;
    if pairs.is_empty() || (pairs.len() as f64) < enough || based.len() < poses.len() {
        return None;
    }
    let mean = |of: fn(&CurvePlace) -> Option<f64>| {
        let base = geometric_mean(based.iter().filter_map(|pair| of(&pair.base)));
        // Full detail has the threshold 0, which has no ratio.
        let of_base = |pair: &Pair| of(&pair.base).filter(|base| *base > 0.0);
        let ratio = |pair: &Pair| Some(of(&pair.method)? / of_base(pair)?);
        Some(base? * geometric_mean(pairs.iter().filter_map(ratio))?)
    };
    Some(TrianglesAtError {
        method,
        at_px,
        rmse: geometric_mean(based.iter().map(|pair| pair.error))?,
        // 0 if no pose has a threshold with these triangles.
        threshold_px: mean(|place| threshold_at_triangles(place.curve, place.triangles))
            .unwrap_or(0.0),
        triangles: mean(|place| Some(place.triangles))?,
    })
}

/// A method and clusterlod in one pose at one error.
struct Pair<'a> {
    error: f64,
    method: CurvePlace<'a>,
    base: CurvePlace<'a>,
}

/// A place on a curve, which may be between its points.
struct CurvePlace<'a> {
    curve: &'a Curve,
    triangles: f64,
}

impl<'a> Pair<'a> {
    fn new(pose: &'a PoseResult, method: Method, at_px: f64) -> Option<Self> {
        let base = pose.curve(Method::Clusterlod)?;
        let error = base.at_threshold(at_px)?.error.rmse;
        let at = |curve: &'a Curve| {
            let triangles = triangles_at_error(curve, Measure::Rmse, error)?;
            Some(CurvePlace { curve, triangles })
        };
        Some(Self {
            error,
            method: at(pose.curve(method)?)?,
            base: at(base)?,
        })
    }
}
