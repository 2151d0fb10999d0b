//! The camera-sampling field: how densely a camera samples every point of space, and in
//! which direction.
//!
//! Ping-Hsien Lin and Tong-Yee Lee, "Camera-Sampling Field and Its Applications",
//! IEEE Transactions on Visualization and Computer Graphics, 2004. Equation numbers
//! throughout this crate are theirs.
//!
//! # Conventions
//! - Camera space is right-handed: x right, y down, z = depth along the optical axis.
//!   [`CAMERA_FROM_VIEW`] comes from a view space with y up that looks down −z.
//! - Lengths are in scene units, focal lengths in physical pixels; one sample is one pixel.
//! - `ρ = |P|`, `φ` is the angle off the axis, `θ` the angle around it.
//! - The field points to the camera. It is zero outside the field of view.

mod scalar {
    pub(super) type Real = f32;
    pub(super) use glam::{Mat3, Mat4, Vec2, Vec3};
}

mod bounds;
mod camera;
pub mod double;
mod intrinsics;
mod orthographic;

pub use bounds::{SphereBound, SphereExtent};
pub use camera::{CAMERA_FROM_VIEW, Camera, ProjectionError};
pub use intrinsics::Intrinsics;
pub use orthographic::OrthographicIntrinsics;
