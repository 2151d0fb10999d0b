//! From local space to camera space: what one instance looks like to one view.

use camera_field::{CAMERA_FROM_VIEW, Camera};
use fieldlod_hierarchy::Sphere;
use glam::{Affine3A, Mat3, Vec3};

/// A camera with its place in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    camera: Camera,
    /// Linear part only: positions are first taken relative to the eye, which keeps digits far from
    /// the origin.
    camera_from_world: Mat3,
    eye_in_world: Vec3,
}

impl View {
    /// A view from the pose of its camera: view space looks along −Z with +Y up.
    #[must_use]
    pub fn new(camera: Camera, world_from_view: &Affine3A) -> Self {
        let view_from_world = Mat3::from(world_from_view.matrix3).inverse();
        Self {
            camera,
            camera_from_world: CAMERA_FROM_VIEW * view_from_world,
            eye_in_world: Vec3::from(world_from_view.translation),
        }
    }

    /// The camera's intrinsics.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }
}

/// One instance as one view sees it: the map from local to camera space, taken apart once so that
/// each group costs little.
#[derive(Clone, Copy, Debug)]
pub struct InstanceView {
    pub(crate) camera: Camera,
    camera_from_local: Mat3,
    origin_in_camera: Vec3,
    /// Takes normals along; its length is of no meaning.
    normal_in_camera_from_local: Mat3,
    /// The most that any local length grows, in camera units (= world units) per local unit.
    pub(crate) camera_per_local: f32,
}

impl InstanceView {
    /// Prepares the instance placed by `world_from_local`, any affine map, for `view`.
    #[must_use]
    pub fn new(view: &View, world_from_local: &Affine3A) -> Self {
        let camera_from_local = view.camera_from_world * Mat3::from(world_from_local.matrix3);
        let origin_from_eye = Vec3::from(world_from_local.translation) - view.eye_in_world;
        Self {
            camera: view.camera,
            camera_from_local,
            origin_in_camera: view.camera_from_world * origin_from_eye,
            normal_in_camera_from_local: normal_map(&camera_from_local),
            camera_per_local: largest_stretch(&camera_from_local),
        }
    }

    /// A sphere that holds the image of `sphere`, in camera space.
    #[must_use]
    pub fn sphere_in_camera(&self, sphere: &Sphere) -> Sphere {
        Sphere {
            center: self.camera_from_local * sphere.center + self.origin_in_camera,
            radius: self.camera_per_local * sphere.radius,
        }
    }

    /// The mean normal in camera space; its length, a measure of flatness, is kept.
    pub(crate) fn mean_normal_in_camera(&self, mean_normal: Vec3) -> Vec3 {
        let length_in_local = mean_normal.length();
        let turned = self.normal_in_camera_from_local * mean_normal;
        let length = turned.length();
        if length > 0.0 {
            turned * (length_in_local / length)
        } else {
            Vec3::ZERO
        }
    }
}

/// The inverse transpose up to a positive factor, without dividing: cofactors times the sign of the
/// determinant, so that outward normals of mirrored instances still point outward.
fn normal_map(m: &Mat3) -> Mat3 {
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if x.dot(cofactors.x_axis) < 0.0 {
        -cofactors
    } else {
        cofactors
    }
}

/// An upper bound of the largest singular value: by Gershgorin's circles on `MᵀM` and on `MMᵀ`,
/// which have the squared singular values as eigenvalues. Exact, up to rounding, for a rotation
/// after (`MᵀM` diagonal) or before (`MMᵀ` diagonal) a scale along the axes; an overestimate for
/// shears.
fn largest_stretch(m: &Mat3) -> f32 {
    let transposed = m.transpose();
    let widest_circle = |gram: Mat3| {
        let rows = gram.x_axis.abs() + gram.y_axis.abs() + gram.z_axis.abs();
        rows.x.max(rows.y).max(rows.z)
    };
    let squared = widest_circle(transposed * *m).min(widest_circle(*m * transposed));
    squared.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn largest_stretch_is_exact_for_a_rotated_scale_and_a_scaled_rotation() {
        let rotation = Mat3::from_quat(Quat::from_xyzw(0.1, -0.5, 0.7, 0.5).normalize());
        let scale = Mat3::from_diagonal(Vec3::new(0.5, -3.0, 2.0));
        for m in [rotation * scale, scale * rotation, rotation * scale * -1.0] {
            assert!((largest_stretch(&m) - 3.0).abs() < 1e-5, "{m}");
        }
    }

    #[test]
    fn largest_stretch_never_underestimates_a_shear() {
        let shear = Mat3::from_cols(Vec3::X, Vec3::new(2.0, 1.0, 0.0), Vec3::new(0.5, 0.3, 1.0));
        let bound = largest_stretch(&shear);
        for direction in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(0.4, 0.9, 0.1)] {
            let direction = direction.normalize();
            assert!((shear * direction).length() <= bound);
        }
    }

    #[test]
    fn mirrored_instances_keep_their_normals_outward() {
        let mirror = Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
        let outward = normal_map(&mirror) * Vec3::X;
        // The point at +X goes to −X, and so does its outward normal.
        assert!(outward.dot(mirror * Vec3::X) > 0.0);
        assert!((normal_map(&mirror) * Vec3::Y).y > 0.0);
    }
}
