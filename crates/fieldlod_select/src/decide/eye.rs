//! The eye in an instance's local space.

use fieldlod_hierarchy::Sphere;
use glam::Vec3;
use wide::f32x8;

use crate::lane::V3;
use crate::stretch::least_stretch;
use crate::view::InstanceView;

/// What rounding may move a point by, relative to the numbers it is made of.
const POSITION_SLACK: f32 = 4e-6;
/// Sizes whose squares can be trusted, in local units.
const SIZES: std::ops::Range<f32> = 1e-4..1e12;

/// The eye in local space, and by how much distances from it may mislead there.
#[derive(Clone, Copy)]
pub(super) struct LocalEye {
    eye: Vec3,
    /// About how far from the eye the farthest point is, at most.
    size: f32,
    /// What rounding may move a point by.
    pub(super) rounding: f32,
    /// That, and how far points may move while the answers stay valid.
    pub(super) slack: f32,
    /// Greatest by least stretch of the instance: what distances in local space may mislead by.
    pub(super) unevenness: f32,
}

impl LocalEye {
    /// For groups within `bounds`, and for all poses that move no point farther than `tolerance` in
    /// camera space.
    pub(super) fn new(instance: &InstanceView, bounds: &Sphere, tolerance: f32) -> Self {
        let most = instance.camera_per_local;
        let eye = instance.camera_from_local.inverse() * -instance.origin_in_camera;
        let size = eye.length() + bounds.center.length() + bounds.radius;
        let rounding = POSITION_SLACK * size + 1e-14;
        Self {
            eye,
            size,
            rounding,
            slack: rounding + tolerance / most * 1.001,
            unevenness: most / (least_stretch(&instance.camera_from_local, most) * 0.999),
        }
    }

    pub(super) fn in_lanes(&self) -> V3<f32x8> {
        V3::splat(self.eye)
    }

    /// Whether squares of lengths can be trusted.
    pub(super) fn is_usable(&self) -> bool {
        SIZES.contains(&self.size)
    }
}
