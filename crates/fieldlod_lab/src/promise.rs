//! The guarantee, measured from random cameras under random placements.
//!
//! For each camera, the [displacements](crate::displacement) of three cuts are measured. The first cut is that of
//! [`Method::Guaranteed`]. The others are by clusterlod's metric, on the same hierarchy and on its own. Fields of view
//! range from 30° to 120°. Every other placement is stretched and sheared, and half of these are mirrored.
//!
//! On our hierarchy, both methods use the measured deviations as errors, so only the criterion differs.
//! The hierarchy of clusterlod has the errors that its simplifier reports.

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

/// The size of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// The number of cameras, each with its own placement.
    pub cameras: usize,
    /// The number of points of a surface at which displacements are measured.
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

/// The displacements of one object.
#[derive(Clone, Debug, Serialize)]
pub struct PromiseRun {
    /// The object's name.
    pub name: String,
    /// The number of cameras.
    pub cameras: usize,
    /// The threshold of all methods, in pixels.
    pub threshold_px: f32,
    /// The runs of the guarantee, of clusterlod's metric on our levels, and of clusterlod's metric on its own levels.
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
    /// Displacements over the samples of all cameras.
    #[serde(flatten)]
    pub displacement: Displacement,
    /// Share of the samples above the threshold.
    pub over: f64,
    /// Mean number of chosen triangles.
    pub triangles: f64,
}

/// Measures displacements at `threshold_px` on an object with the levels of this project and with those of clusterlod.
///
/// `progress` is called with the finished part of the work, in cameras. The methods run one after the other.
pub fn measure(
    name: &str,
    [ours, clusterlods]: [&LodObject; 2],
    threshold_px: f32,
    effort: Effort,
    progress: &(dyn Fn(usize) + Sync),
) -> PromiseRun {
    let scenes = scenes(ours, effort);
    let done = AtomicUsize::new(0);
    let methods = METHODS.map(|method| {
        let object = if method.has_own_levels() {
            clusterlods
        } else {
            ours
        };
        let source = SourceSurface::new(&object.hierarchy, effort.samples);
        let found = scenes.par_iter().map(|(eye, instance)| {
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
    // All samples have the same weight, so cameras with many samples count more.
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
        displacement: Displacement::of(&displaced_px),
    }
}

/// Cameras around and inside an object, near and far, which look at a point near it.
fn scenes(object: &LodObject, effort: Effort) -> Vec<(Eye, Instance)> {
    let mut random = Random::new(effort.seed);
    let window_px = Vec2::new(1920.0, 1080.0);
    let scene = |index: usize| {
        // Every other placement is uneven.
        let placement = placement(&mut random, index % 2 == 1);
        let fovy_deg = 30.0 + 90.0 * random.unit();
        let eye = Eye::perspective(fovy_deg, window_px, object.radius * 1e-3);
        let around = object.center + random.vector() * object.radius;
        // The square makes near cameras more frequent. Far ones select few triangles.
        let far = random.unit();
        let away = random.vector().normalize_or(Vec3::X) * (0.6 + 30.0 * far * far);
        let local = object.center + away * object.radius;
        let [position, target] = [local, around].map(|p| placement.transform_point3(p));
        (eye.looking_at(position, target), Instance::at(placement))
    };
    (0..effort.cameras).map(scene).collect()
}

/// A random rotation, uniform scale and translation. Uneven placements are stretched and sheared, and half are mirrored.
fn placement(random: &mut Random, is_uneven: bool) -> Affine3A {
    let mut turn = || {
        let [a, b] = [random.vector(), random.vector()];
        Mat3::from_quat(Quat::from_xyzw(a.x, a.y, a.z, b.x + 0.1).normalize())
    };
    // Both cases draw equally many random numbers, so that later placements do not depend on the case.
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

/// The runs as text, one line per method.
#[must_use]
pub fn table(runs: &[PromiseRun]) -> String {
    let mut text = format!(
        "{:<20}{:>8}{:>24}{:>24}{:>8}{:>10}{:>11}\n",
        "object", "cameras", "method", "displacement px: max", "over", "samples", "triangles"
    );
    for run in runs {
        for row in &run.methods {
            let (method, found) = (row.method.name(), &row.displacement);
            let _ = write!(text, "{:<20}{:>8}{method:>24}", run.name, run.cameras);
            let (over, samples) = (row.over * 100.0, found.samples);
            let _ = write!(text, "{:>24.3}{over:>7.2}%", found.max_px);
            let _ = writeln!(text, "{samples:>10}{:>11.0}", row.triangles);
        }
    }
    text
}
