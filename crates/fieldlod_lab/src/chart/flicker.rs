//! What flickers while the camera moves.

use serde::{Deserialize, Serialize};

use super::ChartError;
use super::scene::ChartScene;
use crate::chooser::Chooser;
use crate::eye::Eye;
use crate::holes::FlipCounter;
use crate::measure::temporal_error;
use crate::method::Method;
use crate::render::Picture;

/// Frames of the path: half a second.
const FRAMES: usize = 24;
/// Thresholds that methods run at, in pixels.
const THRESHOLDS_PX: [f32; 4] = [0.5, 1.0, 2.0, 4.0];
/// The methods that are compared.
const METHODS: [Method; 4] = [
    Method::Quality,
    Method::Clusterlod,
    Method::Godot43,
    Method::VisibilityRange,
];

/// Flicker of a method at a threshold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlickerResult {
    /// The method.
    pub method: Method,
    /// The threshold, in pixels.
    pub threshold_px: f64,
    /// Mean triangles of units in view.
    pub triangles: f64,
    /// Mean over the frames of [`temporal_error`], in levels of 255.
    pub temporal_error: f64,
    /// Groups in view that change and change back within five frames, per frame.
    pub flips_per_frame: f64,
}

/// Walks past an object with some methods at some thresholds.
///
/// # Errors
/// [`ChartError::Render`] from an adapter that stops.
pub(super) fn flicker(scene: &ChartScene) -> Result<Vec<FlickerResult>, ChartError> {
    // The source in all frames, which all methods are compared with.
    let eyes: Vec<Eye> = (0..FRAMES).map(|frame| eye(scene, frame)).collect();
    let source = scene.ours.object.source_units();
    let drawn = eyes
        .iter()
        .map(|eye| draw(scene, Method::Quality, eye, &source));
    let reference = drawn.collect::<Result<Vec<_>, _>>()?;
    let mut results = Vec::new();
    for method in METHODS {
        for threshold_px in THRESHOLDS_PX {
            results.push(on_path(scene, &eyes, &reference, method, threshold_px)?);
        }
    }
    Ok(results)
}

/// A walk: forwards, a little to the side, with head-bob.
fn eye(scene: &ChartScene, frame: usize) -> Eye {
    let share = frame as f32 / FRAMES as f32;
    let (object, radius) = (scene.ours.object, scene.ours.object.radius);
    let angle = 0.3 + 0.15 * share;
    let height = 0.5 + 0.01 * (share * 12.0).sin();
    let direction = glam::Vec3::new(angle.sin(), height, angle.cos()).normalize();
    let distance = radius * (2.6 - 0.5 * share);
    let eye = Eye::perspective(60.0, scene.size_px, radius * 1e-3);
    eye.looking_at(object.center + direction * distance, object.center)
}

/// Draws some units of a method's levels.
fn draw(
    scene: &ChartScene,
    method: Method,
    eye: &Eye,
    units: &[u32],
) -> Result<Picture, ChartError> {
    let units = scene.view(method, eye).units_in_view(units);
    let model = &scene.levels(method).model;
    Ok(scene.renderer.draw(model, eye, &units)?)
}

fn on_path(
    scene: &ChartScene,
    eyes: &[Eye],
    reference: &[Picture],
    method: Method,
    threshold_px: f32,
) -> Result<FlickerResult, ChartError> {
    // A method with its memory.
    let mut chooser = Chooser::new(method, threshold_px);
    let mut flips = FlipCounter::default();
    let (mut triangles, mut error) = (0.0, 0.0);
    let mut last: Option<Picture> = None;
    for (frame, eye) in eyes.iter().enumerate() {
        let view = scene.view(method, eye);
        let choice = chooser.choose(&view);
        let groups = &view.object.hierarchy.groups;
        flips.add(&choice, |group| view.touches_sphere(&groups[group].bounds));
        let shown = view.units_in_view(&choice.units);
        triangles += view.object.triangle_count(&shown) as f64;
        // Change beyond that of the source.
        let picture = draw(scene, method, eye, &choice.units)?;
        if let Some(last) = &last {
            let references = [&reference[frame - 1], &reference[frame]];
            error += temporal_error(references, [last, &picture]);
        }
        last = Some(picture);
    }
    Ok(FlickerResult {
        method,
        threshold_px: f64::from(threshold_px),
        triangles: triangles / eyes.len() as f64,
        temporal_error: error / (eyes.len() - 1) as f64,
        flips_per_frame: flips.seen() as f64 / eyes.len() as f64,
    })
}
