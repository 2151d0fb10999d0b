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
//! # What the limit is made of
//! By the oracle's sums on the training set, knowing what is hidden would save a fifth of the triangles
//! on hills seen from the ground and a fiftieth on closed objects; the rest of its lead is shading.
//! Two-sided surfaces are refined too little from behind: the cloth needs up to 1.27 times clusterlod's
//! triangles there, and 1.04 times with |m·s| ([`Way::TwoSided`]), which costs closed objects all that
//! the projection factor gains.
//!
//! # Simplifications
//! Pictures are small, for adapters in software. Thresholds in pixels scale with the picture, so that
//! a small picture of a mesh in small units stands for a large one of a finer mesh.

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

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::PictureError;
use crate::render::RenderError;

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

/// Why nothing can be charted.
#[derive(Debug, Error)]
pub enum ChartError {
    /// The renderer fails.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A picture cannot be written.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A file or folder cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}
