//! One instance in one view, seen from its local space.

use fieldlod_hierarchy::Sphere;
use wide::f32x8;

use crate::lane::V3;
use crate::stretch::least_stretch;
use crate::validity::Tolerance;
use crate::view::InstanceView;
use crate::view_parts::ViewParts;

/// What rounding may move a point by, relative to the numbers it is made of.
const POSITION_SLACK: f32 = 4e-6;
/// Sizes whose squares can be trusted, in local units.
const SIZES: std::ops::Range<f32> = 1e-4..1e12;

/// An instance in a view with the eye in local space, and by how much distances from it may mislead
/// there.
pub(super) struct LocalView<'a> {
    pub(super) instance: &'a InstanceView,
    pub(super) parts: &'a ViewParts<'a>,
    pub(super) eye: V3<f32x8>,
    /// What rounding may move a point by.
    pub(super) rounding: f32,
    /// That, and how far points may move while the answers stay valid.
    pub(super) slack: f32,
    /// By how much an axis may turn meanwhile.
    pub(super) turned: f32,
    /// Greatest by least stretch of the instance: what distances in local space may mislead by.
    pub(super) unevenness: f32,
    /// Whether squares of lengths can be trusted.
    pub(super) has_usable_size: bool,
}

impl<'a> LocalView<'a> {
    /// For groups within `bounds`, and for all poses within `tolerance`: its move is that of points in camera space,
    /// by turns too.
    #[inline]
    pub(super) fn new(
        instance: &'a InstanceView,
        parts: &'a ViewParts<'a>,
        bounds: &Sphere,
        tolerance: &Tolerance,
    ) -> Self {
        let most = instance.camera_per_local;
        let eye = instance.camera_from_local.inverse() * -instance.origin_in_camera;
        // About how far from the eye the farthest point is, at most.
        let size = eye.length() + bounds.center.length() + bounds.radius;
        let rounding = POSITION_SLACK * size + 1e-14;
        Self {
            instance,
            parts,
            eye: V3::splat(eye),
            rounding,
            slack: rounding + tolerance.moved / most * 1.001,
            turned: tolerance.turned,
            unevenness: most / (least_stretch(&instance.camera_from_local, most) * 0.999),
            has_usable_size: SIZES.contains(&size),
        }
    }
}
