//! A model from one pose: its reference, and how far cuts are from it.

use std::collections::HashMap;
use std::time::Duration;

use super::pose::Pose;
use super::scene::ChartScene;
use crate::eye::Eye;
use crate::measure::{ImageError, image_error};
use crate::object_view::ObjectView;
use crate::render::{Picture, RenderError};

/// The number of times that a charted picture is drawn, of which the fastest counts.
const DRAWS: usize = 3;

/// A pose with its reference and what was measured before.
pub(super) struct PoseView<'a> {
    pub(super) scene: &'a ChartScene<'a>,
    pub(super) eye: Eye,
    pub(super) view: ObjectView<'a>,
    pub(super) reference: Picture,
    /// Different thresholds often choose the same units.
    measured: HashMap<(Vec<u32>, bool), (ImageError, Duration)>,
}

impl<'a> PoseView<'a> {
    /// Draws the source from a pose.
    pub(super) fn new(scene: &'a ChartScene<'a>, pose: &Pose) -> Result<Self, RenderError> {
        let eye = scene.eye(pose);
        let view = scene.view(&eye);
        let units = view.units_in_view(&scene.object.source_units());
        Ok(Self {
            scene,
            eye,
            view,
            reference: scene.renderer.draw(&scene.model, &eye, &units)?,
            measured: HashMap::new(),
        })
    }

    /// Measures how far the picture of some units is from the reference, and the least time to draw it;
    /// with FLIP and an exact time for methods whose pictures and times are charted.
    pub(super) fn measure(
        &mut self,
        units: Vec<u32>,
        is_charted: bool,
    ) -> Result<(ImageError, Duration), RenderError> {
        // The same units give the same picture.
        let key = (units, is_charted);
        if let Some(measured) = self.measured.get(&key) {
            return Ok(*measured);
        }
        let draw = || {
            self.scene
                .renderer
                .draw_timed(&self.scene.model, &self.eye, &key.0)
        };
        let (picture, mut frame) = draw()?;
        for _ in 1..if is_charted { DRAWS } else { 1 } {
            frame = frame.min(draw()?.1);
        }
        let error = image_error(&self.reference, &picture, is_charted);
        self.measured.insert(key, (error, frame));
        Ok((error, frame))
    }
}
