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
mod profile;
mod raster;
mod scene;
mod splatting;

use std::path::Path;

use serde::Serialize;

use crate::files::{WriteError, make_folder, write_file};

pub use figure_09::{CurlAtAngle, Figure9};
pub use figure_10::{Figure10, GradientAtAngle};
pub use figure_11::{Figure11, PatternAtAngle};
pub use figure_14::{DifferenceAtAngle, Figure14};
pub use figure_15::{Figure15, SplatErrors};
pub use figure_18::{Comparison, Comparisons, Figure18, SceneResult};
pub use ldi_set::{LdiCounts, SetResult};

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

/// Draws `figure_09.png` to `figure_18.png` into a folder, which is made if it is missing, writes
/// their numbers to `numbers.json` beside them and returns them.
///
/// # Errors
/// [`WriteError`] if the folder or a file cannot be written.
pub fn draw_figures(folder: &Path) -> Result<PaperNumbers, WriteError> {
    make_folder(folder)?;
    let numbers = PaperNumbers {
        figure_9: figure_09::draw(&folder.join("figure_09.png"))?,
        figure_10: figure_10::draw(&folder.join("figure_10.png"))?,
        figure_11: figure_11::draw(&folder.join("figure_11.png"))?,
        figure_14: figure_14::draw(&folder.join("figure_14.png"))?,
        figure_15: figure_15::draw(&folder.join("figure_15.png"))?,
        figure_18: figure_18::draw(&folder.join("figure_18.png"))?,
    };
    let path = folder.join("numbers.json");
    let json = serde_json::to_vec_pretty(&numbers)
        .map_err(|error| WriteError::new(&path, error.into()))?;
    write_file(&path, &json)?;
    Ok(numbers)
}
