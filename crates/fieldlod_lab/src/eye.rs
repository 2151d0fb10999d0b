//! What the methods are told: a camera somewhere, and an instance somewhere.

use camera_field::{CAMERA_FROM_VIEW, Camera};
use fieldlod_select::View;
use glam::{Affine3A, DMat3, DVec2, DVec3, Mat3, Mat4, Quat, Vec2, Vec3};

/// A camera with its place in the world, and what only some of the baselines ask of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Projection to pixels.
    pub camera: Camera,
    /// View space looks along −Z with +Y up; a rotation and a translation.
    pub world_from_view: Affine3A,
    /// Distance of the near plane, in world units.
    pub near: f32,
    /// How far the camera is zoomed in by a factor apart from its field of view, as three.js has
    /// it; already in `camera`.
    pub zoom: f32,
}

/// The place of an instance, and what only some of the baselines ask of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// The transform that every vertex is drawn with.
    pub world_from_local: Affine3A,
    /// The part of its scale that bones apply and the node does not show.
    pub bone_scale: f32,
    /// The margin of its box for culling, in world units (Godot's extra cull margin).
    pub cull_margin: f32,
}

impl Instance {
    /// An instance without bones or margin.
    #[must_use]
    pub fn at(world_from_local: Affine3A) -> Self {
        Self {
            world_from_local,
            bone_scale: 1.0,
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
    /// For fields of view or windows that no camera has.
    #[must_use]
    pub fn perspective(fovy_deg: f32, window_px: Vec2, near: f32) -> Self {
        let aspect = window_px.x / window_px.y;
        let projection = Mat4::perspective_infinite_reverse_rh(fovy_deg.to_radians(), aspect, near);
        Self::new(&projection, window_px, near)
    }

    /// An orthographic camera at the origin that sees `height` world units.
    ///
    /// # Panics
    /// For windows that no camera has.
    #[must_use]
    pub fn orthographic(height: f32, window_px: Vec2) -> Self {
        let (half_height, half_width) = (height * 0.5, height * 0.5 * window_px.x / window_px.y);
        let projection = Mat4::orthographic_rh(
            -half_width,
            half_width,
            -half_height,
            half_height,
            0.0,
            height * 1e4,
        );
        Self::new(&projection, window_px, 0.0)
    }

    fn new(projection: &Mat4, window_px: Vec2, near: f32) -> Self {
        let camera = Camera::from_projection(projection, window_px);
        Self {
            camera: camera.expect("a projection of finite, positive extent"),
            world_from_view: Affine3A::IDENTITY,
            near,
            zoom: 1.0,
        }
    }

    /// The same camera at `position`, looking at `target`, with up as near +Y as can be.
    #[must_use]
    pub fn looking_at(self, position: Vec3, target: Vec3) -> Self {
        // Only the turn is taken from the matrix: positions far away would lose digits in it.
        let view = Mat4::look_to_rh(Vec3::ZERO, (target - position).normalize(), Vec3::Y);
        let rotation = Quat::from_mat4(&view).inverse().normalize();
        let world_from_view = Affine3A::from_rotation_translation(rotation, position);
        Self {
            world_from_view,
            ..self
        }
    }

    /// The same place, turned in view space: `yaw_deg` to the left, `pitch_deg` up.
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
            // A shift of the picture is one of the slopes at its sides.
            let shift = shift_px / intrinsics.focal_px;
            intrinsics.slope_min += shift;
            intrinsics.slope_max += shift;
        }
        self
    }

    /// The same view with the middle of the picture enlarged by three.js' `camera.zoom`.
    #[must_use]
    pub fn zoomed(mut self, zoom: f32) -> Self {
        self.zoom = zoom;
        if let Camera::Perspective(intrinsics) = &mut self.camera {
            intrinsics.focal_px *= zoom;
            intrinsics.slope_min /= zoom;
            intrinsics.slope_max /= zoom;
        }
        self
    }

    /// The view that the selection takes.
    #[must_use]
    pub fn view(&self) -> View {
        View::new(self.camera, &self.world_from_view)
    }

    /// Position in the world.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        Vec3::from(self.world_from_view.translation)
    }

    /// The direction of sight in the world.
    #[must_use]
    pub(crate) fn forward(&self) -> Vec3 {
        self.camera_from_world().transpose() * Vec3::Z
    }

    /// Pixels per unit of slope upwards; of an orthographic camera, pixels per world unit.
    #[must_use]
    pub fn focal_px(&self) -> f32 {
        match &self.camera {
            Camera::Perspective(intrinsics) => intrinsics.focal_px.y,
            Camera::Orthographic(intrinsics) => intrinsics.pixels_per_unit.y,
        }
    }

    /// Whether the camera is orthographic, so that distance does not matter.
    #[must_use]
    pub fn is_orthographic(&self) -> bool {
        matches!(self.camera, Camera::Orthographic(_))
    }

    /// Height of the window in pixels.
    #[must_use]
    pub fn height_px(&self) -> f32 {
        match &self.camera {
            Camera::Perspective(intrinsics) => intrinsics.image_px().y,
            Camera::Orthographic(intrinsics) => {
                (intrinsics.max.y - intrinsics.min.y) * intrinsics.pixels_per_unit.y
            }
        }
    }

    /// Turns world directions to camera space (x right, y down, z = depth).
    #[must_use]
    pub(crate) fn camera_from_world(&self) -> Mat3 {
        CAMERA_FROM_VIEW * Mat3::from(self.world_from_view.matrix3).transpose()
    }

    /// Turns world directions to camera space, in full precision.
    pub(crate) fn camera_from_world_exact(&self) -> DMat3 {
        let rotation = Mat3::from(self.world_from_view.matrix3).as_dmat3();
        CAMERA_FROM_VIEW.as_dmat3() * rotation.transpose()
    }

    /// Where a point of camera space falls in the picture, in pixels from its principal point;
    /// `None` in front of the near plane.
    pub(crate) fn project_px(&self, p: DVec3) -> Option<DVec2> {
        match &self.camera {
            Camera::Perspective(intrinsics) => {
                let visible = p.z >= f64::from(self.near);
                visible.then(|| p.truncate() / p.z * intrinsics.focal_px.as_dvec2())
            }
            Camera::Orthographic(intrinsics) => {
                Some(p.truncate() * intrinsics.pixels_per_unit.as_dvec2())
            }
        }
    }
}
