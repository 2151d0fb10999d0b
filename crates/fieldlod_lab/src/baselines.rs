//! The rules of other systems.
//!
//! ```text
//! e  error of a group or level    s  largest scale of the instance    f  focal length, px
//! d  distance to the centre of the sphere, r  its radius, near  distance of the near plane
//! ```
//!
//! **clusterlod** (meshoptimizer `demo/clusterlod.h`, `boundsError`; nvpro-samples `vk_lod_clusters`) refines a
//! group if `e s f / max(d − r, near)` exceeds the threshold, on nested spheres. The rule ignores the view direction,
//! and with it the stretch off the axis, up to 1/cos²φ. The factor `s` is NVIDIA's; clusterlod works in local space.
//! Orthographic views have no distance: the error is `e s f`, with `f` in pixels per unit.
//!
//! **Godot from 4.3** (automatic mesh LOD, pull requests 92290 and 57419) chooses one level for the whole
//! object. It is the coarsest level with `e s f / distance ≤ threshold`. The distance is measured to the box with
//! its cull margin. It is 0 inside the box and 1 in orthographic views.
//!
//! **`VisibilityRange`** (`bevy_camera::visibility`) chooses one level for the whole object by the distance to its
//! centre. It ignores the field of view, the window and the object's scale.

use glam::Vec3;

use crate::object_view::ObjectView;

/// clusterlod's screen-space error of a group, in pixels.
pub(crate) fn clusterlod_error_px(view: &ObjectView, group: usize) -> f32 {
    let error = view.object.errors_in_local[group] * view.max_scale * view.eye.focal_px();
    if view.eye.is_orthographic() {
        return error;
    }
    let distance = view.distance_to(&view.object.nested_bounds[group]);
    error / distance.max(view.eye.near)
}

/// Godot's level for the whole object; 0 is the source.
pub(crate) fn godot_level(view: &ObjectView, threshold_px: f32) -> u32 {
    // Godot compares errors with half of the width of orthographic views, and with the full width of perspective views.
    let (distance, widths) = if view.eye.is_orthographic() {
        (1.0, 2.0)
    } else {
        let aabb = view.aabb_relative_to_eye();
        (aabb.min.max(-aabb.max).max(Vec3::ZERO).length(), 1.0)
    };
    let focal_px = view.eye.focal_px() * widths;
    let within = |error: &&f32| **error * view.max_scale * focal_px / distance <= threshold_px;
    // Level 0 is the source, which has no error.
    let errors = view.object.level_errors_in_local.iter().skip(1);
    errors.take_while(within).count() as u32
}

/// `VisibilityRange`'s level for the whole object; 0 is the source.
pub(crate) fn visibility_range_level(view: &ObjectView, threshold_px: f32) -> u32 {
    let distance = view.distance_to_center();
    let starts = |level: &u32| distance >= view.object.range_start(*level, threshold_px);
    let levels = 1..view.object.level_count();
    levels.take_while(starts).count() as u32
}
