//! The camera and the instance that all methods get.

use camera_field::{CAMERA_FROM_VIEW, Camera};
use fieldlod_select::View;
use glam::{Affine3A, DMat3, DVec2, DVec3, Mat3, Mat4, Quat, Vec2, Vec3};

/// A camera with its position and direction in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Projection to pixels.
    pub camera: Camera,
    /// A rotation and a translation. View space looks along −Z with +Y up.
    pub world_from_view: Affine3A,
    /// Distance of the near plane, in world units.
    pub near: f32,
}

/// The placement of an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// The transform of all vertices.
    pub world_from_local: Affine3A,
    /// The margin around the instance's box for culling, in world units (Godot's extra cull margin).
    pub cull_margin: f32,
}

impl Instance {
    /// An instance without a cull margin.
    #[must_use]
    pub fn at(world_from_local: Affine3A) -> Self {
        Self {
            world_from_local,
            cull_margin: 0.0,
        }
    }
}

impl Default for Instance {
    fn default() -> Self {
        Self::at(Affine3A::IDENTITY)
    }
}

impl Eye {
    /// A perspective camera at the origin.
    ///
    /// # Panics
    /// If the field of view or the window is not finite and positive.
    #[must_use]
    pub fn perspective(fovy_deg: f32, window_px: Vec2, near: f32) -> Self {
        let aspect = window_px.x / window_px.y;
        let projection = Mat4::perspective_infinite_reverse_rh(fovy_deg.to_radians(), aspect, near);
        Self::new(&projection, window_px, near)
    }

    /// An orthographic camera at the origin with a view `height` world units high.
    ///
    /// # Panics
    /// If the window is not finite and positive.
    #[must_use]
    pub fn orthographic(height: f32, window_px: Vec2) -> Self {
        let (half_height, half_width) = (height * 0.5, height * 0.5 * window_px.x / window_px.y);
        let (left, bottom, far) = (-half_width, -half_height, height * 1e4);
        let projection = Mat4::orthographic_rh(left, half_width, bottom, half_height, 0.0, far);
        Self::new(&projection, window_px, 0.0)
    }

    fn new(projection: &Mat4, window_px: Vec2, near: f32) -> Self {
        let camera = Camera::from_projection(projection, window_px);
        Self {
            camera: camera.expect("a projection of finite, positive extent"),
            world_from_view: Affine3A::IDENTITY,
            near,
        }
    }

    /// The same camera at `position`, looking at `target`, with +Y up.
    #[must_use]
    pub fn looking_at(self, position: Vec3, target: Vec3) -> Self {
        // The matrix holds only the rotation, because a position far from the origin would lose digits.
        let view = Mat4::look_to_rh(Vec3::ZERO, (target - position).normalize(), Vec3::Y);
        let rotation = Quat::from_mat4(&view).inverse().normalize();
        let world_from_view = Affine3A::from_rotation_translation(rotation, position);
        Self {
            world_from_view,
            ..self
        }
    }

    /// The same camera, turned in view space: `yaw_deg` to the left, `pitch_deg` up.
    #[must_use]
    pub fn turned(self, yaw_deg: f32, pitch_deg: f32) -> Self {
        let turn = Quat::from_rotation_y(yaw_deg.to_radians())
            * Quat::from_rotation_x(pitch_deg.to_radians());
        Self {
            world_from_view: self.world_from_view * Affine3A::from_quat(turn),
            ..self
        }
    }

    /// The same view with the picture shifted by `shift_px`, as for temporal antialiasing.
    #[must_use]
    pub fn jittered(mut self, shift_px: Vec2) -> Self {
        if let Camera::Perspective(intrinsics) = &mut self.camera {
            // To shift the picture, shift the slopes of its edges.
            let shift = shift_px / intrinsics.focal_px;
            intrinsics.slope_min += shift;
            intrinsics.slope_max += shift;
        }
        self
    }

    /// The same view with the middle of the picture enlarged, as by a zoom lens.
    #[must_use]
    pub fn zoomed(mut self, zoom: f32) -> Self {
        if let Camera::Perspective(intrinsics) = &mut self.camera {
            intrinsics.focal_px *= zoom;
            intrinsics.slope_min /= zoom;
            intrinsics.slope_max /= zoom;
        }
        self
    }

    /// The input of the selection.
    #[must_use]
    pub fn view(&self) -> View {
        View::new(self.camera, &self.world_from_view)
    }

    /// Position in the world.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        Vec3::from(self.world_from_view.translation)
    }

    /// The vertical focal length, in pixels per unit of slope. For an orthographic camera, pixels per world unit.
    #[must_use]
    pub fn focal_px(&self) -> f32 {
        match &self.camera {
            Camera::Perspective(intrinsics) => intrinsics.focal_px.y,
            Camera::Orthographic(intrinsics) => intrinsics.pixels_per_unit.y,
        }
    }

    /// Returns `true` if the camera is orthographic.
    #[must_use]
    pub fn is_orthographic(&self) -> bool {
        matches!(self.camera, Camera::Orthographic(_))
    }

    /// Rotates world directions to camera space (x right, y down, z = depth).
    pub(crate) fn camera_from_world(&self) -> DMat3 {
        let rotation = Mat3::from(self.world_from_view.matrix3).as_dmat3();
        CAMERA_FROM_VIEW.as_dmat3() * rotation.transpose()
    }

    /// Projects a point of camera space to pixels from the principal point; `None` if the point is not in front of a
    /// perspective camera.
    pub(crate) fn project_px(&self, p: DVec3) -> Option<DVec2> {
        match &self.camera {
            Camera::Perspective(intrinsics) => {
                (p.z > 0.0).then(|| p.truncate() / p.z * intrinsics.focal_px.as_dvec2())
            }
            Camera::Orthographic(intrinsics) => {
                Some(p.truncate() * intrinsics.pixels_per_unit.as_dvec2())
            }
        }
    }
}
