//! All formulas, on the scalar and vector types of the module that holds this one.

mod bounds;
mod camera;
mod flux;
mod intrinsics;
mod ldi;
mod level_surface;
mod lod;
mod orthographic;
mod planar;
mod pose;
mod spherical;
mod splat;
mod statistics;
mod texture;

use super::scalar;

pub use bounds::{SphereBound, SphereExtent};
pub use camera::{CAMERA_FROM_VIEW, Camera, ProjectionError};
pub use intrinsics::Intrinsics;
pub use ldi::{EquivalentCamera, FieldLine, ParallelCamera, convergent_point, equivalent_camera};
pub use level_surface::LevelSurfaceMesh;
pub use lod::{LodCriteria, coarsest_level};
pub use orthographic::OrthographicIntrinsics;
pub use planar::PlanarCamera;
pub use pose::{Pose, PosedCamera, compound_density, compound_field};
pub use spherical::{Spherical, SphericalBasis};
pub use splat::{SplatKernel, Surfel, splat_area_px2};
pub use statistics::{SurfaceSamples, best_placement};
pub use texture::{FilterKernel, filter_dimension, mip_level};
