//! What the shader is told of a view.

use bytemuck::{Pod, Zeroable};
use camera_field::Camera;
use fieldlod_hierarchy::Sphere;
use glam::{Affine3A, DAffine3, DMat4, DVec3, DVec4, UVec2};

use super::RenderError;
use crate::eye::Eye;

/// The shader's `View`: a view of one place.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Uniform {
    clip_from_local: [[f32; 4]; 4],
    shadow_from_local: [[f32; 4]; 4],
    eye_in_local: [f32; 4],
    /// The direction, and in `w` whether there are shadows.
    light_in_local: [f32; 4],
}

/// The direction towards the light that is fixed in the world.
const TO_LIGHT: DVec3 = DVec3::new(-0.5, 0.7, 0.5);

/// A view of the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldView {
    /// Size of the picture.
    pub(super) size_px: UVec2,
    clip_from_world: DMat4,
    /// To the shadow map, where there are shadows.
    shadow_from_world: Option<DMat4>,
    eye_in_world: DVec3,
}

impl WorldView {
    /// Of an eye, with shadows of the light within a sphere of the world.
    pub(super) fn new(eye: &Eye, shadows: Option<&Sphere>) -> Result<Self, RenderError> {
        let Camera::Perspective(intrinsics) = &eye.camera else {
            return Err(RenderError::Orthographic);
        };
        let (min, max) = (
            intrinsics.slope_min.as_dvec2(),
            intrinsics.slope_max.as_dvec2(),
        );
        let scale = 2.0 / (max - min);
        let middle = (max + min) * 0.5;
        // Rows from camera space (x right, y down, z = depth); nearness falls from 1 at the near plane.
        let clip_from_camera = DMat4::from_cols(
            DVec4::new(scale.x, 0.0, 0.0, 0.0),
            DVec4::new(0.0, -scale.y, 0.0, 0.0),
            DVec4::new(-middle.x * scale.x, middle.y * scale.y, 0.0, 1.0),
            DVec4::new(0.0, 0.0, f64::from(eye.near), 0.0),
        );
        let position = eye.position().as_dvec3();
        let turn = DMat4::from_mat3(eye.camera_from_world_exact());
        Ok(Self {
            size_px: intrinsics.image_px().round().as_uvec2().max(UVec2::ONE),
            clip_from_world: clip_from_camera * turn * DMat4::from_translation(-position),
            shadow_from_world: shadows.map(shadow_from_world),
            eye_in_world: position,
        })
    }

    /// Whether there are shadows.
    pub(super) fn has_shadows(&self) -> bool {
        self.shadow_from_world.is_some()
    }

    /// The uniform of one place, in full precision until the end. Its scale must be the same along all axes.
    pub(super) fn of_place(&self, world_from_local: &Affine3A) -> Uniform {
        let world_from_local =
            DAffine3::from_cols_array(&world_from_local.to_cols_array().map(f64::from));
        let local_from_world = world_from_local.inverse();
        let shadow = self.shadow_from_world.unwrap_or_default() * world_from_local;
        let eye = local_from_world.transform_point3(self.eye_in_world);
        let light = local_from_world.transform_vector3(TO_LIGHT).normalize();
        let with_shadows = f32::from(u8::from(self.shadow_from_world.is_some()));
        Uniform {
            clip_from_local: (self.clip_from_world * world_from_local)
                .as_mat4()
                .to_cols_array_2d(),
            shadow_from_local: shadow.as_mat4().to_cols_array_2d(),
            eye_in_local: eye.extend(0.0).as_vec4().to_array(),
            light_in_local: light.as_vec3().extend(with_shadows).to_array(),
        }
    }
}

/// A map that looks along the light at a sphere of the world.
fn shadow_from_world(sphere: &Sphere) -> DMat4 {
    let (center, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
    let from = center + TO_LIGHT.normalize() * radius;
    // Nearness, as in pictures: 1 where the light comes in, 0 where it leaves.
    DMat4::orthographic_rh(-radius, radius, -radius, radius, 2.0 * radius, 0.0)
        * DMat4::look_at_rh(from, center, DVec3::Y)
}
