//! What the shader is told of a view.

use bytemuck::{Pod, Zeroable};
use camera_field::Camera;
use glam::{DMat4, DVec3, DVec4, UVec2};

use super::RenderError;
use crate::eye::Eye;

/// The shader's `View`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Uniform {
    clip_from_local: [[f32; 4]; 4],
    eye_in_local: [f32; 4],
    light_in_local: [f32; 4],
}

/// The direction towards the light that is fixed in the world.
const TO_LIGHT: DVec3 = DVec3::new(-0.5, 0.7, 0.5);

/// Size of an eye's picture in pixels, and the uniform that draws it.
pub(super) fn of_eye(eye: &Eye) -> Result<(UVec2, Uniform), RenderError> {
    let Camera::Perspective(intrinsics) = &eye.camera else {
        return Err(RenderError::Orthographic);
    };
    let size = intrinsics.image_px().round().as_uvec2().max(UVec2::ONE);
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
    // From local space, which is the world's, by way of the camera, in full precision until the end.
    let position = eye.position().as_dvec3();
    let turn = DMat4::from_mat3(eye.camera_from_world_exact());
    let clip_from_local = clip_from_camera * turn * DMat4::from_translation(-position);
    let extend = |v: DVec3| v.extend(0.0).as_vec4().to_array();
    let uniform = Uniform {
        clip_from_local: clip_from_local.as_mat4().to_cols_array_2d(),
        eye_in_local: extend(position),
        light_in_local: extend(TO_LIGHT.normalize()),
    };
    Ok((size, uniform))
}
