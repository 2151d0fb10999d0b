//! The figures of Lin & Lee, "Camera-Sampling Field and Its Applications" (IEEE TVCG 2004),
//! drawn anew from `camera_field`, with the numbers behind each.
//!
//! Every figure is computed in `f64` from fixed seeds, so it comes out the same each time.

mod disks;
mod figure_09;
mod figure_10;
mod figure_11;
mod figure_14;
mod figure_15;
mod figure_18;
mod ldi_set;
mod model;
mod plot;
mod profile;
mod raster;
mod rng;
mod scene;
mod splatting;

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::canvas::PictureError;

pub use figure_09::{CurlAtAngle, Figure9};
pub use figure_10::{Figure10, GradientAtAngle};
pub use figure_11::{Figure11, PatternAtAngle};
pub use figure_14::{DifferenceAtAngle, Figure14};
pub use figure_15::{Figure15, SplatErrors};
pub use figure_18::{Comparison, Comparisons, Figure18, SceneResult};
pub use ldi_set::{LdiCounts, SetResult};

/// Why the figures could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PaperError {
    /// The folder for the pictures cannot be made.
    #[error("cannot make the folder {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A picture cannot be written.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// The numbers of all figures.
#[derive(Clone, Debug, Serialize)]
pub struct PaperNumbers {
    /// The curl.
    pub figure_9: Figure9,
    /// Level surfaces and gradient.
    pub figure_10: Figure10,
    /// Sampling patterns.
    pub figure_11: Figure11,
    /// Splat kernels.
    pub figure_14: Figure14,
    /// A model drawn from splats.
    pub figure_15: Figure15,
    /// Layered depth images.
    pub figure_18: Figure18,
}

/// Draws `figure_09.png` to `figure_18.png` into a folder, which is made if it is missing, and
/// returns their numbers.
///
/// # Errors
/// [`PaperError`] if the folder or a picture cannot be written.
pub fn draw_figures(folder: &Path) -> Result<PaperNumbers, PaperError> {
    fs::create_dir_all(folder).map_err(|source| PaperError::Folder {
        path: folder.to_owned(),
        source,
    })?;
    Ok(PaperNumbers {
        figure_9: figure_09::draw(&folder.join("figure_09.png"))?,
        figure_10: figure_10::draw(&folder.join("figure_10.png"))?,
        figure_11: figure_11::draw(&folder.join("figure_11.png"))?,
        figure_14: figure_14::draw(&folder.join("figure_14.png"))?,
        figure_15: figure_15::draw(&folder.join("figure_15.png"))?,
        figure_18: figure_18::draw(&folder.join("figure_18.png"))?,
    })
}
