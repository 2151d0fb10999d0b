//! What flickers while the camera moves.

use serde::{Deserialize, Serialize};

use super::stage::in_view;
use super::{ChartError, Stage};
use crate::holes::FlipCounter;
use crate::measure::temporal_error;
use crate::render::Picture;
use crate::rivals::{Chooser, Eye, Method};

/// Frames of the path: half a second.
const FRAMES: usize = 24;
/// Thresholds that ways run at, in pixels.
const THRESHOLDS_PX: [f32; 4] = [0.5, 1.0, 2.0, 4.0];
/// The ways that are compared.
pub const TEMPORAL_METHODS: [Method; 4] = [
    Method::Quality,
    Method::Clusterlod,
    Method::Godot43,
    Method::VisibilityRange,
];

/// A way on a path, with its memory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OnPath {
    /// The way's name.
    pub way: String,
    /// The threshold, in pixels.
    pub threshold_px: f64,
    /// Mean triangles of units in view.
    pub triangles: f64,
    /// Mean over the frames of [`temporal_error`], in levels of 255.
    pub temporal_error: f64,
    /// Groups in view that change and change back within five frames, per frame.
    pub flips_per_frame: f64,
}

/// Walks past an object with some ways at some thresholds.
///
/// # Errors
/// [`ChartError::Render`] from an adapter that stops.
pub fn temporal(stage: &Stage) -> Result<Vec<OnPath>, ChartError> {
    let eyes: Vec<Eye> = (0..FRAMES).map(|frame| eye(stage, frame)).collect();
    let source = stage.source_units();
    let reference = eyes.iter().map(|eye| draw(stage, eye, &source));
    let reference = reference.collect::<Result<Vec<_>, _>>()?;
    let mut results = Vec::new();
    for method in TEMPORAL_METHODS {
        for threshold_px in THRESHOLDS_PX {
            results.push(on_path(stage, &eyes, &reference, method, threshold_px)?);
        }
    }
    Ok(results)
}

/// A walk: forwards, a little to the side, with head-bob.
fn eye(stage: &Stage, frame: usize) -> Eye {
    let share = frame as f32 / FRAMES as f32;
    let (object, radius) = (stage.object, stage.object.radius);
    let angle = 0.3 + 0.15 * share;
    let height = 0.5 + 0.01 * (share * 12.0).sin();
    let direction = glam::Vec3::new(angle.sin(), height, angle.cos()).normalize();
    let distance = radius * (2.6 - 0.5 * share);
    let eye = Eye::perspective(60.0, stage.size_px, radius * 1e-3);
    eye.looking_at(object.center + direction * distance, object.center)
}

fn draw(stage: &Stage, eye: &Eye, units: &[u32]) -> Result<Picture, ChartError> {
    let (units, _) = in_view(&stage.seen(eye), units);
    Ok(stage.renderer.draw(&stage.model, eye, &units)?)
}

fn on_path(
    stage: &Stage,
    eyes: &[Eye],
    reference: &[Picture],
    method: Method,
    threshold_px: f32,
) -> Result<OnPath, ChartError> {
    let mut chooser = Chooser::new(method, threshold_px);
    let mut flips = FlipCounter::default();
    let (mut triangles, mut error) = (0.0, 0.0);
    let mut last: Option<Picture> = None;
    for (frame, eye) in eyes.iter().enumerate() {
        let seen = stage.seen(eye);
        let choice = chooser.choose(&seen);
        let groups = &stage.object.hierarchy.groups;
        flips.add(&choice, |group| seen.touches_sphere(&groups[group].bounds));
        triangles += in_view(&seen, &choice.units).1 as f64;
        let picture = draw(stage, eye, &choice.units)?;
        if let Some(last) = &last {
            let references = [&reference[frame - 1], &reference[frame]];
            error += temporal_error(references, [last, &picture]);
        }
        last = Some(picture);
    }
    Ok(OnPath {
        way: method.name().to_owned(),
        threshold_px: f64::from(threshold_px),
        triangles: triangles / eyes.len() as f64,
        temporal_error: error / (eyes.len() - 1) as f64,
        flips_per_frame: flips.seen() as f64 / eyes.len() as f64,
    })
}
