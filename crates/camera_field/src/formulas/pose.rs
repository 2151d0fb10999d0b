//! Cameras in the world, and the sum of their fields (§3.5).
//!
//! ```text
//! c(p) = Σ −C_i (p − o_i) / (k_i · (p − o_i))³,     k_i = R_i k     (as in 19)
//! ```

use super::intrinsics::Intrinsics;
use super::scalar::{Mat3, Real, Vec3};

/// The position and the rotation of a camera in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// `R`: the rotation from camera space to world space.
    pub world_from_camera: Mat3,
    /// `o`: the centre of projection in the world.
    pub origin: Vec3,
}

impl Pose {
    /// The pose of a camera at `origin` that looks at `target`, with `up` upwards in the image.
    ///
    /// # Panics
    /// Panics if `up` is parallel to the view direction, or `origin` equals `target`.
    pub fn looking_at(origin: Vec3, target: Vec3, up: Vec3) -> Self {
        let k = (target - origin).normalize();
        // `k × up` points to the right of the image, and `k × i` downwards.
        let i = k.cross(up).normalize();
        assert!(
            k.is_finite() && i.is_finite(),
            "the view direction must be finite and not parallel to `up`"
        );
        Self {
            world_from_camera: Mat3::from_cols(i, k.cross(i), k),
            origin,
        }
    }

    /// A point of the world in camera space.
    #[inline]
    pub fn to_camera(&self, p: Vec3) -> Vec3 {
        self.direction_to_camera(p - self.origin)
    }

    /// A direction of the world in camera space.
    #[inline]
    pub fn direction_to_camera(&self, direction: Vec3) -> Vec3 {
        self.world_from_camera.transpose() * direction
    }

    /// A point of camera space in the world.
    #[inline]
    pub fn to_world(&self, p: Vec3) -> Vec3 {
        self.world_from_camera * p + self.origin
    }

    /// The optical axis `k` in the world.
    #[inline]
    pub fn axis(&self) -> Vec3 {
        self.world_from_camera.z_axis
    }
}

/// A perspective camera in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosedCamera {
    /// The camera.
    pub intrinsics: Intrinsics,
    /// The position and the rotation of the camera.
    pub pose: Pose,
}

impl PosedCamera {
    /// Returns `true` if a point of the world is in the field of view.
    #[inline]
    pub fn contains(&self, p: Vec3) -> bool {
        self.intrinsics.contains(self.pose.to_camera(p))
    }

    /// The field at a point of the world, as a vector of the world (eq. 6).
    #[inline]
    pub fn field(&self, p: Vec3) -> Vec3 {
        self.pose.world_from_camera * self.intrinsics.field(self.pose.to_camera(p))
    }

    /// Projection factor `c · n` at a point of the world (eq. 16).
    #[inline]
    pub fn projection_factor(&self, p: Vec3, normal: Vec3) -> Real {
        self.field(p).dot(normal)
    }
}

/// The sum of the fields of several cameras (§3.5).
///
/// Its product with a normal is the joint sampling density of a surface if no camera is behind the
/// surface. A camera behind it counts negatively in the sum, but does not sample the surface.
pub fn compound_field(cameras: &[PosedCamera], p: Vec3) -> Vec3 {
    cameras.iter().map(|camera| camera.field(p)).sum()
}

/// Samples per unit area that several cameras together take of a surface (§3.5). Cameras behind the
/// surface add nothing.
pub fn compound_density(cameras: &[PosedCamera], p: Vec3, normal: Vec3) -> Real {
    let density = |camera: &PosedCamera| camera.projection_factor(p, normal).max(0.0);
    cameras.iter().map(density).sum()
}
