//! meshoptimizer's clusterlod, and with it most cluster renderers.
//!
//! ```text
//! err s cot(fovy/2)/2 H / max(d − r, near)        d  distance to the sphere's centre, r its radius
//! ```
//! Turns of the camera change nothing; so it cannot know the stretch off the axis, up to 1/cos²φ.
//! `s` is the greatest axis of the scale, as in NVIDIA's samples; clusterlod itself works in local
//! space. Source: meshoptimizer `demo/clusterlod.h`, `boundsError`; nvpro-samples
//! `vk_lod_clusters`.

use fieldlod_hierarchy::Sphere;

use super::Seen;

pub(super) fn error_px(seen: &Seen, group: usize, bounds: &Sphere) -> f32 {
    let error = seen.object.errors_in_local[group] * seen.max_scale;
    let error_at_unit_px = error * seen.eye.focal_px();
    if seen.eye.is_orthographic() {
        error_at_unit_px
    } else {
        error_at_unit_px / seen.distance_to(bounds).max(seen.eye.near)
    }
}
