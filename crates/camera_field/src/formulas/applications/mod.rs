//! The paper's applications of the field: textures, splats, layered depth images and sample statistics.

use super::{intrinsics, pose, scalar};

mod ldi;
mod splat;
mod statistics;
mod texture;

pub use ldi::{FieldLine, ParallelCamera, convergent_point, equivalent_camera};
pub use splat::{SplatKernel, Surfel, splat_area_px2};
pub use statistics::{SurfaceSamples, best_placement};
pub use texture::{FilterKernel, filter_dimension, mip_level};
