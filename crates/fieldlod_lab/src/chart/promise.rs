//! What a threshold in pixels promises, and what is kept of it.

use serde::{Deserialize, Serialize};

use super::chooser::Scratch;
use super::stage::in_view;
use super::{ABLATED, Pose, Stage, Way, poses};
use crate::displacement::SourceSurface;
use crate::rivals::Eye;

/// Fields of view, in degrees upwards.
pub const PROMISE_FOVS_DEG: [f32; 3] = [45.0, 90.0, 120.0];
/// Requested pixels.
pub const PROMISE_THRESHOLDS_PX: [f32; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// The ways that are held to it.
pub const PROMISE_WAYS: [Way; 3] = [Way::Guaranteed, Way::Quality, Way::Clusterlod];
/// What each term of the criterion is worth is measured here alone.
pub(super) const ABLATED_AT_PX: f32 = 1.0;
/// Points of the surface at which displacements are measured.
const SAMPLES: usize = 6_000;
/// How many places the camera stands at.
const PLACES: usize = 3;

/// What a way keeps of a promise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// The way.
    pub way: Way,
    /// Field of view upwards, in degrees.
    pub fovy_deg: f32,
    /// The threshold, in pixels.
    pub requested_px: f64,
    /// The greatest displacement of all places, in pixels.
    pub max_px: f64,
    /// That which one point in a thousand exceeds, in the worst place.
    pub p99_9_px: f64,
    /// Mean displacement over the places.
    pub mean_px: f64,
    /// Triangles of units in view, mean over the places.
    pub triangles: f64,
}

/// Measures displacements with the object towards the picture's corner, where stretch is at its
/// worst.
#[must_use]
pub fn promise(stage: &Stage, seed: u64) -> Vec<Kept> {
    let surface = SourceSurface::new(&stage.object.hierarchy, SAMPLES);
    let mut kept = Vec::new();
    for fovy_deg in PROMISE_FOVS_DEG {
        let eyes = eyes(stage, fovy_deg, seed);
        for way in PROMISE_WAYS {
            let of_threshold = |threshold| of_threshold(stage, &surface, &eyes, way, threshold);
            let all = PROMISE_THRESHOLDS_PX.into_iter().map(of_threshold);
            kept.extend(all.map(|kept| Kept { fovy_deg, ..kept }));
        }
        for way in ABLATED
            .into_iter()
            .filter(|way| !PROMISE_WAYS.contains(way))
        {
            let of_way = of_threshold(stage, &surface, &eyes, way, ABLATED_AT_PX);
            kept.push(Kept { fovy_deg, ..of_way });
        }
    }
    kept
}

fn eyes(stage: &Stage, fovy_deg: f32, seed: u64) -> Vec<Eye> {
    let near_to_far = poses(stage.object, PLACES, seed).into_iter();
    let aside = |pose: Pose| {
        let eye = stage.eye(&Pose { fovy_deg, ..pose });
        eye.turned(0.4 * fovy_deg, 0.25 * fovy_deg)
    };
    near_to_far.map(aside).collect()
}

fn of_threshold(
    stage: &Stage,
    surface: &SourceSurface,
    eyes: &[Eye],
    way: Way,
    threshold_px: f32,
) -> Kept {
    let mut kept = Kept {
        way,
        fovy_deg: 0.0,
        requested_px: f64::from(threshold_px),
        max_px: 0.0,
        p99_9_px: 0.0,
        mean_px: 0.0,
        triangles: 0.0,
    };
    let mut scratch = Scratch::default();
    for eye in eyes {
        let seen = stage.seen(eye);
        let (units, _) = stage
            .prepared
            .choose(way, &seen, threshold_px, &mut scratch);
        let cut = surface.cut(&units);
        let found = surface.displacement(&cut, &stage.instance, eye, false);
        kept.max_px = kept.max_px.max(found.max_px);
        kept.p99_9_px = kept.p99_9_px.max(found.p99_9_px);
        kept.mean_px += found.mean_px / eyes.len() as f64;
        kept.triangles += in_view(&seen, &units).1 as f64 / eyes.len() as f64;
    }
    kept
}
