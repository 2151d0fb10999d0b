//! The chart: triangles against image error, for this project and other systems.
//!
//! Every method chooses cuts of a model at a range of thresholds, from several [poses](Pose). Each cut is drawn and
//! compared with the source mesh, and its triangles are counted ([`PoseResult`]). Methods are then compared *at
//! equal error*: how many triangles does one method need for the image error of another ([`Ratios`])?
//!
//! # Fairness of the comparison
//! - The baseline of all ratios is clusterlod as a whole: its metric on the hierarchy that clusterlod builds of the
//!   same mesh. The build uses clusterlod's defaults, with clusters and groups of the same size as ours.
//! - [`ClusterlodOnOurLevels`](crate::method::Method::ClusterlodOnOurLevels) is clusterlod's metric on this project's
//!   hierarchy. It separates the gain of the levels from that of the criterion. All other methods use this
//!   project's hierarchy.
//! - Both hierarchies are drawn with the texture of the file, or with a fine pattern if no texture could be read.
//! - All methods use the error that the simplifier reports. Only [`Guaranteed`](crate::method::Method::Guaranteed)
//!   uses the measured deviation.
//! - Only units that touch the view are counted, as a renderer with frustum culling draws them.
//! - Whole-object methods have few cuts. The curves are interpolated between these cuts.
//!
//! # Training and test
//! The constants of the [criterion](fieldlod_select::group_error_px) were chosen on three generated models
//! ([`Generated::TRAINING`]), the Stanford bunny and the sheen cloth of Khronos' glTF samples, from six poses
//! each. The reported figures are measured from other poses, on [`Generated::TEST`] or on a user's models.
//!
//! # Simplifications
//! Pictures are small, because software adapters are slow. Thresholds in pixels scale with the picture, so a small
//! picture of a mesh in small units represents a large picture of a finer mesh.

mod curve;
mod draw;
mod generated;
mod pose;
mod ratios;
mod report;
mod sweep;

use std::sync::Arc;

use fieldlod_bake::Surface;
use fieldlod_hierarchy::Hierarchy;
use glam::UVec2;
use serde::Serialize;

use crate::method::Method;
use crate::render::{RenderError, Renderer};
use pose::poses;
use sweep::Subject;

pub(crate) use curve::at_error;
pub use curve::{Curve, Measure, Point, PoseResult};
pub use draw::draw_chart;
pub use generated::Generated;
pub use pose::Pose;
pub use ratios::{COMPARED_AT_PX, Ratios};
pub use report::{ModelRatios, Report, TrianglesAtError};

/// Settings of a chart.
#[derive(Clone, Debug)]
pub struct Options {
    /// The number of poses.
    pub poses: usize,
    /// The seed of the poses.
    pub seed: u64,
    /// Size of the pictures.
    pub size_px: UVec2,
    /// The methods to compare; clusterlod must be among them.
    pub methods: Vec<Method>,
}

/// A mesh baked by both systems.
#[derive(Clone, Debug)]
pub struct BakedModel {
    /// The model's name.
    pub name: String,
    /// This project's hierarchy.
    pub ours: Hierarchy,
    /// [clusterlod's hierarchy](fieldlod_bake::clusterlod_hierarchy) of the same mesh.
    pub clusterlods: Hierarchy,
    /// The surface that both are drawn with, if it is known.
    pub surface: Option<Arc<Surface>>,
}

/// The curves of a model.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ModelResult {
    /// The model's name.
    pub name: String,
    /// Triangles of the source.
    pub triangles: u64,
    /// The curves from each pose.
    pub poses: Vec<PoseResult>,
}

/// Measures a model. `step` is called after each pose.
///
/// # Errors
/// [`RenderError`] if the device is lost.
pub fn chart_model(
    renderer: &Renderer,
    model: BakedModel,
    options: &Options,
    step: &dyn Fn(),
) -> Result<ModelResult, RenderError> {
    let name = model.name.clone();
    let subject = Subject::new(renderer, model);
    let object = &subject.ours.object;
    let poses = poses(object, options.poses, options.seed).into_iter();
    let swept = poses.map(|pose| {
        let result = subject.sweep(&pose, options);
        step();
        result
    });
    Ok(ModelResult {
        name,
        triangles: object.hierarchy.source_triangle_count(),
        poses: swept.collect::<Result<_, _>>()?,
    })
}
