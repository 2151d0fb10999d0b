//! Speed charted against accuracy: ways to choose a level of detail, on the same hierarchies, by
//! the pictures that they give.
//!
//! Every way chooses cuts of a model at a range of thresholds, from a set of [poses](Pose); each cut
//! is drawn, compared with the source mesh, and its costs are counted ([`PoseResult`]). Ways are then
//! compared *at equal error*: how many triangles one needs to be as near to the source as another
//! ([`Ratios`]).
//!
//! # What is fair
//! - All ways see the same hierarchy and the error that the simplifier reports, as they do in their
//!   own systems; only the promise of [`Way::Guaranteed`] is about the measured deviation.
//! - Only units that touch the view are counted, as if all renderers culled them.
//! - Whole-object ways have few cuts to offer; between them, their curves are interpolated as if there
//!   were more.
//!
//! # Training and test
//! The constants of our criterion (the weights of visible share and silhouette, the root, and what
//! 1 px means) were chosen on [`Generated::TRAINING`], the Stanford bunny and the sheen cloth of
//! Khronos' glTF samples, from six poses each (`--seed 11`). What is reported is measured on
//! [`Generated::TEST`], or on models that a user brings, from other poses.
//!
//! # What the limit is made of, and what was tried
//! By the oracle's sums of squared differences for each group, over 30 poses of the training set,
//! triangles at the image error of clusterlod's 0.4, 1 and 2.5 px:
//!
//! | | all | hills |
//! |---|---|---|
//! | the criterion | 0.92 0.89 0.90 | 0.96 0.93 0.91 |
//! | the field at the centre, no bound | 0.92 0.90 0.92 | 0.99 0.98 0.99 |
//! | measured deviation in place of the simplifier's error | 0.92 0.90 0.91 | 0.96 0.95 0.90 |
//! | RMS distance of the two surfaces instead | 0.92 0.89 0.90 | 0.96 0.94 0.91 |
//! | RMS difference of their normals, times √area, instead | 0.95 0.90 0.93 | 0.95 0.95 0.95 |
//! | the stored median of it, times √area, instead | 0.95 0.89 0.93 | 1.06 0.93 0.95 |
//! | geometric mean of the error and that | 0.94 0.89 0.91 | 1.02 0.92 0.93 |
//! | V from all normals, not from their mean | 0.91 0.89 0.90 | 0.95 0.94 0.92 |
//! | and what hides a group from far away in the eye's direction | 0.91 0.88 0.90 | 1.01 0.96 0.95 |
//! | and what hides it from the eye | 0.89 0.86 0.89 | 0.90 0.88 0.90 |
//! | the criterion, by the share of a group's sphere in view | 0.91 0.87 0.89 | 0.88 0.88 0.87 |
//! | both, that and what hides it from the eye | 0.87 0.85 0.88 | 0.82 0.81 0.85 |
//! | the oracle | 0.72 0.76 0.81 | 0.58 0.60 0.65 |
//!
//! No other measure of a group's error is better than that of the simplifier, and no weight of the
//! silhouette (0 to 0.4) or power of V (0.25 to 1) than ours. Only what hides a group from where the eye
//! is would help; what can be baked of that, seen from far away, does not. Groups that the view's edge
//! cuts count too much, on these hills by a twelfth of the triangles ([`Way::ShareInView`]), on those of
//! the test set by none; it is not part of the criterion, as levels would change when the eye turns. The
//! rest of the oracle's lead is light and pattern at the very pixels, which nothing known of a group tells.
//!
//! Two-sided surfaces are refined too little from behind: the cloth needs up to 1.27 times clusterlod's
//! triangles there, and 1.10 times with |m·s| ([`Way::TwoSided`]), which costs closed objects all that
//! the projection factor gains.
//!
//! # Simplifications
//! Pictures are small, for adapters in software. Thresholds in pixels scale with the picture, so that
//! a small picture of a mesh in small units stands for a large one of a finer mesh.

mod ablation;
mod chooser;
mod criterion;
mod curve;
mod draw;
mod figure;
mod generated;
mod methods;
mod oracle;
mod pose;
mod promise;
mod ratios;
mod report;
mod run;
mod stage;
mod store;
mod sweep;
mod temporal;
mod worth;

use thiserror::Error;

use crate::files::WriteError;
use crate::render::RenderError;

pub use ablation::{ABLATED, CriterionCost, criterion_costs};
pub use criterion::Terms;
pub use curve::{Measure, triangles_at_error};
pub use draw::write_charts;
pub use generated::Generated;
pub use methods::Way;
pub use pose::{Pose, poses};
pub use promise::{Kept, PROMISE_FOVS_DEG, PROMISE_THRESHOLDS_PX, PROMISE_WAYS, promise};
pub use ratios::{COMPARED_AT_PX, Ratios, ratios};
pub use report::{CostAtError, ModelRatios, Report};
pub use run::{ModelResult, Options, chart_model};
pub use stage::Stage;
pub use store::Store;
pub use sweep::{Curve, Point, PoseResult, THRESHOLDS_PX, sweep};
pub use temporal::{OnPath, TEMPORAL_METHODS, temporal};
pub use worth::Worth;

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
