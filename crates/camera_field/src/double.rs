//! The whole crate once more in `f64`, on glam's `DVec3`.
//!
//! The same source files are compiled against other type aliases, so the two cannot drift
//! apart. The tests use this one, to tell an error of a formula from an error of rounding.
#![expect(
    clippy::duplicate_mod,
    reason = "each formula has one source file, compiled for f32 and f64"
)]

mod scalar {
    pub(super) type Real = f64;
    pub(super) use glam::{DMat3 as Mat3, DMat4 as Mat4, DVec2 as Vec2, DVec3 as Vec3};
}

#[path = "bounds.rs"]
mod bounds;
#[path = "camera.rs"]
mod camera;
#[path = "flux.rs"]
mod flux;
#[path = "intrinsics.rs"]
mod intrinsics;
#[path = "ldi.rs"]
mod ldi;
#[path = "level_surface.rs"]
mod level_surface;
#[path = "lod.rs"]
mod lod;
#[path = "orthographic.rs"]
mod orthographic;
#[path = "planar.rs"]
mod planar;
#[path = "pose.rs"]
mod pose;
#[path = "spherical.rs"]
mod spherical;
#[path = "splat.rs"]
mod splat;
#[path = "statistics.rs"]
mod statistics;
#[path = "texture.rs"]
mod texture;

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
