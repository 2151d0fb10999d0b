//! Boxes along axes: of a mesh in its local space, and what they come to in camera or world space.

use glam::{Affine3A, Mat3, Vec3};

/// A box along local axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LocalBox {
    pub(crate) center: Vec3,
    pub(crate) half_size: Vec3,
}

impl LocalBox {
    /// Around all space.
    pub(crate) const EVERYWHERE: Self = Self {
        center: Vec3::ZERO,
        half_size: Vec3::INFINITY,
    };

    /// Around points; around all space if one of them is not finite.
    pub(crate) fn around(points: impl Iterator<Item = Vec3>) -> Self {
        let bounds = points.fold(AxisBox::EMPTY, |bounds, point| {
            // NaN must not get lost in a minimum.
            if point.is_finite() {
                bounds.and(&AxisBox {
                    min: point,
                    max: point,
                })
            } else {
                AxisBox::EVERYWHERE
            }
        });
        Self {
            center: (bounds.min + bounds.max) * 0.5,
            half_size: (bounds.max - bounds.min) * 0.5,
        }
    }
}

/// A box along the axes of camera or world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisBox {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
}

impl AxisBox {
    /// Around nothing.
    pub(crate) const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Around everything.
    pub(crate) const EVERYWHERE: Self = Self {
        min: Vec3::NEG_INFINITY,
        max: Vec3::INFINITY,
    };

    /// Around a box of local space.
    pub(crate) fn around(local: &LocalBox, linear: &Mat3, origin: Vec3) -> Self {
        let half = local.half_size;
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis].map(Vec3::abs);
        let half = x * half.x + y * half.y + z * half.z;
        let center = *linear * local.center + origin;
        Self {
            min: center - half,
            max: center + half,
        }
    }

    /// Around a placed box of local space; around everything if that is not finite.
    pub(crate) fn placed(local: &LocalBox, world_from_local: &Affine3A) -> Self {
        let linear = Mat3::from(world_from_local.matrix3);
        let placed = Self::around(local, &linear, world_from_local.translation.into());
        if placed.min.is_finite() && placed.max.is_finite() {
            placed
        } else {
            Self::EVERYWHERE
        }
    }

    /// Around both.
    pub(crate) fn and(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}
