//! What each term of our criterion costs in time; what it is worth is in the pictures and promises.

use std::hint::black_box;
use std::time::{Duration, Instant};

use fieldlod_select::{InstanceView, refine};
use serde::{Deserialize, Serialize};

use super::promise::ABLATED_AT_PX;
use super::{Stage, Way, poses};
use crate::rivals::{Eye, Seen};

/// The ways that are told apart: our criteria, each without one of its terms, and what they are
/// compared with.
pub const ABLATED: [Way; 10] = [
    Way::Quality,
    Way::NoProjection,
    Way::NoSilhouette,
    Way::NoOffAxis,
    Way::NoBound,
    Way::ShareInView,
    Way::Guaranteed,
    Way::GuaranteedNoOffAxis,
    Way::GuaranteedNoBound,
    Way::Clusterlod,
];

/// How many places the camera stands at.
const PLACES: usize = 6;
/// How often each is timed, to take the least.
const ROUNDS: usize = 15;
/// Scans in a round that take so few microseconds.
const SCANS: u32 = 8;

/// Time that a way takes for each group of a model, on one thread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CriterionCost {
    /// The way.
    pub way: Way,
    /// By plain code, one group after the other, in nanoseconds.
    pub plain_ns: f64,
    /// As a frame would: eight groups at once, conservative tests first. Of what the selection can be
    /// told to do, and of clusterlod.
    pub fast_ns: Option<f64>,
}

/// Times the criteria alone, without gathering units.
#[must_use]
pub fn criterion_costs(stage: &Stage, seed: u64) -> Vec<CriterionCost> {
    let of_pose = |pose| stage.eye(&pose);
    let eyes: Vec<Eye> = poses(stage.object, PLACES, seed)
        .into_iter()
        .map(of_pose)
        .collect();
    let groups = stage.object.hierarchy.groups.len().max(1) as f64;
    let mean_ns = |seconds: f64| seconds * 1e9 / (groups * eyes.len() as f64);
    let cost = |way| {
        let plain = eyes.iter().map(|eye| plain(stage, way, eye));
        let fast = eyes.iter().map(|eye| fast(stage, way, eye));
        CriterionCost {
            way,
            plain_ns: mean_ns(plain.sum()),
            fast_ns: fast.sum::<Option<f64>>().map(mean_ns),
        }
    };
    ABLATED.into_iter().map(cost).collect()
}

/// Seconds for all groups by plain code.
fn plain(stage: &Stage, way: Way, eye: &Eye) -> f64 {
    let seen = stage.seen(eye);
    let count = stage.object.hierarchy.groups.len();
    let exceeding = |error_px: &dyn Fn(&Seen, usize) -> f32| {
        let seen = black_box(&seen);
        (0..count)
            .filter(|&group| error_px(seen, group) > ABLATED_AT_PX)
            .count()
    };
    let run = || match (way.terms(), way.rival()) {
        (Some(terms), _) => {
            let terms = black_box(terms);
            exceeding(&|seen, group| terms.error_px(seen, group))
        }
        (None, Some(method)) => {
            exceeding(&|seen, group| method.group_error_px(seen, group).unwrap_or(f32::NAN))
        }
        (None, None) => 0,
    };
    least_seconds(|| {
        black_box(run());
    })
}

/// Seconds as in a frame, for the ways that have such code.
fn fast(stage: &Stage, way: Way, eye: &Eye) -> Option<f64> {
    let mut bits = Vec::new();
    let prepared = &stage.prepared;
    if let Some(settings) = way.settings(ABLATED_AT_PX) {
        let view = eye.view().with_margins(&settings);
        let instance = InstanceView::new(&view, &stage.instance.world_from_local);
        return Some(seconds_of_a_scan(|| {
            refine(&prepared.table, &instance, &settings, &[], &mut bits);
            black_box(&bits);
        }));
    }
    let seen = stage.seen(eye);
    (way == Way::Clusterlod).then(|| {
        seconds_of_a_scan(|| {
            prepared.scan.refine(&seen, ABLATED_AT_PX, &mut bits);
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
