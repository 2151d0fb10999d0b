//! The sides of a view as planes: how far inside or outside the view a point is.

use camera_field::Camera;
use glam::Vec3;

use crate::lanes::smaller;

/// The sides of a view in camera space. The distance inside a side is its first factor times `x` or `y`, plus its
/// second times `z` or 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LensSides {
    is_orthographic: bool,
    sides: [[f32; 2]; 4],
}

impl LensSides {
    pub(crate) fn of(camera: &Camera) -> Self {
        let planes = planes_in_camera(camera);
        Self {
            is_orthographic: matches!(camera, Camera::Orthographic(_)),
            // One term of each sum is zero.
            sides: planes.map(|(inward, offset)| [inward.x + inward.y, inward.z + offset]),
        }
    }

    /// How far inside the nearest side a point is, negative outside.
    #[inline(always)]
    pub(crate) fn least_inside(&self, Vec3 { x, y, z }: Vec3) -> f32 {
        let z = if self.is_orthographic { 1.0 } else { z };
        let inside = |side: usize, across: f32| {
            let [of_across, of_z] = self.sides[side];
            across * of_across + z * of_z
        };
        let across = smaller(inside(0, x), inside(1, x));
        let down = smaller(inside(2, y), inside(3, y));
        smaller(across, down)
    }
}

/// The sides of a view in camera space: unit normals that point inward, and how far inside each the origin is.
pub(crate) fn planes_in_camera(camera: &Camera) -> [(Vec3, f32); 4] {
    match camera {
        Camera::Perspective(camera) => {
            let side = |across: Vec3, slope: f32| {
                let inward = across - Vec3::Z * slope;
                (inward / (1.0 + slope * slope).sqrt(), 0.0)
            };
            let (min, max) = (camera.slope_min, camera.slope_max);
            [
                side(Vec3::X, min.x),
                side(-Vec3::X, -max.x),
                side(Vec3::Y, min.y),
                side(-Vec3::Y, -max.y),
            ]
        }
        Camera::Orthographic(camera) => [
            (Vec3::X, -camera.min.x),
            (-Vec3::X, camera.max.x),
            (Vec3::Y, -camera.min.y),
            (-Vec3::Y, camera.max.y),
        ],
    }
}
