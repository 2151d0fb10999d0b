//! Boxes along the axes of local space, and of camera space.

use glam::{Mat3, Vec3};

/// A box along local axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LocalBox {
    pub(crate) center: Vec3,
    pub(crate) half_size: Vec3,
}

/// A box along the axes of camera space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisBox {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
}

impl AxisBox {
    /// The box around a box of local space.
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
}
