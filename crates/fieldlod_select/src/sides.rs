//! The sides of a view as planes: how far inside or outside of it a point is.

use camera_field::Camera;
use glam::{Mat3, Vec3};

use crate::lane::{Lane, M3, V3};

/// The four sides of a view, as planes whose unit normals point inward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sides<L> {
    inward: [V3<L>; 4],
    /// How far inside each the origin is.
    offset: [L; 4],
}

impl Sides<f32> {
    /// The sides of a camera in its own space.
    pub(crate) fn of(camera: &Camera) -> Self {
        let planes = planes_in_camera(camera);
        Self {
            inward: planes.map(|(inward, _)| V3::splat(inward)),
            offset: planes.map(|(_, offset)| offset),
        }
    }

    /// How far inside of each side a point is, negative outside.
    pub(crate) fn inside(&self, point: V3<f32>) -> [f32; 4] {
        std::array::from_fn(|side| point.dot(self.inward[side]) + self.offset[side])
    }

    /// How far the normals of each side are from those of others.
    pub(crate) fn turned_to(&self, other: &Self) -> [f32; 4] {
        std::array::from_fn(|side| {
            let change = self.inward[side].minus(other.inward[side]);
            change.dot(change).sqrt()
        })
    }

    /// How far from the origin the farthest side is.
    pub(crate) fn reach(&self) -> f32 {
        self.offset
            .iter()
            .fold(0.0, |reach, offset| offset.abs().max(reach))
    }

    /// How far the sides are moved from others.
    pub(crate) fn moved_to(&self, other: &Self) -> [f32; 4] {
        std::array::from_fn(|side| (self.offset[side] - other.offset[side]).abs())
    }

    /// How far a direction leads inwards over each side.
    pub(crate) fn towards(&self, direction: V3<f32>) -> [f32; 4] {
        self.inward.map(|inward| direction.dot(inward))
    }

    /// The sides in a space from which points come to camera space by a linear map and a translation;
    /// distances stay in camera units, and grow by `slack`.
    pub(crate) fn moved<L: Lane>(&self, linear: &Mat3, translation: Vec3, slack: f32) -> Sides<L> {
        let transposed = M3::splat(&linear.transpose());
        let translation = V3::splat(translation);
        Sides {
            inward: self.inward.map(|inward| transposed.of(inward).in_lanes()),
            offset: std::array::from_fn(|side| {
                L::splat(self.inward[side].dot(translation) + self.offset[side] + slack)
            }),
        }
    }
}

impl<L: Lane> Sides<L> {
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

/// The sides of a view in camera space: what `x` or `y`, and what `z` counts in the distance inside each. In an
/// orthographic view `z` is 1: sides are as far from its axis as they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LensSides<L>([[L; 2]; 4]);

impl<L: Lane> LensSides<L> {
    pub(crate) fn of(sides: &Sides<f32>) -> Self {
        Self(std::array::from_fn(|side| {
            let inward = sides.inward[side];
            // One of the latter is zero.
            [inward.x + inward.y, inward.z + sides.offset[side]].map(L::splat)
        }))
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
