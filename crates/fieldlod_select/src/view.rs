//! From local space to camera space: what one instance looks like to one view.

use camera_field::{CAMERA_FROM_VIEW, Camera, Intrinsics, OrthographicIntrinsics};
use fieldlod_hierarchy::Sphere;
use glam::{Affine3A, Mat3, Vec2, Vec3};

use crate::settings::LodSettings;
use crate::shadow_lights::{ShadowLight, ShadowLights};
use crate::stretch::{SeenStretch, is_similarity, largest_stretch};

/// A camera with its place in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    pub(crate) camera: Camera,
    /// The camera of the image itself, without margins.
    pub(crate) image_camera: Camera,
    /// The camera that refined groups leave: as wide or wider.
    pub(crate) kept_camera: Camera,
    /// Linear part only: positions are first taken relative to the eye, which keeps digits far from
    /// the origin.
    pub(crate) camera_from_world: Mat3,
    pub(crate) eye_in_world: Vec3,
    /// The layers that it sees.
    pub(crate) layers: u64,
    /// The lights that may cast shadows into it.
    pub(crate) shadow_lights: ShadowLights,
}

impl View {
    /// A view from the pose of its camera: view space looks along −Z with +Y up.
    #[must_use]
    pub fn new(camera: Camera, world_from_view: &Affine3A) -> Self {
        let view_from_world = Mat3::from(world_from_view.matrix3).inverse();
        Self {
            camera,
            image_camera: camera,
            kept_camera: camera,
            camera_from_world: CAMERA_FROM_VIEW * view_from_world,
            eye_in_world: Vec3::from(world_from_view.translation),
            layers: u64::MAX,
            shadow_lights: ShadowLights::Any,
        }
    }

    /// The same view, into which only these lights cast shadows: where what is outside of it counts
    /// ([`Offscreen::OnAxis`](crate::Offscreen::OnAxis)), instances count that may throw a shadow of one of
    /// them into it. Otherwise, and with more than four lights, all count.
    #[must_use]
    pub fn with_shadow_lights(&self, lights: &[ShadowLight]) -> Self {
        Self {
            shadow_lights: ShadowLights::new(lights),
            ..*self
        }
    }

    /// The same view, which sees only what is on one of `layers`
    /// ([`Scene::set_layers`](crate::Scene::set_layers)). To begin with it sees all.
    #[must_use]
    pub fn with_layers(&self, layers: u64) -> Self {
        Self { layers, ..*self }
    }

    /// The camera's intrinsics.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The view that selection with `settings` looks at: wider by their `offscreen_margin` on each side,
    /// and for refined groups by their `edge_hysteresis` more, at the same pixels per unit.
    #[must_use]
    pub fn with_margins(&self, settings: &LodSettings) -> Self {
        let camera = widened(&self.camera, settings.offscreen_margin);
        // Not narrower, or a group would leave where it enters.
        let margin = settings.edge_hysteresis.max(0.0);
        Self {
            camera,
            kept_camera: widened(&camera, margin),
            ..*self
        }
    }
}

/// A camera of a wider image: `margin` of its width and height more on each side.
fn widened(camera: &Camera, margin: f32) -> Camera {
    let outward = |min: Vec2, max: Vec2| {
        let border = (max - min) * margin;
        (min - border, max + border)
    };
    match *camera {
        Camera::Perspective(camera) => {
            let (slope_min, slope_max) = outward(camera.slope_min, camera.slope_max);
            Camera::Perspective(Intrinsics {
                slope_min,
                slope_max,
                ..camera
            })
        }
        Camera::Orthographic(camera) => {
            let (min, max) = outward(camera.min, camera.max);
            Camera::Orthographic(OrthographicIntrinsics { min, max, ..camera })
        }
    }
}

/// One instance as one view sees it: the map from local to camera space, taken apart once so that
/// each group costs little.
#[derive(Clone, Copy, Debug)]
pub struct InstanceView {
    pub(crate) camera: Camera,
    pub(crate) kept_camera: Camera,
    pub(crate) camera_from_local: Mat3,
    pub(crate) origin_in_camera: Vec3,
    /// Takes normals along. Keeps lengths if the instance is a similarity; else the length is of no
    /// meaning.
    pub(crate) normal_in_camera_from_local: Mat3,
    /// The most that any local length grows, in camera units (= world units) per local unit.
    pub(crate) camera_per_local: f32,
    /// What the instance does to lengths across a sight ray; `None` for a similarity, which stretches
    /// all alike.
    pub(crate) seen_stretch: Option<SeenStretch>,
}

impl InstanceView {
    /// Prepares the instance placed by `world_from_local`, any affine map, for `view`.
    #[must_use]
    pub fn new(view: &View, world_from_local: &Affine3A) -> Self {
        // Relative to the eye, which keeps digits far from the origin.
        let camera_from_local = view.camera_from_world * Mat3::from(world_from_local.matrix3);
        let origin_from_eye = Vec3::from(world_from_local.translation) - view.eye_in_world;
        let camera_per_local = largest_stretch(&camera_from_local);
        // A similarity turns normals without stretching them unevenly.
        let normal_map = normal_map(&camera_from_local);
        let (normal_in_camera_from_local, seen_stretch) = if is_similarity(&camera_from_local) {
            (
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
            origin_in_camera: view.camera_from_world * origin_from_eye,
            normal_in_camera_from_local,
            camera_per_local,
            seen_stretch,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirrored_instances_keep_their_normals_outward() {
        let mirror = Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
        let outward = normal_map(&mirror) * Vec3::X;
        // The point at +X goes to −X, and so does its outward normal.
        assert!(outward.dot(mirror * Vec3::X) > 0.0);
        assert!((normal_map(&mirror) * Vec3::Y).y > 0.0);
    }
}
