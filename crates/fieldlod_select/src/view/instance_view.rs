//! The map of one instance from local space to camera space.

use camera_field::Camera;
use glam::{Affine3A, Mat3, Vec3};

use super::View;
use super::stretch::{SeenStretch, is_similarity, largest_stretch};

/// The map of one instance to the camera space of one view, prepared once for all groups.
#[derive(Clone, Copy, Debug)]
pub struct InstanceView {
    pub(crate) camera: Camera,
    pub(crate) kept_camera: Camera,
    pub(crate) camera_from_local: Mat3,
    pub(crate) origin_in_camera: Vec3,
    /// The map of normals. It keeps their lengths only if the instance is a similarity.
    pub(crate) normal_in_camera_from_local: Mat3,
    /// The largest factor of lengths, in camera units (= world units) per local unit.
    pub(crate) camera_per_local: f32,
    /// Factors of lengths across a sight ray; `None` for a similarity, which has one factor.
    pub(crate) seen_stretch: Option<SeenStretch>,
}

impl InstanceView {
    /// Prepares the instance placed by `world_from_local`, any affine map, for `view`.
    #[must_use]
    pub fn new(view: &View, world_from_local: &Affine3A) -> Self {
        let (camera_from_local, origin_in_camera) = camera_from_local(view, world_from_local);
        let camera_per_local = largest_stretch(&camera_from_local);
        // A similarity turns normals without stretching them unevenly.
        let normal_map = normal_map(&camera_from_local);
        let (normal_in_camera_from_local, seen_stretch) = if is_similarity(&camera_from_local) {
            (
                // The cofactors of a similarity of scale s are s² times its rotation.
                normal_map * (1.0 / (camera_per_local * camera_per_local)),
                None,
            )
        } else {
            (normal_map, Some(SeenStretch::new(&camera_from_local)))
        };
        Self {
            camera: view.camera,
            kept_camera: view.kept_camera,
            camera_from_local,
            origin_in_camera,
            normal_in_camera_from_local,
            camera_per_local,
            seen_stretch,
        }
    }

    /// A sphere that holds the image of `sphere`, in camera space.
    #[cfg(any(test, feature = "test-support"))]
    #[must_use]
    pub fn sphere_in_camera(
        &self,
        sphere: &fieldlod_hierarchy::Sphere,
    ) -> fieldlod_hierarchy::Sphere {
        fieldlod_hierarchy::Sphere {
            center: self.camera_from_local * sphere.center + self.origin_in_camera,
            radius: self.camera_per_local * sphere.radius,
        }
    }
}

/// The map from local space to camera space: linear part and origin.
pub(crate) fn camera_from_local(view: &View, world_from_local: &Affine3A) -> (Mat3, Vec3) {
    // Relative to the eye, which keeps digits far from the origin.
    let from_eye = Vec3::from(world_from_local.translation) - view.eye_in_world;
    let linear = view.camera_from_world * Mat3::from(world_from_local.matrix3);
    (linear, view.camera_from_world * from_eye)
}

/// The inverse transpose up to a positive factor, without dividing: cofactors times the sign of the
/// determinant. Without the sign, outward normals of mirrored instances would point inward.
fn normal_map(m: &Mat3) -> Mat3 {
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if x.dot(cofactors.x_axis) < 0.0 {
        -cofactors
    } else {
        cofactors
    }
}
