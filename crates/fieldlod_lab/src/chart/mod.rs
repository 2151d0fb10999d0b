//! Speed charted against accuracy: systems of levels of detail, and methods to choose among levels, by the
//! pictures that they give.
//!
//! Every method chooses cuts of a model at a range of thresholds, from a set of [poses](Pose); each cut
//! is drawn, compared with the source mesh, and its costs are counted ([`PoseResult`]). Methods are then
//! compared *at equal error*: how many triangles one needs to be as near to the source as another
//! ([`Ratios`]).
//!
//! # What is fair
//! - Whole systems are compared: the baseline of all ratios is clusterlod's metric on the hierarchy that
//!   clusterlod builds, by its defaults, of the same mesh in clusters and groups of the same size.
//! - [`ClusterlodOnOurLevels`](crate::method::Method::ClusterlodOnOurLevels) is its metric on our hierarchy:
//!   what the levels gain is above that line, what the criterion gains below it. All other methods choose
//!   from our hierarchy.
//! - All methods see the error that the simplifier reports, as they do in their own systems; only the
//!   promise of [`Method::Guaranteed`](crate::method::Method::Guaranteed) is about the measured deviation.
//! - Only units that touch the view are counted, as if all renderers culled them.
//! - Whole-object methods have few cuts to offer; between them, their curves are interpolated as if there
//!   were more.
//!
//! # Training and test
//! The constants of our criterion (the weights of visible share and silhouette, the root, and what
//! 1 px means) were chosen on [`Generated::TRAINING`], the Stanford bunny and the sheen cloth of
//! Khronos' glTF samples, from six poses each (`--seed 11`). What is reported is measured on
//! [`Generated::TEST`], or on models that a user brings, from other poses.
//!
//! What the limit is made of, and what was tried to come nearer, is in the crate's `RECORD.md`.
//!
//! # Simplifications
//! Pictures are small, for adapters in software. Thresholds in pixels scale with the picture, so that
//! a small picture of a mesh in small units stands for a large one of a finer mesh.

mod ablation;
mod costs;
mod criterion_cost;
mod curve;
mod draw;
mod fast_selection;
mod figure;
mod flicker;
mod generated;
mod model_result;
mod pose;
mod pose_view;
mod promise;
mod ratios;
mod report;
mod scene;
mod store;
mod sweep;

use thiserror::Error;

use crate::files::WriteError;
use crate::render::RenderError;

pub use ablation::AblationRow;
pub use costs::CostAtError;
pub use criterion_cost::{ABLATED, CriterionCost};
pub use curve::{Curve, Measure, Point, PoseResult};
pub use draw::write_charts;
pub use flicker::FlickerResult;
pub use generated::Generated;
pub use model_result::{BakedModel, CHART_METHODS, ModelResult, Options, chart_model};
pub use pose::Pose;
pub use promise::PromiseResult;
pub use ratios::{COMPARED_AT_PX, Ratios};
pub use report::{ModelRatios, Report};
pub use store::Store;

/// Why nothing can be charted.
#[derive(Debug, Error)]
pub enum ChartError {
    /// The renderer fails.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A file or folder cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
