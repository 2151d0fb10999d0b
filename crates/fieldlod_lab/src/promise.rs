//! The guarantee measured with random cameras and placements, in both directions.
//!
//! For each camera the cut that [`Method::Guaranteed`] chooses, that of clusterlod's metric on the same
//! hierarchy and that of clusterlod's metric on its own hierarchy are [measured](crate::displacement):
//! points of the source surface to the nearest of the cut, points of the cut to the nearest of the source,
//! each pair projected. Fields of view reach from 30° to 120°, every other placement is no similarity:
//! stretched, sheared or mirrored.
//!
//! On our hierarchy both methods are given the measured deviations as errors, so that the criterion alone
//! differs. clusterlod's own has the errors that its simplifier reports.

use std::fmt::Write;
use std::sync::atomic::{AtomicUsize, Ordering};

use fieldlod_hierarchy::fixtures::Random;
use glam::{Affine3A, Mat3, Quat, Vec2, Vec3};
use rayon::prelude::*;
use serde::Serialize;

use crate::chooser::Chooser;
use crate::displacement::{Displacement, SourceSurface};
use crate::eye::{Eye, Instance};
use crate::method::Method;
use crate::object::LodObject;
use crate::object_view::ObjectView;

/// The amount of work that goes into a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Cameras, each with a placement of its own.
    pub cameras: usize,
    /// Points of a surface at which displacements are measured.
    pub samples: usize,
    /// The seed of the random numbers.
    pub seed: u64,
}

impl Default for Effort {
    fn default() -> Self {
        Self {
            cameras: 500,
            samples: 4_000,
            seed: 1,
        }
    }
}

/// Displacements found on one object.
#[derive(Clone, Debug, Serialize)]
pub struct PromiseRun {
    /// The object's name.
    pub name: String,
    /// The number of cameras that looked at the object.
    pub cameras: usize,
    /// The threshold that all methods were asked for, in pixels.
    pub threshold_px: f32,
    /// Ours, then clusterlod's metric on our levels and on its own.
    pub methods: Vec<MethodRun>,
}

/// The methods that are measured.
const METHODS: [Method; 3] = [
    Method::Guaranteed,
    Method::ClusterlodOnOurLevels,
    Method::Clusterlod,
];

/// The displacements of one method over all cameras.
#[derive(Clone, Debug, Serialize)]
pub struct MethodRun {
    /// The method.
    pub method: Method,
    /// Displacements of the samples of all cameras together.
    #[serde(flatten)]
    pub displacement: Displacement,
    /// Share of the samples above the threshold.
    pub over: f64,
    /// Mean triangles chosen.
    pub triangles: f64,
}

/// Measures the promise of `threshold_px` on an object, and on `clusterlods`, the same object as clusterlod
/// bakes it.
///
/// `progress` is called with how many cameras are done.
pub fn measure(
    name: &str,
    object: &LodObject,
    clusterlods: &LodObject,
    threshold_px: f32,
    effort: Effort,
    progress: &(dyn Fn(usize) + Sync),
) -> PromiseRun {
    let scenes = scenes(object, effort);
    let done = AtomicUsize::new(0);
    let methods = METHODS.map(|method| {
        let object = if method.has_own_levels() {
            clusterlods
        } else {
            object
        };
        let source = SourceSurface::new(&object.hierarchy, effort.samples);
        let found = scenes.par_iter().map(|(eye, instance)| {
            // Choose a cut as the camera sees the object, and measure it.
            let view = ObjectView::new(object, instance, eye);
            let units = Chooser::new(method, threshold_px).choose(&view).units;
            let cut = source.cut(&units);
            let displaced_px = source.displacements(&cut, instance, eye, true);
            progress(done.fetch_add(1, Ordering::Relaxed).div_ceil(METHODS.len()));
            (displaced_px, object.triangle_count(&units))
        });
        method_run(method, threshold_px, found.collect())
    });
    PromiseRun {
        name: name.to_owned(),
        cameras: effort.cameras,
        threshold_px,
        methods: methods.into(),
    }
}

