//! Godot 4's automatic mesh LOD: one level for the whole object.
//!
//! ```text
//! coarsest level with   err s bias / (dist mult) ≤ threshold_px / width_px
//!
//! perspective   mult = 2 tan(fovx/2), so that the left is err s / dist in pixels over the width
//! orthographic  mult = half the width of the view
//! ```
//! From 4.3 `dist` is that to the box (godot pull request 92290), 0 inside, and 1 for orthographic
//! views (57419). As users reported it before:
//!
//! - `dist` to the corner of the box that is nearest along the axis of the view. A turn of the
//!   camera picks another corner (81995, 76436); inside the box that corner is behind or far
//!   (88273, 79590), and an extra cull margin makes the box large (67890);
//! - `dist` for orthographic views too (57404, from the alpha versions);
//! - a scale that bones apply left out (57895, 59147).

use glam::Vec3;

use super::Seen;

pub(super) fn level_4_3(seen: &Seen, threshold_px: f32) -> u32 {
    let outside = {
        let aabb = seen.aabb_relative_to_eye();
        aabb.min.max(-aabb.max).max(Vec3::ZERO)
    };
    let distance = if seen.eye.is_orthographic() {
        1.0
    } else {
        outside.length()
    };
    level(seen, threshold_px, distance, seen.max_scale)
}

pub(super) fn level_4_0(seen: &Seen, threshold_px: f32) -> u32 {
    let aabb = seen.aabb_relative_to_eye();
    let nearest_along_axis = Vec3::select(seen.forward().cmpgt(Vec3::ZERO), aabb.min, aabb.max);
    let node_scale = seen.max_scale / seen.instance.bone_scale;
    level(seen, threshold_px, nearest_along_axis.length(), node_scale)
}

fn level(seen: &Seen, threshold_px: f32, distance: f32, scale: f32) -> u32 {
    let focal_px = if seen.eye.is_orthographic() {
        // Its `mult` is half a width, where that of perspective views is a whole one.
        seen.eye.focal_px() * 2.0
    } else {
        seen.eye.focal_px()
    };
    seen.object
        .coarsest_level(threshold_px, |error| error * scale * focal_px / distance)
}
