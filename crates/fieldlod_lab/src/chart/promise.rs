//! What a threshold in pixels promises, and what is kept of it, with the object towards the picture's
//! corner, where stretch is at its worst.

use serde::{Deserialize, Serialize};

use super::criterion_cost::{ABLATED, ABLATED_AT_PX};
use super::fast_selection::Scratch;
use super::pose::{Pose, poses};
use super::scene::ChartScene;
use crate::displacement::SourceSurface;
use crate::eye::Eye;
use crate::method::Method;

/// Fields of view, in degrees upwards.
pub(super) const PROMISE_FOVS_DEG: [f32; 3] = [45.0, 90.0, 120.0];
/// Requested pixels.
const THRESHOLDS_PX: [f32; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// The methods that are measured at all of them; the ablated ones are at one alone.
const METHODS: [Method; 3] = [Method::Guaranteed, Method::Quality, Method::Clusterlod];
/// Points of the surface at which displacements are measured.
const SAMPLES: usize = 6_000;
/// The number of places that the camera stands at.
const PLACES: usize = 3;

/// Displacements that a method gives at a threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PromiseResult {
    /// The method.
    pub method: Method,
    /// Field of view upwards, in degrees.
    pub fovy_deg: f32,
    /// The threshold, in pixels.
    pub requested_px: f64,
    /// The greatest displacement of all places, in pixels.
    pub max_px: f64,
    /// The displacement that one point in a thousand exceeds, in the worst place, in pixels.
    pub p99_9_px: f64,
    /// The mean displacement over the places, in pixels.
    pub mean_px: f64,
    /// Triangles of units in view, mean over the places.
    pub triangles: f64,
}

/// Measures the displacements that thresholds give.
pub(super) fn promise(scene: &ChartScene, seed: u64) -> Vec<PromiseResult> {
    // The source, as the units of either hierarchy.
    let surface_of = |method| SourceSurface::new(&scene.levels(method).object.hierarchy, SAMPLES);
    let (ours, clusterlods) = (surface_of(Method::Quality), surface_of(Method::Clusterlod));
    // Which methods at which thresholds.
    let at_all = METHODS.map(|method| THRESHOLDS_PX.map(|px| (method, px)));
    let ablated = ABLATED.into_iter().filter(|it| !METHODS.contains(it));
    let at_one = ablated.map(|method| (method, ABLATED_AT_PX));
    let asked: Vec<(Method, f32)> = at_all.into_iter().flatten().chain(at_one).collect();
    // All of them in each field of view.
    let of_fov = |fovy_deg: f32| {
        let eyes = eyes(scene, fovy_deg, seed);
        let results = asked.iter().map(|&(method, threshold_px)| {
            let own = method.has_own_levels();
            let surface = if own { &clusterlods } else { &ours };
            let result = measure(scene, surface, &eyes, method, threshold_px);
            PromiseResult { fovy_deg, ..result }
        });
        results.collect::<Vec<_>>()
    };
    PROMISE_FOVS_DEG.into_iter().flat_map(of_fov).collect()
}

fn eyes(scene: &ChartScene, fovy_deg: f32, seed: u64) -> Vec<Eye> {
    let near_to_far = poses(scene.ours.object, PLACES, seed).into_iter();
    let aside = |pose: Pose| {
        let eye = scene.eye(&Pose { fovy_deg, ..pose });
        eye.turned(0.4 * fovy_deg, 0.25 * fovy_deg)
    };
    near_to_far.map(aside).collect()
}

fn measure(
    scene: &ChartScene,
    surface: &SourceSurface,
    eyes: &[Eye],
    method: Method,
    threshold_px: f32,
) -> PromiseResult {
    let mut result = PromiseResult {
        method,
        requested_px: f64::from(threshold_px),
        ..PromiseResult::default()
    };
    let mut scratch = Scratch::default();
    for eye in eyes {
        // Choose as in a frame, and measure what is chosen.
        let (view, levels) = (scene.view(method, eye), scene.levels(method));
        let selection = &levels.fast_selection;
        let (units, _) = selection.choose(method, &view, threshold_px, &mut scratch);
        let cut = surface.cut(&units);
        let found = surface.displacement(&cut, &scene.instance, eye, false);
        let triangles = levels.object.triangle_count(&view.units_in_view(&units));
        // The worst of all places, or their mean.
        result.max_px = result.max_px.max(found.max_px);
        result.p99_9_px = result.p99_9_px.max(found.p99_9_px);
        result.mean_px += found.mean_px / eyes.len() as f64;
        result.triangles += triangles as f64 / eyes.len() as f64;
    }
    result
}
