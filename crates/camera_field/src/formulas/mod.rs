//! All formulas. The parent module defines their scalar and vector types.

mod applications;
mod camera;
mod flux;
mod intrinsics;
mod orthographic;
mod over_sphere;
mod planar;
mod pose;
mod spherical;

use super::scalar;

pub use applications::*;
pub use camera::{CAMERA_FROM_VIEW, Camera, ProjectionError};
pub use intrinsics::Intrinsics;
pub use orthographic::OrthographicIntrinsics;
pub use over_sphere::{FieldOfView, FieldOverSphere, SeenSphere};
pub use planar::PlanarCamera;
pub use pose::{Pose, PosedCamera, compound_density, compound_field};
pub use spherical::{Spherical, SphericalBasis};
