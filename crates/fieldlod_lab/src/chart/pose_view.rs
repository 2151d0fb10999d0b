//! A model from one pose: its reference, and how far cuts are from it.

use std::collections::HashMap;
use std::time::Duration;

use super::curve::CHARTED;
use super::pose::Pose;
use super::scene::ChartScene;
use crate::eye::Eye;
use crate::measure::{ImageError, image_error};
use crate::method::Method;
use crate::render::{Picture, RenderError};

/// The number of times that a charted picture is drawn, of which the fastest counts.
const DRAWS: usize = 3;

/// A pose with its reference and what was measured before.
pub(super) struct PoseView<'a> {
    pub(super) scene: &'a ChartScene<'a>,
    pub(super) eye: Eye,
    pub(super) reference: Picture,
    /// Different thresholds and methods often choose the same units of the same levels.
    measured: HashMap<(Vec<u32>, bool, bool), (ImageError, Duration)>,
}

impl<'a> PoseView<'a> {
    /// Draws the source from a pose.
    pub(super) fn new(scene: &'a ChartScene<'a>, pose: &Pose) -> Result<Self, RenderError> {
        let eye = scene.eye(pose);
        let ours = &scene.ours;
        let view = scene.view(Method::Quality, &eye);
        let units = view.units_in_view(&ours.object.source_units());
        Ok(Self {
            scene,
            eye,
            reference: scene.renderer.draw(&ours.model, &eye, &units)?,
            measured: HashMap::new(),
        })
    }

    /// Measures how far the picture of some units of a method's levels is from the reference, and the
    /// least time to draw it; with FLIP and an exact time for methods whose pictures and times are charted.
    pub(super) fn measure(
        &mut self,
        method: Method,
        units: Vec<u32>,
    ) -> Result<(ImageError, Duration), RenderError> {
        // The same units give the same picture.
        let is_charted = CHARTED.contains(&method);
        let key = (units, method.has_own_levels(), is_charted);
        if let Some(measured) = self.measured.get(&key) {
            return Ok(*measured);
        }
        let scene = self.scene;
        let model = &scene.levels(method).model;
        let draw = || scene.renderer.draw_timed(model, &self.eye, &key.0);
        let (picture, mut frame) = draw()?;
        for _ in 1..if is_charted { DRAWS } else { 1 } {
            frame = frame.min(draw()?.1);
        }
        let error = image_error(&self.reference, &picture, is_charted);
        self.measured.insert(key, (error, frame));
        Ok((error, frame))
    }
}
