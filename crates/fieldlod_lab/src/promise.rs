//! The guaranteed promise, measured: random cameras, random placements, both directions.
//!
//! For each camera the cut that [`Method::Guaranteed`] chooses and that of clusterlod's metric on the
//! same hierarchy are [measured](crate::displacement): points of the source surface to the nearest of
//! the cut, points of the cut to the nearest of the source, each pair projected. Fields of view reach
//! from 30° to 120°, every other placement is no similarity: stretched, sheared or mirrored.
//!
//! Both methods are given the measured deviations as errors, so that the criterion alone differs.

use std::fmt::Write;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, Mat3, Quat, Vec2, Vec3};
use rayon::prelude::*;
use serde::Serialize;

use crate::displacement::SourceSurface;
use crate::rivals::{Chooser, Eye, Instance, LodObject, Method, Seen};

/// How much to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Cameras, each with a placement of its own.
    pub cameras: usize,
    /// Points of a surface at which displacements are measured.
    pub samples: usize,
    /// Where the random numbers start.
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

/// What was found on one object.
#[derive(Clone, Debug, Serialize)]
pub struct PromiseRun {
    /// What it is called.
    pub name: String,
    /// Cameras that looked at it.
    pub cameras: usize,
    /// What all methods were asked for, in pixels.
    pub threshold_px: f32,
    /// Ours, then clusterlod's.
    pub methods: Vec<Tail>,
}

/// The large displacements of one method.
#[derive(Clone, Debug, Serialize)]
pub struct Tail {
    /// The method.
    pub method: Method,
    /// The greatest displacement, in pixels.
    pub max_px: f64,
    /// One in a thousand is greater.
    pub p99_9_px: f64,
    /// Share of the samples above the threshold.
    pub over: f64,
    /// Samples in the picture.
    pub samples: usize,
    /// Mean triangles chosen.
    pub triangles: f64,
}

/// Measures the promise of `threshold_px` on an object.
///
/// `progress` is called with how many cameras are done.
pub fn measure(
    name: &str,
    object: &LodObject,
    threshold_px: f32,
    effort: Effort,
    progress: &(dyn Fn(usize) + Sync),
) -> PromiseRun {
    let source = SourceSurface::new(&object.hierarchy, effort.samples);
    let done = AtomicUsize::new(0);
    let scenes: Vec<(Eye, Instance)> = scenes(object, effort);
    let methods = [Method::Guaranteed, Method::Clusterlod];
    let found: Vec<[Found; 2]> = scenes
        .par_iter()
        .map(|scene| {
            let found = methods.map(|method| look(object, &source, method, threshold_px, scene));
            progress(1 + done.fetch_add(1, Ordering::Relaxed));
            found
        })
        .collect();
    let tails = methods.iter().enumerate().map(|(index, &method)| {
        let of_method = found.iter().map(|pair| &pair[index]);
        tail(method, threshold_px, of_method)
    });
    PromiseRun {
        name: name.to_owned(),
        cameras: effort.cameras,
        threshold_px,
        methods: tails.collect(),
    }
}

struct Found {
    displaced_px: Vec<f64>,
    triangles: u64,
}

fn look(
    object: &LodObject,
    source: &SourceSurface,
    method: Method,
    threshold_px: f32,
    (eye, instance): &(Eye, Instance),
) -> Found {
    let seen = Seen::new(object, instance, eye);
    let choice = Chooser::new(method, threshold_px).choose(&seen);
    let cut = source.cut(&choice.units);
    Found {
        displaced_px: source.displacements(&cut, instance, eye, true),
        triangles: choice.triangle_count(&object.hierarchy),
    }
}

fn tail<'a>(
    method: Method,
    threshold_px: f32,
    found: impl Iterator<Item = &'a Found> + Clone,
) -> Tail {
    let cameras = found.clone().count().max(1);
    let triangles: u64 = found.clone().map(|one| one.triangles).sum();
    let mut all: Vec<f64> = found
        .flat_map(|one| one.displaced_px.iter().copied())
        .collect();
    all.sort_by(f64::total_cmp);
    let over = all.len() - all.partition_point(|&px| px <= f64::from(threshold_px));
    let at = |index: usize| all.get(index).copied().unwrap_or(0.0);
    Tail {
        method,
        max_px: at(all.len().saturating_sub(1)),
        p99_9_px: at(all.len().saturating_sub(1) * 999 / 1000),
        over: over as f64 / all.len().max(1) as f64,
        samples: all.len(),
        triangles: triangles as f64 / cameras as f64,
    }
}

/// Cameras around and inside an object, near and far, that look at it or past it.
fn scenes(object: &LodObject, effort: Effort) -> Vec<(Eye, Instance)> {
    let mut random = Random(effort.seed);
    let window_px = Vec2::new(1920.0, 1080.0);
    let scene = |index: usize| {
        let placement = placement(&mut random, index % 2 == 1);
        let fovy_deg = 30.0 + 90.0 * random.share();
        let eye = Eye::perspective(fovy_deg, window_px, object.radius * 1e-3);
        let around = object.center + random.vector() * object.radius;
        let far = random.share();
        let away = random.vector().normalize_or(Vec3::X) * (0.6 + 30.0 * far * far);
        let local = object.center + away * object.radius;
        let [position, target] = [local, around].map(|p| placement.transform_point3(p));
        (eye.looking_at(position, target), Instance::at(placement))
    };
    (0..effort.cameras).map(scene).collect()
}

/// Turned, scaled and moved; or stretched, sheared and, half of the time, mirrored as well.
fn placement(random: &mut Random, is_uneven: bool) -> Affine3A {
    let mut turn = || {
        let [a, b] = [random.vector(), random.vector()];
        Mat3::from_quat(Quat::from_xyzw(a.x, a.y, a.z, b.x + 0.1).normalize())
    };
    let (before, after) = (turn(), turn());
    let even = Vec3::splat(0.2 + 3.0 * random.share());
    let uneven = Vec3::new(random.share(), random.share(), random.share()) * 3.0 + 0.2;
    let mirror = if random.share() < 0.5 { -1.0 } else { 1.0 };
    let linear = if is_uneven {
        after * Mat3::from_diagonal(uneven * Vec3::new(mirror, 1.0, 1.0)) * before
    } else {
        after * Mat3::from_diagonal(even)
    };
    Affine3A::from_mat3_translation(linear, random.vector() * 10.0)
}

/// A generator of numbers that needs no crate: the same on every machine.
struct Random(u64);

impl Random {
    /// In `0..1`.
    fn share(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In the cube from −1 to 1.
    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.share(), self.share(), self.share()) * 2.0 - 1.0
    }
}

/// The runs as text, one line for each.
#[must_use]
pub fn table(runs: &[PromiseRun]) -> String {
    let mut text = format!(
        "{:<20}{:>8}{:>12}{:>24}{:>8}{:>8}{:>10}{:>11}\n",
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
        for tail in &run.methods {
            let _ = writeln!(
                text,
                "{:<20}{:>8}{:>12}{:>24.3}{:>8.3}{:>7.2}%{:>10}{:>11.0}",
                run.name,
                run.cameras,
                tail.method.name(),
                tail.max_px,
                tail.p99_9_px,
                tail.over * 100.0,
                tail.samples,
                tail.triangles
            );
        }
    }
    text
}
