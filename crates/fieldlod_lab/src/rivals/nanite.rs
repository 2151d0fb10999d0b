//! Unreal's Nanite.
//!
//! ```text
//! err s_min f / (z_min cos_min)
//!
//! s_min    least axis of the non-uniform scale
//! z_min    least depth of the sphere, at least near
//! cos_min  least cosine off the axis over the sphere, in the plane of the axis and its centre;
//!          where the sphere crosses the near plane, that of its widest point there
//! ```
//! The one rival that knows the stretch off the axis. What is outside the view is culled first; here
//! its error is 0. Source: Unreal Engine 5,
//! `NaniteCullingCommon.ush`, `GetProjectedEdgeScales` and `ShouldVisitChild`.

use super::Seen;

pub(super) fn error_px(seen: &Seen, group: usize) -> f32 {
    let error = seen.object.errors_in_local[group] * seen.min_scale;
    if seen.eye.is_orthographic() {
        return error * seen.eye.focal_px();
    }
    let bounds = &seen.object.nested_bounds[group];
    if !seen.touches_sphere(bounds) {
        return 0.0;
    }
    let center = seen.in_camera(bounds.center);
    let radius = bounds.radius * seen.max_scale;
    let near = seen.eye.near;
    let depth = (center.z - radius).max(near);
    error * seen.eye.focal_px() / (depth * least_cosine(center, radius, near))
}

fn least_cosine(center: glam::Vec3, radius: f32, near: f32) -> f32 {
    let off_axis = center.truncate().length();
    let distance_squared = center.length_squared();
    let to_tangent_squared = distance_squared - radius * radius;
    let to_tangent = to_tangent_squared.max(0.0).sqrt();
    let cosine = (to_tangent * center.z - radius * off_axis) / distance_squared;
    if to_tangent_squared < 0.0 || cosine * to_tangent < near {
        let height = near - center.z;
        let widest = off_axis + (radius * radius - height * height).max(0.0).sqrt();
        near / widest.hypot(near)
    } else {
        cosine
    }
}
