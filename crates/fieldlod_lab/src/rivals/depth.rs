//! Depth in place of distance.
//!
//! ```text
//! err s f / max(z − r, near)        z  depth of the sphere's centre along the axis
//! ```
//! Right for displacements along the picture's tangent, and short by 1/cos φ of those along its
//! radius.

use super::Seen;

pub(super) fn error_px(seen: &Seen, group: usize) -> f32 {
    let error = seen.object.errors_in_local[group] * seen.max_scale;
    let bounds = &seen.object.nested_bounds[group];
    let error_at_unit_px = error * seen.eye.focal_px();
    if seen.eye.is_orthographic() {
        error_at_unit_px
    } else {
        let depth = seen.in_camera(bounds.center).z - bounds.radius * seen.max_scale;
        error_at_unit_px / depth.max(seen.eye.near)
    }
}