fn method_run(method: Method, threshold_px: f32, cameras: Vec<(Vec<f64>, u64)>) -> MethodRun {
    // All samples of all cameras count alike.
    let count = cameras.len().max(1) as f64;
    let triangles: u64 = cameras.iter().map(|(_, triangles)| triangles).sum();
    let displaced_px: Vec<f64> = cameras.into_iter().flat_map(|(px, _)| px).collect();
    let over = displaced_px
        .iter()
        .filter(|&&px| px > f64::from(threshold_px));
    MethodRun {
        method,
        over: over.count() as f64 / displaced_px.len().max(1) as f64,
        triangles: triangles as f64 / count,
        displacement: Displacement::of(displaced_px),
    }
}

/// Cameras around and inside an object, near and far, that look at it or past it.
fn scenes(object: &LodObject, effort: Effort) -> Vec<(Eye, Instance)> {
    let mut random = Random::new(effort.seed);
    let window_px = Vec2::new(1920.0, 1080.0);
    let scene = |index: usize| {
        // Every other placement is uneven.
        let placement = placement(&mut random, index % 2 == 1);
        let fovy_deg = 30.0 + 90.0 * random.unit();
        let eye = Eye::perspective(fovy_deg, window_px, object.radius * 1e-3);
        // The camera stands somewhere near or far, and looks at something near the object.
        let around = object.center + random.vector() * object.radius;
        let far = random.unit();
        let away = random.vector().normalize_or(Vec3::X) * (0.6 + 30.0 * far * far);
        let local = object.center + away * object.radius;
        let [position, target] = [local, around].map(|p| placement.transform_point3(p));
        (eye.looking_at(position, target), Instance::at(placement))
    };
    (0..effort.cameras).map(scene).collect()
}

/// Turns, scales and moves; or stretches, shears and, half of the time, mirrors as well.
fn placement(random: &mut Random, is_uneven: bool) -> Affine3A {
    let mut turn = || {
        let [a, b] = [random.vector(), random.vector()];
        Mat3::from_quat(Quat::from_xyzw(a.x, a.y, a.z, b.x + 0.1).normalize())
    };
    // All numbers are drawn in either case, so that the sequence goes on alike.
    let (before, after) = (turn(), turn());
    let even = Vec3::splat(0.2 + 3.0 * random.unit());
    let uneven = Vec3::new(random.unit(), random.unit(), random.unit()) * 3.0 + 0.2;
    let mirror = if random.unit() < 0.5 { -1.0 } else { 1.0 };
    let linear = if is_uneven {
        after * Mat3::from_diagonal(uneven * Vec3::new(mirror, 1.0, 1.0)) * before
    } else {
        after * Mat3::from_diagonal(even)
    };
    Affine3A::from_mat3_translation(linear, random.vector() * 10.0)
}

/// Writes the runs as text, one line for each method.
#[must_use]
pub fn table(runs: &[PromiseRun]) -> String {
    let mut text = format!(
        "{:<20}{:>8}{:>24}{:>24}{:>8}{:>8}{:>10}{:>11}\n",
        "object",
        "cameras",
        "method",
        "displacement px: max",
        "p99.9",
        "over",
        "samples",
        "triangles"
    );
    for run in runs {
        for row in &run.methods {
            let (method, found) = (row.method.name(), &row.displacement);
            let _ = write!(text, "{:<20}{:>8}{method:>24}", run.name, run.cameras);
            let _ = write!(text, "{:>24.3}{:>8.3}", found.max_px, found.p99_9_px);
            let (over, samples) = (row.over * 100.0, found.samples);
            let _ = writeln!(text, "{over:>7.2}%{samples:>10}{:>11.0}", row.triangles);
        }
    }
    text
}
