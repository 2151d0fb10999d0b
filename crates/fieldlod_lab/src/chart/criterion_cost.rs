//! What each term of our criterion costs in time; what it is worth is in the pictures and promises.

use std::hint::black_box;
use std::time::{Duration, Instant};

use fieldlod_select::{InstanceView, refine};
use serde::{Deserialize, Serialize};

use super::pose::poses;
use super::scene::ChartScene;
use crate::eye::Eye;
use crate::method::Method;
use crate::object_view::ObjectView;

/// The methods that are told apart: our criteria, each without one of its terms, and what they are
/// compared with.
pub const ABLATED: [Method; 11] = [
    Method::Quality,
    Method::NoProjection,
    Method::NoSilhouette,
    Method::NoOffAxis,
    Method::NoBound,
    Method::ShareInView,
    Method::Guaranteed,
    Method::GuaranteedNoOffAxis,
    Method::GuaranteedNoBound,
    Method::ClusterlodOnOurLevels,
    Method::Clusterlod,
];

/// The threshold at which they are, in pixels.
pub(super) const ABLATED_AT_PX: f32 = 1.0;

/// The number of places that the camera stands at.
const PLACES: usize = 6;
/// The number of times that each is timed, of which the fastest counts.
const ROUNDS: usize = 15;
/// Scans in a round that take so few microseconds.
const SCANS: u32 = 8;

/// Time that a method takes for each group of a model, on one thread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CriterionCost {
    /// The method.
    pub method: Method,
    /// Time by plain code, one group after the other, in nanoseconds.
    pub plain_ns: f64,
    /// Time as in a frame, eight groups at once and conservative tests first, in nanoseconds; of methods
    /// that the selection can be told to be, and of clusterlod.
    pub fast_ns: Option<f64>,
}

/// Times the criteria alone, without gathering units.
pub(super) fn criterion_costs(scene: &ChartScene, seed: u64) -> Vec<CriterionCost> {
    let poses = poses(scene.ours.object, PLACES, seed);
    let eyes: Vec<Eye> = poses.iter().map(|pose| scene.eye(pose)).collect();
    let cost = |method| {
        // The mean over groups and places.
        let groups = scene.levels(method).object.hierarchy.groups.len().max(1) as f64;
        let mean_ns = |seconds: f64| seconds * 1e9 / (groups * eyes.len() as f64);
        let plain = eyes.iter().map(|eye| plain(scene, method, eye));
        let fast = eyes.iter().map(|eye| fast(scene, method, eye));
        CriterionCost {
            method,
            plain_ns: mean_ns(plain.sum()),
            fast_ns: fast.sum::<Option<f64>>().map(mean_ns),
        }
    };
    ABLATED.into_iter().map(cost).collect()
}

/// Seconds for all groups by plain code.
fn plain(scene: &ChartScene, method: Method, eye: &Eye) -> f64 {
    let view = scene.view(method, eye);
    let count = view.object.hierarchy.groups.len();
    // How many groups exceed the threshold.
    let exceeding = |error_px: &dyn Fn(&ObjectView, usize) -> f32| {
        let view = black_box(&view);
        (0..count)
            .filter(|&group| error_px(view, group) > ABLATED_AT_PX)
            .count()
    };
    let run = || match method.terms() {
        Some(terms) => {
            let terms = black_box(terms);
            exceeding(&|view, group| terms.error_px(view, group))
        }
        None => exceeding(&|view, group| method.group_error_px(view, group).unwrap_or(f32::NAN)),
    };
    least_seconds(|| {
        black_box(run());
    })
}

/// Seconds as in a frame, for the methods that have such code.
fn fast(scene: &ChartScene, method: Method, eye: &Eye) -> Option<f64> {
    // Ours as the selection does it, clusterlod by its scan.
    let mut bits = Vec::new();
    let selection = &scene.levels(method).fast_selection;
    if let Some(settings) = method.settings(ABLATED_AT_PX) {
        let view = eye.view().with_margins(&settings);
        let instance = InstanceView::new(&view, &scene.instance.world_from_local);
        return Some(seconds_of_a_scan(|| {
            refine(&selection.table, &instance, &settings, &[], &mut bits);
            black_box(&bits);
        }));
    }
    let view = scene.view(method, eye);
    method.is_clusterlods_rule().then(|| {
        seconds_of_a_scan(|| {
            selection.scan.refine(&view, ABLATED_AT_PX, &mut bits);
            black_box(&bits);
        })
    })
}

fn seconds_of_a_scan(mut scan: impl FnMut()) -> f64 {
    least_seconds(|| (0..SCANS).for_each(|_| scan())) / f64::from(SCANS)
}

fn least_seconds(mut run: impl FnMut()) -> f64 {
    let timed = (0..ROUNDS).map(|_| {
        let start = Instant::now();
        run();
        start.elapsed()
    });
    timed.min().unwrap_or(Duration::ZERO).as_secs_f64()
}
