//! All formulas. The parent module defines their scalar and vector types.

mod applications;
mod bounds;
mod camera;
mod flux;
mod intrinsics;
mod orthographic;
mod planar;
mod pose;
mod spherical;

use super::scalar;

pub use applications::*;
pub use bounds::SphereBound;
pub use camera::{CAMERA_FROM_VIEW, Camera, ProjectionError};
pub use intrinsics::Intrinsics;
pub use orthographic::OrthographicIntrinsics;
pub use planar::PlanarCamera;
pub use pose::{Pose, PosedCamera, compound_density, compound_field};
pub use spherical::{Spherical, SphericalBasis};
