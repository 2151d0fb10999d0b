//! Bevy's meshlets.
//!
//! ```text
//! perspective    err cot(fovy/2)/2 H / max(d − s r, near)        the scale s is not on err
//! orthographic   err s H / height
//! ```
//! Source: `bevy_pbr`, `meshlet/cull_clusters.wgsl`, `lod_error_is_imperceptible`; its threshold is
//! fixed at 1 px.

use super::Seen;

pub(super) fn error_px(seen: &Seen, group: usize) -> f32 {
    let error = seen.object.errors_in_local[group];
    let focal_px = seen.eye.focal_px();
    if seen.eye.is_orthographic() {
        error * seen.max_scale * focal_px
    } else {
        let distance = seen.distance_to(&seen.object.nested_bounds[group]);
        error * focal_px / distance.max(seen.eye.near)
    }
}
