//! Draws and measures the cuts of all methods at all thresholds from one pose.

use std::collections::HashMap;

use super::curve::{Curve, Point, PoseResult, THRESHOLDS_PX};
use super::pose::Pose;
use super::{BakedModel, Options};
use crate::chooser::{Choice, Chooser};
use crate::eye::{Eye, Instance};
use crate::measure::{ImageError, image_error};
use crate::method::Method;
use crate::object::{ErrorSource, LodObject, REFERENCE_HEIGHT_PX};
use crate::object_view::ObjectView;
use crate::render::{DrawnModel, Picture, RenderError, Renderer};

/// An uploaded model at the origin, with the levels of both systems.
pub(super) struct Subject<'a> {
    renderer: &'a Renderer,
    pub(super) ours: Levels,
    clusterlods: Levels,
}

/// One system's levels of a model.
pub(super) struct Levels {
    pub(super) object: LodObject,
    model: DrawnModel,
}

impl<'a> Subject<'a> {
    pub(super) fn new(renderer: &'a Renderer, model: BakedModel) -> Self {
        let levels = |hierarchy| Levels {
            model: renderer.upload(&hierarchy, model.surface.as_deref()),
            object: LodObject::new(hierarchy, ErrorSource::Reported),
        };
        Self {
            renderer,
            ours: levels(model.ours),
            clusterlods: levels(model.clusterlods),
        }
    }

    /// The levels that a method chooses from.
    fn levels(&self, method: Method) -> &Levels {
        if method.has_own_levels() {
            &self.clusterlods
        } else {
            &self.ours
        }
    }

    /// Measures all methods from a pose.
    pub(super) fn sweep(&self, pose: &Pose, options: &Options) -> Result<PoseResult, RenderError> {
        let mut view = PoseView::new(self, pose, options)?;
        let curves = options.methods.iter().map(|&method| view.curve(method));
        Ok(PoseResult {
            curves: curves.collect::<Result<_, _>>()?,
            pose: *pose,
        })
    }
}

/// A model from one pose: its reference picture and the errors that are already measured.
struct PoseView<'a> {
    subject: &'a Subject<'a>,
    eye: Eye,
    reference: Picture,
    /// Image errors by units and hierarchy. The cache saves time, because many thresholds choose the same units.
    measured: HashMap<(Vec<u32>, bool), ImageError>,
}

impl<'a> PoseView<'a> {
    fn new(subject: &'a Subject<'a>, pose: &Pose, options: &Options) -> Result<Self, RenderError> {
        // Both hierarchies are seen by the same eye, and compared with the same picture.
        let ours = &subject.ours;
        let eye = pose.eye(&ours.object, options.size_px.as_vec2());
        let view = ObjectView::new(&ours.object, &Instance::default(), &eye);
        let units = view.units_in_view(&ours.object.source_units());
        Ok(Self {
            subject,
            eye,
            reference: subject.renderer.draw(&ours.model, &eye, &units)?,
            measured: HashMap::new(),
        })
    }

    fn curve(&mut self, method: Method) -> Result<Curve, RenderError> {
        let object = &self.subject.levels(method).object;
        let view = ObjectView::new(object, &Instance::default(), &self.eye);
        // Ranges are tuned for the height of the pictures.
        let scale = if method == Method::VisibilityRange {
            REFERENCE_HEIGHT_PX / self.reference.size_px.y as f32
        } else {
            1.0
        };
        let point = |threshold_px: f32| {
            // At 0, every method draws the source, including details that it counts as free of error.
            let choice = if threshold_px == 0.0 {
                Choice::full_detail(&view)
            } else {
                Chooser::new(method, threshold_px * scale).choose(&view)
            };
            // Only units that touch the view are drawn and counted.
            let units = view.units_in_view(&choice.units);
            Ok(Point {
                threshold_px: threshold_px.into(),
                triangles: object.triangle_count(&units),
                error: self.error(method, units)?,
            })
        };
        let points = THRESHOLDS_PX.into_iter().map(point);
        let points = points.collect::<Result<_, _>>()?;
        Ok(Curve { method, points })
    }

    /// The difference between the picture of some units and the reference.
    fn error(&mut self, method: Method, units: Vec<u32>) -> Result<ImageError, RenderError> {
        // The same indices are other units in the other hierarchy.
        let key = (units, method.has_own_levels());
        if let Some(&error) = self.measured.get(&key) {
            return Ok(error);
        }
        let model = &self.subject.levels(method).model;
        let picture = self.subject.renderer.draw(model, &self.eye, &key.0)?;
        let error = image_error(&self.reference, &picture, true);
        self.measured.insert(key, error);
        Ok(error)
    }
}
