//! Inputs of the shader for a view.

use bytemuck::{Pod, Zeroable};
use camera_field::Camera;
use glam::{DMat4, DVec3, DVec4, UVec2, Vec2};

use super::RenderError;
use crate::eye::Eye;

/// The shader's `View`. Models stand at the origin: their local space is the world.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Uniform {
    clip_from_local: [[f32; 4]; 4],
    eye_in_local: [f32; 4],
    light_in_local: [f32; 4],
}

/// The direction from a surface to the light that is fixed in the world.
const TO_LIGHT: DVec3 = DVec3::new(-0.5, 0.7, 0.5);

/// A view of the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldView {
    /// Size of the picture.
    pub(super) size_px: UVec2,
    pub(super) uniform: Uniform,
}

impl WorldView {
    pub(super) fn new(eye: &Eye) -> Result<Self, RenderError> {
        let Camera::Perspective(intrinsics) = &eye.camera else {
            return Err(RenderError::Orthographic);
        };
        let slopes = [intrinsics.slope_min, intrinsics.slope_max];
        let [min, max] = slopes.map(Vec2::as_dvec2);
        let scale = 2.0 / (max - min);
        let middle = (max + min) * 0.5;
        // From camera space (x right, y down, z = depth). Depth is reversed: 1 at the near plane, 0 at infinity.
        let clip_from_camera = DMat4::from_cols(
            DVec4::new(scale.x, 0.0, 0.0, 0.0),
            DVec4::new(0.0, -scale.y, 0.0, 0.0),
            DVec4::new(-middle.x * scale.x, middle.y * scale.y, 0.0, 1.0),
            DVec4::new(0.0, 0.0, f64::from(eye.near), 0.0),
        );
        let position = eye.position().as_dvec3();
        let turn = DMat4::from_mat3(eye.camera_from_world());
        Ok(Self {
            size_px: intrinsics.image_px().round().as_uvec2().max(UVec2::ONE),
            uniform: Uniform {
                // Computed in double precision.
                clip_from_local: (clip_from_camera * turn * DMat4::from_translation(-position))
                    .as_mat4()
                    .to_cols_array_2d(),
                eye_in_local: position.extend(0.0).as_vec4().to_array(),
                light_in_local: TO_LIGHT.normalize().as_vec3().extend(0.0).to_array(),
            },
        })
    }
}
