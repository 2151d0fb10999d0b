//! The sides of a view as planes: how far inside or outside of it a point is.

use camera_field::Camera;
use glam::{Mat3, Vec3};

use crate::lane::{Lane, V3};

/// The four sides of a view, as planes whose unit normals point inward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sides<L> {
    inward: [V3<L>; 4],
    /// How far inside each the origin is.
    offset: [L; 4],
}

impl<L: Lane> Sides<L> {
    /// The sides in camera space.
    pub(crate) fn of(camera: &Camera) -> Self {
        Self::moved(camera, &Mat3::IDENTITY, Vec3::ZERO, 0.0)
    }

    /// The sides in a space from which points come to camera space by a linear map and a translation;
    /// distances stay in camera units, and grow by `slack`.
    pub(crate) fn moved(camera: &Camera, linear: &Mat3, translation: Vec3, slack: f32) -> Self {
        let planes = planes_in_camera(camera);
        let transposed = linear.transpose();
        let moved_offset = |(inward, offset): (Vec3, f32)| inward.dot(translation) + offset + slack;
        Self {
            inward: planes.map(|(inward, _)| V3::splat(transposed * inward)),
            offset: planes.map(|plane| L::splat(moved_offset(plane))),
        }
    }

    /// Whether a sphere lies wholly beyond one of the sides.
    #[inline]
    pub(crate) fn exclude(&self, center: V3<L>, radius: L) -> L::Mask {
        let beyond = |side: usize| {
            let inside_by = center.dot(self.inward[side]) + (self.offset[side] + radius);
            inside_by.is_below(L::zero())
        };
        beyond(0) | beyond(1) | beyond(2) | beyond(3)
    }

    /// How far inside the nearest side a point is, negative outside.
    #[inline]
    pub(crate) fn least_inside(&self, point: V3<L>) -> L {
        let inside = |side: usize| point.dot(self.inward[side]) + self.offset[side];
        // Left and right, top and bottom.
        let across = inside(0).smaller(inside(1));
        let down = inside(2).smaller(inside(3));
        across.smaller(down)
    }
}

/// The sides of a perspective view in camera space: what `x` or `y`, and what `z`, counts in the distance
/// inside each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PerspectiveSides<L>([[L; 2]; 4]);

impl<L: Lane> PerspectiveSides<L> {
    pub(crate) fn of(camera: &Camera) -> Self {
        let side = |(inward, _): (Vec3, f32)| [inward.x + inward.y, inward.z].map(L::splat);
        Self(planes_in_camera(camera).map(side))
    }

    /// How far inside the nearest side a point is, negative outside.
    #[inline]
    pub(crate) fn least_inside(&self, V3 { x, y, z }: V3<L>) -> L {
        let inside = |side: usize, across: L| across * self.0[side][0] + z * self.0[side][1];
        let across = inside(0, x).smaller(inside(1, x));
        let down = inside(2, y).smaller(inside(3, y));
        across.smaller(down)
    }
}

/// Unit normals in camera space, and how far the origin there is inside.
fn planes_in_camera(camera: &Camera) -> [(Vec3, f32); 4] {
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
