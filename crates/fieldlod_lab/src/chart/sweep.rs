//! All ways at all thresholds from one pose.

use std::collections::HashMap;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::chooser::Scratch;
use super::oracle::Oracle;
use super::stage::in_view;
use super::{ChartError, Pose, Stage, Way};
use crate::measure::{ImageError, image_error};
use crate::render::Picture;
use crate::rivals::{Eye, Seen};

/// The thresholds that all ways run at, in pixels.
pub const THRESHOLDS_PX: [f32; 13] = [
    0.15, 0.2, 0.28, 0.4, 0.56, 0.75, 1.0, 1.35, 1.8, 2.5, 3.5, 5.0, 8.0,
];

/// The ways whose pictures are compared by FLIP, too.
const WITH_FLIP: [Way; 4] = [Way::Quality, Way::Clusterlod, Way::Godot, Way::Oracle];

/// How often a charted picture is drawn, to take the least time.
const DRAWS: usize = 3;

/// How often a choice is made, to take the least time.
const SELECTIONS: usize = 5;

/// What one threshold gives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// What was asked for, in pixels; for the oracle, squared levels of error per triangle.
    pub threshold: f64,
    /// Triangles of the units that touch the view.
    pub triangles: u64,
    /// How many such units: draw commands.
    pub units: u64,
    /// How far the picture is from the reference.
    pub error: ImageError,
    /// Time to choose from scratch on one thread, in microseconds: ours by the `Selector`,
    /// clusterlod's by a scan of eight groups at once, others by plain code.
    pub select_us: f64,
    /// Time to draw, in milliseconds.
    pub frame_ms: f64,
}

/// One way over the thresholds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// The way.
    pub way: Way,
    /// From the finest to the coarsest threshold.
    pub points: Vec<Point>,
}

/// What all ways give from one pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseResult {
    /// The pose.
    pub pose: Pose,
    /// Triangles of the source in view.
    pub source_triangles: u64,
    /// Time to draw the source, in milliseconds.
    pub source_frame_ms: f64,
    /// One curve for each way.
    pub curves: Vec<Curve>,
}

impl PoseResult {
    /// The curve of a way.
    #[must_use]
    pub fn curve(&self, way: Way) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.way == way)
    }
}

/// Measures some ways from a pose.
///
/// # Errors
/// [`ChartError::Render`] from an adapter that stops.
pub fn sweep(stage: &Stage, pose: &Pose, ways: &[Way]) -> Result<PoseResult, ChartError> {
    let mut view = PoseView::new(stage, pose)?;
    let curves = ways.iter().map(|&way| view.curve(way));
    Ok(PoseResult {
        pose: *pose,
        curves: curves.collect::<Result<_, _>>()?,
        source_triangles: view.source_triangles,
        source_frame_ms: view.source_frame_ms,
    })
}

/// A pose with its reference and what was measured before.
pub(super) struct PoseView<'a> {
    pub(super) stage: &'a Stage<'a>,
    pub(super) eye: Eye,
    pub(super) seen: Seen<'a>,
    pub(super) reference: Picture,
    source_triangles: u64,
    source_frame_ms: f64,
    scratch: Scratch,
    /// Different thresholds often choose the same units.
    measured: HashMap<(Vec<u32>, bool), (ImageError, f64)>,
}

impl<'a> PoseView<'a> {
    pub(super) fn new(stage: &'a Stage<'a>, pose: &Pose) -> Result<Self, ChartError> {
        let eye = stage.eye(pose);
        let seen = stage.seen(&eye);
        let (units, source_triangles) = in_view(&seen, &stage.source_units());
        let (reference, frame) = stage.renderer.draw_timed(&stage.model, &eye, &units)?;
        Ok(Self {
            stage,
            eye,
            seen,
            reference,
            source_triangles,
            source_frame_ms: milliseconds(frame),
            scratch: Scratch::default(),
            measured: HashMap::new(),
        })
    }

    fn curve(&mut self, way: Way) -> Result<Curve, ChartError> {
        if way == Way::Oracle {
            return self.oracle_curve();
        }
        let points = THRESHOLDS_PX.iter().map(|&threshold| {
            let (units, elapsed) = self.choose(way, threshold);
            self.point(way, f64::from(threshold), &units, elapsed)
        });
        let points = points.collect::<Result<_, _>>()?;
        Ok(Curve { way, points })
    }

    fn choose(&mut self, way: Way, threshold: f32) -> (Vec<u32>, Duration) {
        let Self {
            stage,
            seen,
            scratch,
            ..
        } = self;
        let choose = |_| stage.prepared.choose(way, seen, threshold, scratch);
        let best = (0..SELECTIONS).map(choose);
        let best = best.min_by_key(|(_, elapsed)| *elapsed);
        best.expect("at least one choice")
    }

    fn oracle_curve(&mut self) -> Result<Curve, ChartError> {
        let oracle = Oracle::new(self)?;
        let mut points = Vec::new();
        for threshold in oracle.thresholds(THRESHOLDS_PX.len()) {
            let units = oracle.choose(&self.seen, threshold);
            points.push(self.point(Way::Oracle, f64::from(threshold), &units, Duration::ZERO)?);
        }
        let way = Way::Oracle;
        Ok(Curve { way, points })
    }

    fn point(
        &mut self,
        way: Way,
        threshold: f64,
        units: &[u32],
        elapsed: Duration,
    ) -> Result<Point, ChartError> {
        let (drawn, triangles) = in_view(&self.seen, units);
        let count = drawn.len() as u64;
        let (error, frame_ms) = self.measure(drawn, WITH_FLIP.contains(&way))?;
        Ok(Point {
            threshold,
            triangles,
            units: count,
            error,
            select_us: elapsed.as_secs_f64() * 1e6,
            frame_ms,
        })
    }

    fn measure(
        &mut self,
        drawn: Vec<u32>,
        with_flip: bool,
    ) -> Result<(ImageError, f64), ChartError> {
        let key = (drawn, with_flip);
        if let Some(measured) = self.measured.get(&key) {
            return Ok(*measured);
        }
        let Stage {
            renderer, model, ..
        } = self.stage;
        let (picture, mut frame) = renderer.draw_timed(model, &self.eye, &key.0)?;
        // Only these frames' times are charted.
        for _ in 1..if with_flip { DRAWS } else { 1 } {
            frame = frame.min(renderer.draw_timed(model, &self.eye, &key.0)?.1);
        }
        let error = image_error(&self.reference, &picture, with_flip);
        let measured = (error, milliseconds(frame));
        self.measured.insert(key, measured);
        Ok(measured)
    }
}

fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
